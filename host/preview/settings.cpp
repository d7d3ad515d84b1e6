#include "preview/settings.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "error.hpp"
#include "frame/pending_file.hpp"

namespace brume::preview {

namespace fs = std::filesystem;

std::string Settings::path() {
    const char* config = std::getenv("XDG_CONFIG_HOME");
    if (config && *config) return (fs::path(config) / "brume" / "preview.json").string();
    const char* home = std::getenv("HOME");
    return home && *home ? (fs::path(home) / ".config" / "brume" / "preview.json").string() : "";
}

Settings Settings::load() {
    Settings s;
    std::ifstream in(path());
    const auto json = nlohmann::json::parse(in, nullptr, false);
    if (!json.is_object()) return s;
    try {
        s.window.width = std::clamp(json.value("width", s.window.width), 640, 16384);
        s.window.height = std::clamp(json.value("height", s.window.height), 400, 16384);
        s.sidebar = std::clamp(json.value("sidebar", s.sidebar), 300., 900.);
        s.probe = json.value("probe", s.probe);
        s.loop = json.value("loop", s.loop);
        s.tab = json.value("tab", s.tab);
    } catch (const nlohmann::json::exception&) {
        return {};
    }
    return s;
}

void Settings::save() const {
    if (path().empty()) return;
    std::error_code none;
    fs::create_directories(fs::path(path()).parent_path(), none);
    const nlohmann::ordered_json json = {{"width", window.width}, {"height", window.height},
                                         {"sidebar", sidebar},    {"probe", probe},
                                         {"loop", loop},          {"tab", tab}};
    try {
        writeWhole(path(), json.dump(2) + "\n");
    } catch (const Error&) {
    }
}

}  // namespace brume::preview
