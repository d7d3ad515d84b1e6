#include "scene.hpp"

#include <algorithm>

#include "error.hpp"
#include "nearest_name.hpp"

namespace scenes {
namespace {

const std::pair<const char*, Scene (*)()> makers[] = {
    {"forest_day", forestDay}, {"street_night", streetNight}, {"valley", valley}};

}  // namespace

std::vector<std::string> sceneNames() {
    std::vector<std::string> names;
    for (const auto& [name, make] : makers) names.push_back(name);
    return names;
}

Scene makeScene(const std::string& name) {
    for (const auto& [known, make] : makers)
        if (name == known) return make();
    brume::failUsage("--scene: no scene \"", name, "\"", brume::suggestion(name, sceneNames()));
}

}  // namespace scenes
