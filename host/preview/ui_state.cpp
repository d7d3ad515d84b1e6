#include "preview/ui_state.hpp"

#include <imgui.h>

#include <cmath>

#include "frame/pending_file.hpp"

namespace brume::preview {

void UiState::mark(const std::string& name) {
    if (!isOn() || !ImGui::IsItemVisible()) return;
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    mark(name, {low.x, low.y, high.x - low.x, high.y - low.y});
}

void UiState::mark(const std::string& name, cv::Rect2d area) {
    if (isOn()) items_[name] = area;
}

void UiState::endFrame() {
    if (!isOn()) return;
    nlohmann::json items = nlohmann::json::object();
    for (const auto& [name, area] : items_)
        items[name] = {std::lround(area.x), std::lround(area.y), std::lround(area.width),
                       std::lround(area.height)};
    nlohmann::json all = values_;
    all["items"] = items;
    // A frame's name may be no UTF-8.
    std::string text = all.dump(1, ' ', false, nlohmann::json::error_handler_t::replace);
    if (text == written_) return;
    writeWhole(path_, text + "\n");
    written_ = std::move(text);
}

}  // namespace brume::preview
