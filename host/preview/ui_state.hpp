// What the window shows, by name: for tests and tools that work it from outside.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core/types.hpp>
#include <string>

namespace brume::preview {

/// Collects during a frame of the window; writes a JSON file (whole or not at all) when something changed.
class UiState {
  public:
    explicit UiState(std::string path) : path_(std::move(path)) {}
    bool isOn() const { return !path_.empty(); }

    void beginFrame() { items_.clear(); }
    /// The widget drawn last goes by this name.
    void mark(const std::string& name);
    void mark(const std::string& name, cv::Rect2d area);
    void set(const std::string& key, nlohmann::json value) { values_[key] = std::move(value); }
    void endFrame();

  private:
    std::string path_, written_;
    std::map<std::string, cv::Rect2d> items_;
    nlohmann::json values_ = nlohmann::json::object();
};

}  // namespace brume::preview
