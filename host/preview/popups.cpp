// What asks for something: a path, an effect. And the help panel.
#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <filesystem>

#include "error.hpp"
#include "preview/app.hpp"
#include "preview/shortcuts.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

namespace {

namespace fs = std::filesystem;

constexpr auto popupFlags =
    ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove;

// Presets by their own name land beside where one stands; a shipped one is not overwritten.
std::string proposedPreset(const App& app) {
    const std::string name = app.session.presetName();
    if (!name.empty() && fs::path(name).extension() == ".json") return name;
    return (name.empty() ? "my_fog" : fs::path(name).stem().string()) + ".json";
}

std::string proposedImage(const App& app) {
    const std::string stem = app.loaded ? app.loaded->frame.name : "frame";
    const std::string what = app.look.show == Show::Image ? app.look.image : "fogged";
    return fs::path(stem).filename().string() + "." + what + (app.look.show == Show::Image ? ".exr" : ".png");
}

// A path typed in; true once it is taken.
bool askPath(App& app, const char* popup, const char* question, const char* verb, std::string& path,
             bool warnsOfOverwriting) {
    bool isTaken = false;
    if (!ImGui::BeginPopupModal(popup, nullptr, popupFlags)) return false;
    ImGui::TextUnformatted(question);
    if (ImGui::IsWindowAppearing()) ImGui::SetKeyboardFocusHere();
    ImGui::SetNextItemWidth(520);
    const bool isEntered = ImGui::InputText(
        "##path", &path, ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_AutoSelectAll);
    app.ui.set("asked", path);
    app.ui.mark(std::string(popup) + ".path");
    std::error_code none;
    if (warnsOfOverwriting && !path.empty() && fs::exists(path, none))
        ImGui::TextColored(colors::warning, "This file exists; it will be replaced.");
    else
        ImGui::TextColored(colors::dim, "%s", path.empty() ? " " : fs::absolute(path, none).string().c_str());
    if ((ImGui::Button(verb) || isEntered) && !path.empty()) isTaken = true;
    app.ui.mark(std::string(popup) + ".go");
    ImGui::SameLine();
    if (ImGui::Button("Cancel") || ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape)))
        ImGui::CloseCurrentPopup();
    if (isTaken) ImGui::CloseCurrentPopup();
    ImGui::EndPopup();
    return isTaken;
}

bool contains(const std::string& words, const std::string& part) {
    auto same = [](char a, char b) { return std::tolower(uint8_t(a)) == std::tolower(uint8_t(b)); };
    return std::search(words.begin(), words.end(), part.begin(), part.end(), same) != words.end();
}

struct Offer {
    std::string name, description, refused;
};

void drawAddEffect(App& app) {
    static std::string filter;
    static std::vector<Offer> offers;
    if (!ImGui::BeginPopupModal("add effect", nullptr, popupFlags)) return;
    if (ImGui::IsWindowAppearing()) {
        filter.clear();
        offers.clear();
        for (const std::string& name : app.session.registry().names()) try {
                offers.push_back({name, app.session.registry().find(name)->header.description, ""});
            } catch (const std::exception& e) {
                offers.push_back({name, "", e.what()});
            }
        ImGui::SetKeyboardFocusHere();
    }
    ImGui::SetNextItemWidth(560);
    const bool isEntered =
        ImGui::InputTextWithHint("##filter", "search by name or words; Enter adds the first", &filter,
                                 ImGuiInputTextFlags_EnterReturnsTrue);
    std::string chosen;
    ImGui::BeginChild("offers", {560, 340});
    bool isFirst = true;
    for (const Offer& offer : offers) {
        if (!contains(offer.name, filter) && !contains(offer.description, filter)) continue;
        ImGui::PushID(offer.name.c_str());
        ImGui::BeginDisabled(!offer.refused.empty());
        const float line = ImGui::GetTextLineHeight();
        const ImVec2 at = ImGui::GetCursorPos();
        if (ImGui::Selectable("##offer", isFirst && !filter.empty(), 0, {0, 2 * line + 4}))
            chosen = offer.name;
        app.ui.mark("offer." + offer.name);
        const ImVec2 end = ImGui::GetCursorPos();
        ImGui::SetCursorPos({at.x + 4, at.y});
        ImGui::PushFont(boldFont());
        ImGui::TextUnformatted(offer.name.c_str());
        ImGui::PopFont();
        ImGui::SetCursorPos({at.x + 4, at.y + line + 2});
        if (offer.refused.empty())
            ImGui::TextColored(colors::dim, "%s", offer.description.c_str());
        else
            ImGui::TextColored(colors::error, "%s", offer.refused.c_str());
        ImGui::SetCursorPos(end);
        ImGui::EndDisabled();
        ImGui::PopID();
        if (isFirst && isEntered && offer.refused.empty()) chosen = offer.name;
        isFirst = false;
    }
    ImGui::EndChild();
    if (ImGui::Button("Cancel") || ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape)))
        ImGui::CloseCurrentPopup();
    ImGui::SameLine();
    ImGui::AlignTextToFramePadding();
    ImGui::TextColored(colors::dim, "Any other .fs file: drop it on the window.");
    if (!chosen.empty()) {
        app.attempt([&] { app.session.addEffect(chosen); });
        app.settings.tab = "Effects!";
        ImGui::CloseCurrentPopup();
    }
    ImGui::EndPopup();
}

void keyRow(const char* keys, const char* what) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::TextColored(colors::accent, "%s", keys);
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(what);
}

}  // namespace

void drawPopups(App& app) {
    static std::string path;
    if (!app.popup.empty()) {
        path = app.popup == "save preset"  ? proposedPreset(app)
               : app.popup == "save image" ? proposedImage(app)
                                           : "";
        ImGui::OpenPopup(app.popup.c_str());
        app.popup.clear();
    }
    const ImVec2 middle = ImGui::GetMainViewport()->GetCenter();
    auto centred = [&] { ImGui::SetNextWindowPos(middle, ImGuiCond_Appearing, {.5f, .5f}); };
    centred();
    if (askPath(app, "save preset", "Save the preset as", "Save", path, true)) {
        if (fs::path(path).extension() != ".json") path += ".json";
        app.attempt([&] { app.session.savePreset(path); });
    }
    centred();
    if (askPath(app, "save image", "Save the image at full size as (.png, .exr, .jpg, .tif, .npy)", "Save",
                path, true))
        app.saveImage(path);
    centred();
    if (askPath(app, "open",
                "Open frames (a file, folder or pattern), a preset (.json or its name) or an effect (.fs)",
                "Open", path, false))
        app.attempt([&] { app.session.openAny({path}); });
    centred();
    drawAddEffect(app);
}

void drawHelp(App& app) {
    if (!app.isHelpOpen) return;
    ImGui::SetNextWindowPos(ImGui::GetMainViewport()->GetCenter(), ImGuiCond_Always, {.5f, .5f});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 1);
    ImGui::Begin(
        "Keys and gestures", &app.isHelpOpen,
        ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings);
    app.ui.mark("help.panel", {ImGui::GetWindowPos().x, ImGui::GetWindowPos().y, ImGui::GetWindowWidth(),
                               ImGui::GetWindowHeight()});
    const auto& all = shortcuts();
    const size_t half = (all.size() + 1) / 2;
    const auto flags = ImGuiTableFlags_SizingFixedFit;
    if (ImGui::BeginTable("keys", 5, flags)) {
        for (size_t k = 0; k < half; k++) {
            keyRow(all[k].keys, all[k].what);
            ImGui::TableNextColumn();
            ImGui::Dummy({18, 0});
            if (k + half >= all.size()) continue;
            ImGui::TableNextColumn();
            ImGui::TextColored(colors::accent, "%s", all[k + half].keys);
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(all[k + half].what);
        }
        ImGui::EndTable();
    }
    ImGui::Separator();
    if (ImGui::BeginTable("gestures", 2, flags)) {
        for (const auto& [gesture, what] : gestures()) keyRow(gesture, what);
        ImGui::EndTable();
    }
    ImGui::End();
    ImGui::PopStyleVar();
}

}  // namespace brume::preview
