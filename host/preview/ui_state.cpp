#include "preview/ui_state.hpp"

#include <imgui.h>

#include <cmath>
#include <cstdio>
#include <fstream>

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
    std::string text = all.dump(1);
    if (text == written_) return;
    const std::string pending = path_ + ".part";
    std::ofstream(pending, std::ios::binary) << text << "\n";
    std::rename(pending.c_str(), path_.c_str());
    written_ = std::move(text);
}

}  // namespace brume::preview
