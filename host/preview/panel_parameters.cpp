// A step's parameters: label, widget, reset; groups fold.
#include <imgui.h>

#include <algorithm>

#include "error.hpp"
#include "preview/app.hpp"
#include "preview/stack.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

namespace {

std::string numbersOf(const std::vector<double>& numbers) {
    std::string words;
    const bool isOne = std::all_of(numbers.begin(), numbers.end(), [&](double n) { return n == numbers[0]; });
    for (size_t k = 0; k < (isOne ? std::min<size_t>(1, numbers.size()) : numbers.size()); k++)
        words += text(k ? ", " : "", numbers[k]);
    return words;
}

void drawHint(const EffectHeader& header, const Parameter& p, bool isFromCapture, bool isIdle) {
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(ImGui::GetFontSize() * 26);
    if (!p.hint.empty()) ImGui::TextUnformatted(p.hint.c_str());
    std::string range;
    if (!p.min.empty() && !p.max.empty())
        range = numbersOf(p.min) + " to " + numbersOf(p.max) + (p.unit.empty() ? "" : " " + p.unit);
    else if (!p.unit.empty())
        range = p.unit;
    if (p.values.empty() && !range.empty()) ImGui::TextColored(colors::dim, "%s", range.c_str());
    ImGui::TextColored(colors::dim, "%s", p.name.c_str());
    if (isIdle)
        ImGui::TextColored(colors::accent, "changes nothing now: only when %s",
                           conditionWords(header, p, &Parameter::label).c_str());
    if (isFromCapture) ImGui::TextColored(colors::accent, "as the capture says; a change here overrides it");
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
}

std::string labelOf(const Parameter& p) { return titleOf(p.label.empty() ? p.name : p.label); }

void drawParameter(App& app, size_t place, const Parameter& p, const std::vector<std::string>& images) {
    const Step& step = app.session.chain().steps[place];
    const bool isGiven = step.given.count(p.name);
    const bool isFromCapture = !isGiven && !p.sidecar.empty() &&
                               !(app.effective().steps[place].values.at(p.name) == step.values.at(p.name));
    ParameterValue value =
        isFromCapture ? app.effective().steps[place].values.at(p.name) : step.values.at(p.name);
    const std::string name = step.id + "." + p.name;
    const EffectHeader& header = step.effect->header;
    const bool isIdle = !isUsed(header, p, app.effective().steps[place].values);
    const bool canReset = isGiven && (!(value == p.defaultValue) || !p.sidecar.empty());

    ImGui::PushID(p.name.c_str());
    const float whole = ImGui::GetContentRegionAvail().x;
    const float reset = ImGui::GetFrameHeight();
    const float labelWidth = whole * .36f;
    const float left = ImGui::GetCursorPosX();
    auto drawReset = [&] {
        if (!canReset) return;
        ImGui::SameLine(left + whole - reset);
        ImGui::PushStyleColor(ImGuiCol_Button, ImVec4(0, 0, 0, 0));
        ImGui::PushStyleColor(ImGuiCol_Text, colors::dim);
        if (ImGui::Button("↺", {reset, 0})) app.session.resetValue(place, p);
        ImGui::PopStyleColor(2);
        app.ui.mark(name + ".reset");
        if (ImGui::IsItemHovered())
            ImGui::SetTooltip(
                "%s", p.sidecar.empty() ? "Back to the default" : "Back to the capture's, or the default");
    };
    if (isIdle) ImGui::PushStyleVar(ImGuiStyleVar_Alpha, ImGui::GetStyle().Alpha * .45f);
    ImGui::AlignTextToFramePadding();
    const ImVec2 start = ImGui::GetCursorScreenPos();
    ImGui::PushClipRect(start, {start.x + labelWidth - 6, start.y + ImGui::GetFrameHeight()}, true);
    if (isFromCapture)
        ImGui::TextColored(colors::accent, "%s", labelOf(p).c_str());
    else if (isGiven)
        ImGui::TextUnformatted(labelOf(p).c_str());
    else
        ImGui::TextColored(colors::quiet, "%s", labelOf(p).c_str());
    ImGui::PopClipRect();
    if (ImGui::IsItemHovered()) drawHint(header, p, isFromCapture, isIdle);
    bool isChanged = false;
    if (p.type == ParameterType::List) {
        drawReset();
        isChanged = drawListTable(app, name, p, value);
    } else {
        ImGui::SameLine(left + labelWidth);
        ImGui::SetNextItemWidth(whole - labelWidth - reset - 2);
        ImGui::PushItemWidth(whole - labelWidth - reset - 2);
        isChanged = drawValue(app, name, p, value, images);
        ImGui::PopItemWidth();
        if (ImGui::IsItemHovered() && !ImGui::IsItemActive() && (isIdle || !p.hint.empty()) &&
            !ImGui::IsMouseDown(ImGuiMouseButton_Left) && ImGui::GetIO().MouseDelta.x == 0)
            drawHint(header, p, isFromCapture, isIdle);
        drawReset();
    }
    if (isIdle) ImGui::PopStyleVar();
    if (isChanged) app.session.setValue(place, p, value, true);
    ImGui::PopID();
}

// Tables of no group are tall: they come last.
bool isLoose(const Parameter& p) { return p.group.empty() && p.type == ParameterType::List; }

void drawImages(App& app, size_t place, const std::vector<std::string>& images) {
    const Step step = app.session.chain().steps[place];
    const float width = (ImGui::GetContentRegionAvail().x - 130) / 2;
    if (!step.effect->header.mainImage().empty()) {
        ImGui::AlignTextToFramePadding();
        ImGui::TextColored(colors::dim, "reads");
        ImGui::SameLine();
        ImGui::SetNextItemWidth(width);
        if (ImGui::BeginCombo("##input", step.input.c_str())) {
            for (const std::string& image : images)
                if (ImGui::Selectable(image.c_str(), image == step.input))
                    app.session.edit("what " + step.id + " reads", "",
                                     [&](Chain& next) { next.steps[place].input = image; });
            ImGui::EndCombo();
        }
        ImGui::SameLine();
    }
    ImGui::AlignTextToFramePadding();
    ImGui::TextColored(colors::dim, "writes");
    ImGui::SameLine();
    ImGui::SetNextItemWidth(width);
    char output[64];
    std::snprintf(output, sizeof output, "%s", step.output.c_str());
    if (ImGui::InputText("##output", output, sizeof output, ImGuiInputTextFlags_EnterReturnsTrue) && *output)
        app.session.edit("what " + step.id + " writes", "",
                         [&](Chain& next) { next.steps[place].output = output; });
    if (ImGui::IsItemHovered())
        ImGui::SetTooltip("color, or a name of its own that later effects can read (Enter takes it)");
}

}  // namespace

void drawParameters(App& app, size_t place) {
    const std::shared_ptr<const Effect> effect = app.session.chain().steps[place].effect;
    const std::vector<std::string> images = imagesBefore(app.session.chain(), place);
    const std::string main = effect->header.mainImage();
    std::vector<std::string> groups;
    for (const Parameter& p : effect->header.parameters)
        if (p.name != main && std::find(groups.begin(), groups.end(), p.group) == groups.end())
            groups.push_back(p.group);
    std::stable_partition(groups.begin(), groups.end(), [](const std::string& g) { return g.empty(); });
    for (const std::string& group : groups) {
        bool isOpen = true;
        if (!group.empty()) {
            // At first open: what the preset speaks of, and the first group.
            const Step& step = app.session.chain().steps[place];
            const bool isFirst = group == (groups[0].empty() && groups.size() > 1 ? groups[1] : groups[0]);
            const bool isOpenAtFirst =
                isFirst ||
                std::any_of(effect->header.parameters.begin(), effect->header.parameters.end(),
                            [&](const Parameter& p) { return p.group == group && step.given.count(p.name); });
            const bool isIdle = std::all_of(
                effect->header.parameters.begin(), effect->header.parameters.end(), [&](const Parameter& p) {
                    return p.group != group ||
                           !isUsed(effect->header, p, app.effective().steps[place].values);
                });
            ImGui::PushStyleColor(ImGuiCol_Text, isIdle ? colors::faint : colors::dim);
            isOpen = ImGui::TreeNodeEx((titleOf(group) + "###" + group).c_str(),
                                       (isOpenAtFirst ? ImGuiTreeNodeFlags_DefaultOpen : 0) |
                                           ImGuiTreeNodeFlags_SpanAvailWidth |
                                           ImGuiTreeNodeFlags_NoTreePushOnOpen);
            ImGui::PopStyleColor();
            app.ui.mark("group." + app.session.chain().steps[place].id + "." + group);
        }
        if (!isOpen) continue;
        ImGui::PushID(group.c_str());
        for (const Parameter& p : effect->header.parameters)
            if (p.group == group && p.name != main && !isLoose(p)) drawParameter(app, place, p, images);
        ImGui::PopID();
    }
    for (const Parameter& p : effect->header.parameters)
        if (isLoose(p)) drawParameter(app, place, p, images);
    drawImages(app, place, images);
}

}  // namespace brume::preview
