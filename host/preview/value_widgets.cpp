// One widget for one value: by the parameter's type, range, unit and choices.
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "error.hpp"
#include "frame/color_encoding.hpp"
#include "preview/app.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

namespace {

double at(const std::vector<double>& numbers, size_t k, double otherwise) {
    return k < numbers.size() ? numbers[k] : otherwise;
}

struct Range {
    double least, most, uiLeast, uiMost;
    bool hasSlider() const { return std::isfinite(uiLeast) && std::isfinite(uiMost); }
    /// Ranges over decades are moved through by ratios.
    bool isWide() const { return uiLeast > 0 && uiMost / uiLeast >= 200; }
};

Range rangeOf(const Parameter& p, size_t k) {
    const double least = at(p.min, k, -HUGE_VAL), most = at(p.max, k, HUGE_VAL);
    return {least, most, at(p.uiMin, k, least), at(p.uiMax, k, most)};
}

// Percent signs of a unit are not the format's.
std::string formatFor(const Parameter& p, bool isWhole) {
    std::string format = isWhole ? "%.0f" : "%.4g", unit;
    for (char c : p.unit) unit += c == '%' ? std::string("%%") : std::string(1, c);
    return unit.empty() ? format : format + " " + unit;
}

// Where on its slider a number lies, 0 to 1.
float placeOf(const Range& range, double number) {
    const double n = std::clamp(number, range.uiLeast, range.uiMost);
    if (range.isWide()) return float(std::log(n / range.uiLeast) / std::log(range.uiMost / range.uiLeast));
    return float((n - range.uiLeast) / (range.uiMost - range.uiLeast));
}

// A slider whose filled part says where it stands, under a number that stays readable.
bool slider(const char* id, double& number, const Range& range, const char* format) {
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const float width = ImGui::CalcItemWidth(), height = ImGui::GetFrameHeight();
    const ImVec2 end{corner.x + width, corner.y + height};
    const float rounding = ImGui::GetStyle().FrameRounding;
    const bool isOver = ImGui::IsMouseHoveringRect(corner, end);
    ImDrawList* list = ImGui::GetWindowDrawList();
    list->AddRectFilled(corner, end, ImGui::GetColorU32(isOver ? ImGuiCol_FrameBgHovered : ImGuiCol_FrameBg),
                        rounding);
    const float filled = width * placeOf(range, number);
    if (filled > 1) {
        list->PushClipRect(corner, {corner.x + filled, end.y}, true);
        list->AddRectFilled(
            corner, end,
            ImGui::GetColorU32(isOver ? ImVec4(.25f, .43f, .57f, 1) : ImVec4(.21f, .36f, .48f, 1)), rounding);
        list->PopClipRect();
    }
    for (const auto part : {ImGuiCol_FrameBg, ImGuiCol_FrameBgHovered, ImGuiCol_FrameBgActive,
                            ImGuiCol_SliderGrab, ImGuiCol_SliderGrabActive})
        ImGui::PushStyleColor(part, ImVec4(0, 0, 0, 0));
    const bool isChanged =
        ImGui::SliderScalar(id, ImGuiDataType_Double, &number, &range.uiLeast, &range.uiMost, format,
                            range.isWide() ? ImGuiSliderFlags_Logarithmic : 0);
    ImGui::PopStyleColor(5);
    return isChanged;
}

// `isNarrow`: several share a line; their whole width is too little to slide along.
bool drawNumber(const Parameter& p, size_t k, double& number, const char* id, bool isWhole,
                const std::string& format, bool isNarrow = false) {
    const Range range = rangeOf(p, k);
    double next = number;
    bool isChanged = false;
    if (range.hasSlider() && !isNarrow) {
        isChanged = slider(id, next, range, format.c_str());
    } else {
        const double extent = range.hasSlider() ? range.uiMost - range.uiLeast : std::abs(number);
        const float speed = isWhole ? .2f : float(std::max(1e-4, extent * .003));
        isChanged =
            ImGui::DragScalar(id, ImGuiDataType_Double, &next, speed, nullptr, nullptr, format.c_str());
    }
    if (!isChanged || !std::isfinite(next)) return false;
    if (isWhole) next = std::round(next);
    next = std::clamp(next, range.least, range.most);
    if (next == number) return false;
    number = next;
    return true;
}

bool drawVector(const Parameter& p, ParameterValue& value) {
    static const char* axes[] = {"x", "y", "z", "w"};
    bool isChanged = false;
    const int count = int(value.numbers.size());
    const float gap = ImGui::GetStyle().ItemInnerSpacing.x;
    const float width = (ImGui::CalcItemWidth() - gap * float(count - 1)) / float(count);
    for (int k = 0; k < count; k++) {
        if (k > 0) ImGui::SameLine(0, gap);
        ImGui::SetNextItemWidth(width);
        isChanged |= drawNumber(p, size_t(k), value.numbers[size_t(k)], text("##", axes[k]).c_str(), false,
                                text(axes[k], " %.4g"), true);
    }
    return isChanged;
}

// Colours are scene-linear and may exceed 1; a picker works on what the eye sees, so on encoded ones below 1.
bool drawColor(const Parameter& p, ParameterValue& value) {
    auto& rgb = value.numbers;
    const double most = std::max({1., rgb[0], rgb[1], rgb[2]});
    float seen[3];
    for (size_t k = 0; k < 3; k++) seen[k] = float(srgbEncode(std::max(0., rgb[k]) / most));
    const float height = ImGui::GetFrameHeight(), gap = ImGui::GetStyle().ItemInnerSpacing.x;
    const float whole = ImGui::CalcItemWidth();
    bool isChanged = false;
    if (ImGui::ColorButton("##swatch", {seen[0], seen[1], seen[2], 1}, ImGuiColorEditFlags_NoTooltip,
                           {height * 1.3f, height}))
        ImGui::OpenPopup("picker");
    const bool hasAlpha = rgb.size() > 3 && p.defaultValue.numbers.size() > 3 && rgb[3] != 1;
    const int count = hasAlpha ? 4 : 3;
    const float width = (whole - height * 1.3f - gap * float(count)) / float(count);
    for (int k = 0; k < count; k++) {
        ImGui::SameLine(0, gap);
        ImGui::SetNextItemWidth(width);
        isChanged |= drawNumber(p, size_t(k), rgb[size_t(k)], text("##", k).c_str(), false, "%.3g", true);
    }
    if (ImGui::BeginPopup("picker")) {
        const int flags = ImGuiColorEditFlags_NoAlpha | ImGuiColorEditFlags_DisplayRGB |
                          ImGuiColorEditFlags_DisplayHex | ImGuiColorEditFlags_NoSidePreview;
        ImGui::SetNextItemWidth(220);
        if (ImGui::ColorPicker3("##picked", seen, flags)) {
            for (size_t k = 0; k < 3; k++)
                rgb[k] = std::clamp(srgbDecode(seen[k]) * most, at(p.min, k, 0), at(p.max, k, HUGE_VAL));
            isChanged = true;
        }
        if (at(p.max, 0, 1) > 1) {
            const double least = .01, greatest = at(p.uiMax, 0, 100);
            double brightness = std::max({rgb[0], rgb[1], rgb[2], least});
            ImGui::SetNextItemWidth(220);
            if (ImGui::SliderScalar("##brightness", ImGuiDataType_Double, &brightness, &least, &greatest,
                                    "brightness %.3g", ImGuiSliderFlags_Logarithmic)) {
                const double now = std::max({rgb[0], rgb[1], rgb[2]});
                for (size_t k = 0; k < 3; k++) rgb[k] = now > 0 ? rgb[k] * brightness / now : brightness;
                isChanged = true;
            }
        }
        ImGui::EndPopup();
    }
    return isChanged;
}

bool drawChoice(const Parameter& p, ParameterValue& value) {
    std::string shown = "auto";
    for (size_t k = 0; k < p.values.size(); k++)
        if (!value.automatic && double(p.values[k]) == value.numbers[0])
            shown = k < p.labels.size() ? p.labels[k] : std::to_string(p.values[k]);
    bool isChanged = false;
    if (!ImGui::BeginCombo("##choice", shown.c_str())) return false;
    if (p.allowsAuto && ImGui::Selectable("auto", value.automatic)) value.automatic = isChanged = true;
    for (size_t k = 0; k < p.values.size(); k++) {
        const std::string name = k < p.labels.size() ? p.labels[k] : std::to_string(p.values[k]);
        const bool isChosen = !value.automatic && double(p.values[k]) == value.numbers[0];
        if (ImGui::Selectable(name.c_str(), isChosen)) {
            value.numbers = {double(p.values[k])};
            value.automatic = false;
            isChanged = true;
        }
    }
    ImGui::EndCombo();
    return isChanged;
}

bool drawImage(ParameterValue& value, const std::vector<std::string>& images) {
    bool isChanged = false;
    if (!ImGui::BeginCombo("##image", value.text.empty() ? "none" : value.text.c_str())) return false;
    if (ImGui::Selectable("none", value.text.empty())) value.text.clear(), isChanged = true;
    for (const std::string& name : images)
        if (ImGui::Selectable(name.c_str(), name == value.text)) value.text = name, isChanged = true;
    ImGui::EndCombo();
    return isChanged;
}

bool drawBare(const Parameter& p, ParameterValue& value, const std::vector<std::string>& images) {
    switch (p.type) {
        case ParameterType::Bool: {
            bool isOn = value.numbers[0] != 0;
            if (!ImGui::Checkbox("##on", &isOn)) return false;
            value.numbers = {isOn ? 1. : 0.};
            return true;
        }
        case ParameterType::Event: {
            const bool wasOn = value.numbers[0] != 0;
            ImGui::Button("trigger");
            const bool isOn = ImGui::IsItemActive();
            value.numbers = {isOn ? 1. : 0.};
            return isOn != wasOn;
        }
        case ParameterType::Long:
            if (!p.values.empty()) return drawChoice(p, value);
            return drawNumber(p, 0, value.numbers[0], "##number", true, formatFor(p, true));
        case ParameterType::Float:
            return drawNumber(p, 0, value.numbers[0], "##number", false, formatFor(p, false));
        case ParameterType::Point2D:
        case ParameterType::Point3D:
            return drawVector(p, value);
        case ParameterType::Color:
            return drawColor(p, value);
        case ParameterType::Image:
            return drawImage(value, images);
        default:
            ImGui::TextColored(colors::dim, "not offered");
            return false;
    }
}

}  // namespace

bool drawValue(App& app, const std::string& name, const Parameter& p, ParameterValue& value,
               const std::vector<std::string>& images) {
    ImGui::PushID(name.c_str());
    ImGui::BeginGroup();
    bool isChanged = false;
    const bool hasToggle = p.allowsAuto && p.values.empty();
    const float whole = ImGui::CalcItemWidth();
    float width = whole;
    if (hasToggle)
        width -= ImGui::CalcTextSize("auto").x + 2 * ImGui::GetStyle().FramePadding.x +
                 ImGui::GetStyle().ItemInnerSpacing.x;
    if (hasToggle && value.automatic) {
        ImGui::PushStyleColor(ImGuiCol_Button, colors::chosen);
        if (ImGui::Button("auto", {whole, 0})) {
            value.automatic = false;
            isChanged = true;
        }
        ImGui::PopStyleColor();
    } else {
        ImGui::PushItemWidth(width);
        isChanged = drawBare(p, value, images);
        ImGui::PopItemWidth();
        if (hasToggle) {
            ImGui::SameLine(0, ImGui::GetStyle().ItemInnerSpacing.x);
            if (ImGui::Button("auto")) value.automatic = isChanged = true;
        }
    }
    ImGui::EndGroup();
    app.ui.mark(name);
    ImGui::PopID();
    return isChanged;
}

}  // namespace brume::preview
