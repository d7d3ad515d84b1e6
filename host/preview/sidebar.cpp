// Beside the picture: what one does with the preset, then effects, frame or timing.
#include <imgui.h>

#include <algorithm>
#include <filesystem>

#include "error.hpp"
#include "preview/app.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

namespace {

bool tool(App& app, const char* label, const char* name, const std::string& hint, bool isEnabled = true) {
    ImGui::BeginDisabled(!isEnabled);
    const bool isPressed = ImGui::Button(label);
    ImGui::EndDisabled();
    app.ui.mark(name);
    if (ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) ImGui::SetTooltip("%s", hint.c_str());
    return isPressed && isEnabled;
}

void drawTools(App& app) {
    const History& history = app.session.history();
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, ImVec2(4, 6));
    if (tool(app, "Open…", "open",
             "Open frames, a preset or an effect by path (Ctrl+O); or drop them on the window"))
        app.popup = "open";
    ImGui::SameLine();
    if (tool(app, "Save…", "save preset", "Save the preset (Ctrl+S)")) app.popup = "save preset";
    ImGui::SameLine();
    if (tool(app, "Image…", "save image", "Save the image at full size (Ctrl+E)")) app.popup = "save image";
    ImGui::SameLine();
    if (tool(app, "Copy line", "copy line", "Copy the brume apply line that makes this picture (Ctrl+L)"))
        app.copyApplyLine();
    ImGui::SameLine();
    if (tool(app, "↶", "undo",
             history.canUndo() ? "Undo " + history.undoes() + " (Ctrl+Z)" : "Nothing to undo",
             history.canUndo()))
        app.session.undo();
    ImGui::SameLine();
    if (tool(app, "↷", "redo",
             history.canRedo() ? "Do again: " + history.redoes() + " (Ctrl+Y)" : "Nothing to do again",
             history.canRedo()))
        app.session.redo();
    ImGui::SameLine();
    if (tool(app, "?", "help", "Keys and gestures (F1)")) app.isHelpOpen = !app.isHelpOpen;
    ImGui::PopStyleVar();
}

// The border between picture and sidebar can be dragged; its place is remembered.
void drawSplitter(App& app) {
    const ImVec2 corner = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
    const float scale = float(app.window.contentScale());
    ImGui::SetCursorScreenPos(corner);
    ImGui::PushClipRect(corner, {corner.x + size.x, corner.y + size.y}, false);  // into the padding
    ImGui::InvisibleButton("splitter", {6 * scale, size.y});
    app.ui.mark("splitter");
    const bool isBusy = ImGui::IsItemActive() || ImGui::IsItemHovered();
    if (isBusy) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
    if (ImGui::IsItemActive()) {
        const float width = (ImGui::GetIO().DisplaySize.x - ImGui::GetIO().MousePos.x) / scale;
        app.settings.sidebar = std::clamp(double(width), 340., 900.);
    }
    ImGui::GetWindowDrawList()->AddLine(
        {corner.x, corner.y}, {corner.x, corner.y + size.y},
        isBusy ? ImGui::GetColorU32(colors::accent) : IM_COL32(52, 53, 57, 255), isBusy ? 3 : 2);
    ImGui::PopClipRect();
    ImGui::SetCursorPos(ImGui::GetStyle().WindowPadding);
}

}  // namespace

void drawSidebar(App& app) {
    drawSplitter(app);
    ImGui::BeginGroup();
    drawTools(app);
    ImGui::Dummy({0, 2});
    if (ImGui::BeginTabBar("tabs", ImGuiTabBarFlags_FittingPolicyScroll)) {
        const std::pair<const char*, void (*)(App&)> tabs[] = {
            {"Effects", drawStack}, {"Frame", drawFramePanel}, {"Timing", drawTiming}};
        const std::string wanted = app.settings.tab;
        for (const auto& [name, draw] : tabs) {
            const bool isWanted = wanted == std::string(name) + "!";
            std::string label = name;
            const bool hasDoubts = app.inspection && (!app.inspection->doubts.empty() || !app.loaded ||
                                                      !app.loaded->assumed.empty());
            if (label == "Frame" && hasDoubts) label += " •";
            label += "###" + std::string(name);
            const bool isOpen =
                ImGui::BeginTabItem(label.c_str(), nullptr, isWanted ? ImGuiTabItemFlags_SetSelected : 0);
            app.ui.mark(std::string("tab.") + name);
            if (!isOpen) continue;
            if (wanted.empty() || wanted.back() != '!' || isWanted) app.settings.tab = name;
            draw(app);
            ImGui::EndTabItem();
        }
        ImGui::EndTabBar();
    }
    ImGui::EndGroup();
}

}  // namespace brume::preview
