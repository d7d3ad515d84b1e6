// The stack of effects.
#include <imgui.h>

#include <cmath>
#include <cstdio>
#include <optional>

#include "preview/app.hpp"
#include "preview/stack.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

namespace {

struct Wish {
    enum class What { Nothing, Remove, Duplicate, Move, Toggle } what = What::Nothing;
    size_t step = 0, to = 0;
};

// What a step took, in ms; nothing where the backend timed it together with others.
std::optional<double> millisecondsOf(const App& app, const std::string& id) {
    if (!app.rendered) return {};
    double sum = 0;
    bool isFound = false;
    for (const StepTiming& timing : app.rendered->timings)
        if (timing.name == id || timing.name.starts_with(id + "/"))
            sum += timing.milliseconds, isFound = true;
    if (!isFound) return {};
    return sum;
}

bool flatButton(const char* label, const char* hint) {
    ImGui::PushStyleColor(ImGuiCol_Button, ImVec4(0, 0, 0, 0));
    const bool isPressed = ImGui::SmallButton(label);
    ImGui::PopStyleColor();
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", hint);
    return isPressed;
}

void drawStep(App& app, size_t place, Wish& wish) {
    const Step& step = app.session.chain().steps[place];
    ImGui::PushID(step.id.c_str());
    bool isOn = step.enabled;
    if (ImGui::Checkbox("##on", &isOn)) wish = {Wish::What::Toggle, place};
    app.ui.mark("step." + step.id + ".on");
    if (ImGui::IsItemHovered()) ImGui::SetTooltip(isOn ? "Switch this effect off" : "Switch this effect on");
    ImGui::SameLine();
    ImGui::PushFont(boldFont());
    if (!step.enabled) ImGui::PushStyleColor(ImGuiCol_Text, colors::dim);
    const bool isOpen = ImGui::TreeNodeEx(
        step.id.c_str(), ImGuiTreeNodeFlags_Framed | ImGuiTreeNodeFlags_AllowItemOverlap |
                             ImGuiTreeNodeFlags_DefaultOpen | ImGuiTreeNodeFlags_NoTreePushOnOpen);
    if (!step.enabled) ImGui::PopStyleColor();
    ImGui::PopFont();
    app.ui.mark("step." + step.id);
    if (ImGui::IsItemHovered() && !step.effect->header.description.empty() &&
        ImGui::GetIO().MouseDelta.x == 0 && !ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
        ImGui::BeginTooltip();
        ImGui::PushTextWrapPos(ImGui::GetFontSize() * 26);
        ImGui::TextUnformatted(step.effect->header.description.c_str());
        if (!step.effect->plugin) ImGui::TextColored(colors::warning, "GLSL only: it has no CPU half");
        ImGui::PopTextWrapPos();
        ImGui::EndTooltip();
    }
    if (ImGui::BeginDragDropSource()) {
        ImGui::SetDragDropPayload("step", &place, sizeof place);
        ImGui::Text("move %s", step.id.c_str());
        ImGui::EndDragDropSource();
    }
    if (ImGui::BeginDragDropTarget()) {
        if (const ImGuiPayload* payload = ImGui::AcceptDragDropPayload("step"))
            wish = {Wish::What::Move, *static_cast<const size_t*>(payload->Data), place};
        ImGui::EndDragDropTarget();
    }
    const float buttons = ImGui::CalcTextSize("+").x + ImGui::CalcTextSize("×").x +
                          4 * ImGui::GetStyle().FramePadding.x + ImGui::GetStyle().WindowPadding.x + 4;
    if (const auto ms = step.enabled ? millisecondsOf(app, step.id) : std::nullopt) {
        char words[32];
        std::snprintf(words, sizeof words, *ms < 10 ? "%.1f ms" : "%.0f ms", *ms);
        ImGui::SameLine(ImGui::GetWindowContentRegionMax().x - buttons - ImGui::CalcTextSize(words).x - 2);
        ImGui::AlignTextToFramePadding();
        ImGui::TextColored(colors::dim, "%s", words);
    }
    ImGui::SameLine(ImGui::GetWindowContentRegionMax().x - buttons + 8);
    ImGui::AlignTextToFramePadding();
    if (flatButton("+", "Another one like it")) wish = {Wish::What::Duplicate, place};
    app.ui.mark("step." + step.id + ".duplicate");
    ImGui::SameLine(0, 2);
    if (flatButton("×", "Remove")) wish = {Wish::What::Remove, place};
    app.ui.mark("step." + step.id + ".remove");
    if (isOpen) {
        ImGui::Indent(6);
        ImGui::BeginDisabled(!step.enabled);
        drawParameters(app, place);
        ImGui::EndDisabled();
        ImGui::Unindent(6);
        ImGui::Dummy({0, 4});
    }
    ImGui::PopID();
}

void fulfil(App& app, const Wish& wish) {
    if (wish.what == Wish::What::Nothing) return;
    const std::string id = app.session.chain().steps.at(wish.step).id;
    switch (wish.what) {
        case Wish::What::Remove:
            app.session.edit("removing " + id, "", [&](Chain& next) {
                next.steps.erase(next.steps.begin() + std::ptrdiff_t(wish.step));
            });
            break;
        case Wish::What::Duplicate:
            app.session.edit("duplicating " + id, "", [&](Chain& next) { duplicateStep(next, wish.step); });
            break;
        case Wish::What::Move:
            if (wish.step != wish.to)
                app.session.edit("moving " + id, "",
                                 [&](Chain& next) { moveStep(next, wish.step, wish.to); });
            break;
        case Wish::What::Toggle:
            app.session.edit("switching " + id, "", [&](Chain& next) {
                next.steps[wish.step].enabled = !next.steps[wish.step].enabled;
            });
            break;
        default:
            break;
    }
}

template <class Choice>
void drawPolicyChoice(App& app, const char* label, const char* name, Choice DepthPolicy::*field,
                      std::initializer_list<const char*> labels) {
    int chosen = int(app.session.chain().policy.*field);
    ImGui::AlignTextToFramePadding();
    ImGui::TextColored(colors::quiet, "%s", label);
    ImGui::SameLine(ImGui::GetContentRegionAvail().x * .36f + 6);
    ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
    if (ImGui::Combo(name, &chosen, labels.begin(), int(labels.size())))
        app.session.edit(label, "", [&](Chain& next) { next.policy.*field = Choice(chosen); });
}

void drawPolicyNumber(App& app, const char* label, const char* name, double DepthPolicy::*field, double most,
                      const char* format) {
    double number = app.session.chain().policy.*field;
    const double least = 0;
    ImGui::AlignTextToFramePadding();
    ImGui::TextColored(colors::quiet, "%s", label);
    ImGui::SameLine(ImGui::GetContentRegionAvail().x * .36f + 6);
    ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x);
    if (ImGui::SliderScalar(name, ImGuiDataType_Double, &number, &least, &most, format) && number >= 0)
        app.session.edit(label, name, [&](Chain& next) { next.policy.*field = number; });
}

void drawPolicy(App& app) {
    ImGui::PushStyleColor(ImGuiCol_Text, colors::dim);
    const bool isOpen =
        ImGui::TreeNodeEx("Sky and holes in the depth",
                          ImGuiTreeNodeFlags_SpanAvailWidth | ImGuiTreeNodeFlags_NoTreePushOnOpen);
    ImGui::PopStyleColor();
    if (!isOpen) return;
    drawPolicyChoice(app, "Sky", "##sky", &DepthPolicy::sky, {"infinite", "at a distance", "untouched"});
    if (app.session.chain().policy.sky == SkyPolicy::AtDistance)
        drawPolicyNumber(app, "Sky distance", "##distance", &DepthPolicy::skyDistance, 10000, "%.4g m");
    drawPolicyChoice(app, "Unknown depth", "##unknown", &DepthPolicy::unknown,
                     {"fill along edges", "far away", "keep as captured"});
    drawPolicyNumber(app, "Smooth depth", "##smooth", &DepthPolicy::smooth, 32, "%.3g px");
}

}  // namespace

void drawStack(App& app) {
    Wish wish;
    ImGui::BeginChild("stack");
    for (size_t k = 0; k < app.session.chain().steps.size(); k++) drawStep(app, k, wish);
    if (app.session.chain().steps.empty()) {
        ImGui::Dummy({0, 6});
        ImGui::PushTextWrapPos();
        ImGui::TextColored(colors::dim,
                           "Nothing happens to the picture yet. Add an effect, or open a preset.");
        ImGui::PopTextWrapPos();
        ImGui::Dummy({0, 2});
    }
    if (ImGui::Button("+ Add an effect", {ImGui::GetContentRegionAvail().x, 0})) app.popup = "add effect";
    app.ui.mark("add effect");
    drawPolicy(app);
    ImGui::EndChild();
    fulfil(app, wish);
}

}  // namespace brume::preview
