// The rows of a list parameter.
#include <imgui.h>

#include <algorithm>

#include "error.hpp"
#include "preview/app.hpp"
#include "preview/theme.hpp"

namespace brume::preview {

static float columnWidth(const Parameter& field) {
    switch (field.type) {
        case ParameterType::Point3D:
            return 216;
        case ParameterType::Point2D:
            return 150;
        case ParameterType::Color:
            return 200;
        case ParameterType::Bool:
            return 40;
        default:
            return 112;
    }
}

bool drawListTable(App& app, const std::string& name, const Parameter& parameter, ParameterValue& value) {
    const auto& fields = parameter.fields;
    const int frozen = 1;
    bool isChanged = false;
    const float line = ImGui::GetFrameHeight() + 2 * ImGui::GetStyle().CellPadding.y;
    const size_t visible = std::min<size_t>(value.rows.size(), 8);
    const float height = line * float(visible + 1) + ImGui::GetStyle().ScrollbarSize + 6;
    std::optional<size_t> removed, duplicated;
    const auto flags = ImGuiTableFlags_ScrollX | ImGuiTableFlags_ScrollY | ImGuiTableFlags_BordersInnerV |
                       ImGuiTableFlags_RowBg | ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_Resizable;
    if (!value.rows.empty() && ImGui::BeginTable("rows", int(fields.size()) + 1, flags, {0, height})) {
        ImGui::TableSetupScrollFreeze(frozen, 1);
        ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed | ImGuiTableColumnFlags_NoResize, 76);
        for (const Parameter& field : fields) {
            std::string title = field.label.empty() ? field.name : field.label;
            std::replace(title.begin(), title.end(), '_', ' ');
            if (!field.unit.empty()) title += ", " + field.unit;
            ImGui::TableSetupColumn(title.c_str(), ImGuiTableColumnFlags_WidthFixed, columnWidth(field));
        }
        ImGui::TableNextRow(ImGuiTableRowFlags_Headers);
        for (size_t k = 0; k <= fields.size(); k++) {
            ImGui::TableSetColumnIndex(int(k));
            ImGui::TableHeader(ImGui::TableGetColumnName(int(k)));
            if (k > 0 && ImGui::IsItemHovered() && !fields[k - 1].hint.empty())
                ImGui::SetTooltip("%s", fields[k - 1].hint.c_str());
        }
        for (size_t row = 0; row < value.rows.size(); row++) {
            ImGui::PushID(int(row));
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            ImGui::AlignTextToFramePadding();
            ImGui::TextColored(colors::dim, "%zu", row + 1);
            ImGui::SameLine(22);
            if (ImGui::SmallButton("+")) duplicated = row;
            if (ImGui::IsItemHovered()) ImGui::SetTooltip("Another like this one");
            ImGui::SameLine(0, 3);
            if (ImGui::SmallButton("×")) removed = row;
            app.ui.mark(text(name, "[", row, "].remove"));
            if (ImGui::IsItemHovered()) ImGui::SetTooltip("Remove this row");
            for (const Parameter& field : fields) {
                ImGui::TableNextColumn();
                ImGui::PushItemWidth(ImGui::GetContentRegionAvail().x);
                // The unit stands in the column's head.
                Parameter bare = field;
                bare.unit.clear();
                isChanged |= drawValue(app, text(name, "[", row, "].", field.name), bare,
                                       value.rows[row].at(field.name), {});
                ImGui::PopItemWidth();
            }
            ImGui::PopID();
        }
        ImGui::EndTable();
    }
    const bool isFull = parameter.maxRows > 0 && int(value.rows.size()) >= parameter.maxRows;
    ImGui::BeginDisabled(isFull);
    if (ImGui::Button(value.rows.empty() ? "Add the first row" : "Add a row")) {
        value.rows.push_back(defaultValues(fields));
        isChanged = true;
    }
    app.ui.mark(name + ".add");
    ImGui::EndDisabled();
    if (isFull) {
        ImGui::SameLine();
        ImGui::TextColored(colors::dim, "%d rows are all there can be", parameter.maxRows);
    }
    if (duplicated && !isFull) {
        const auto copy = value.rows[*duplicated];
        value.rows.insert(value.rows.begin() + std::ptrdiff_t(*duplicated) + 1, copy);
        isChanged = true;
    }
    if (removed) {
        value.rows.erase(value.rows.begin() + std::ptrdiff_t(*removed));
        isChanged = true;
    }
    return isChanged;
}

}  // namespace brume::preview
