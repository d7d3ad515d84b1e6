// Above the picture: what is shown, zoom, what runs it.
#include <imgui.h>

#include <cmath>
#include <cstdio>

#include "error.hpp"
#include "preview/app.hpp"
#include "preview/stack.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

static bool choice(App& app, const char* label, bool isChosen, const char* hint) {
    if (isChosen) {
        ImGui::PushStyleColor(ImGuiCol_Button, ImVec4(.23f, .42f, .57f, 1));
        ImGui::PushStyleColor(ImGuiCol_ButtonHovered, ImVec4(.26f, .47f, .63f, 1));
    }
    const bool isPressed = ImGui::Button(label);
    if (isChosen) ImGui::PopStyleColor(2);
    app.ui.mark(std::string("show.") + label);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", hint);
    return isPressed;
}

void drawToolbar(App& app) {
    const std::pair<const char*, Show> shows[] = {{"Result", Show::Result}, {"Before", Show::Before},
                                                  {"Wipe", Show::Wipe},     {"Blink", Show::Blink},
                                                  {"Depth", Show::Depth},   {"Difference", Show::Difference}};
    const char* hints[] = {"The chain's result (R)",
                           "The frame as captured (B)",
                           "Before on the left of a line that you drag (W)",
                           "Before and result by turns (K)",
                           "Depth in log colours: near pale, far dark, sky white (D)",
                           "Where GLSL and CPU differ, in decades (X)"};
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, ImVec2(3, 6));
    for (size_t k = 0; k < std::size(shows); k++) {
        if (k > 0) ImGui::SameLine();
        if (choice(app, shows[k].first, app.look.show == shows[k].second, hints[k]))
            app.show(shows[k].second);
    }
    ImGui::PopStyleVar();
    ImGui::SameLine();
    ImGui::SetNextItemWidth(150);
    const bool isImage = app.look.show == Show::Image;
    if (isImage) ImGui::PushStyleColor(ImGuiCol_FrameBg, ImVec4(.23f, .42f, .57f, 1));
    if (ImGui::BeginCombo("##image", isImage ? app.look.image.c_str() : "image…")) {
        for (const std::string& name : namedImages(app.session.chain()))
            if (ImGui::Selectable(name.c_str(), isImage && name == app.look.image))
                app.show(Show::Image, name);
        ImGui::EndCombo();
    }
    if (isImage) ImGui::PopStyleColor();
    app.ui.mark("show.image");
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("An image of the chain by its name (I)");

    char zoom[32];
    std::snprintf(zoom, sizeof zoom, "%.0f %%", app.look.view.zoom() * 100);
    const float right = ImGui::GetWindowWidth() - ImGui::GetStyle().WindowPadding.x;
    const float width = ImGui::CalcTextSize("GLSL").x + ImGui::CalcTextSize("Fit").x +
                        ImGui::CalcTextSize("1:1").x + ImGui::CalcTextSize("0000 %").x +
                        6 * ImGui::GetStyle().FramePadding.x + 5 * ImGui::GetStyle().ItemSpacing.x;
    ImGui::SameLine();
    if (right - width < ImGui::GetCursorPosX()) return;  // a narrow window keeps what matters
    ImGui::SetCursorPosX(right - width);
    ImGui::AlignTextToFramePadding();
    ImGui::TextColored(colors::dim, "%6s", zoom);
    ImGui::SameLine();
    if (choice(app, "Fit", app.look.view.isFit(), "Fit the picture into the window (F)")) app.look.view.fit();
    ImGui::SameLine();
    if (choice(app, "1:1", !app.look.view.isFit() && app.look.view.zoom() == 1, "One pixel for one (1)"))
        app.look.view.zoomTo(1, app.look.view.middle());
    ImGui::SameLine();
    if (choice(app, app.backend == "cpu" ? "CPU" : "GLSL", false,
               "Which half of the effects runs; G changes it"))
        app.backend = app.backend == "cpu" ? "gl" : "cpu";
}

}  // namespace brume::preview
