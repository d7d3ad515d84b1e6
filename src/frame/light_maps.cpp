#include "frame/light_maps.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "error.hpp"
#include "frame/read.hpp"

namespace brume {

constexpr size_t mostLightMaps = 256;

// Calls `use` with each map's name and path.
template <class Use>
static void forEachLightMap(const nlohmann::json& extras, Use use) {
    if (!extras.is_object() || !extras.contains("lights")) return;
    const std::filesystem::path folder = extras.value("sidecar_folder", std::string());
    for (const auto& light : extras.at("lights")) {
        if (!light.is_object() || !light.contains("shadow_map") || !light["shadow_map"].is_string()) continue;
        const std::string name = light["shadow_map"];
        use(name, (folder / name).string());
    }
}

std::vector<std::string> lightMapsOf(const nlohmann::json& extras) {
    std::vector<std::string> paths;
    forEachLightMap(extras, [&](const std::string&, const std::string& path) {
        if (paths.size() < mostLightMaps) paths.push_back(path);
    });
    return paths;
}

void readLightMaps(FramePair& frame, size_t maxPixels) {
    if (!frame.extras) return;
    size_t left = maxPixels, maps = 0;
    forEachLightMap(*frame.extras, [&](const std::string& name, const std::string& path) {
        if (frame.images.count(name)) return;
        cv::Mat depth;
        // A name costs a few bytes, and many may mean one file.
        if (++maps > mostLightMaps)
            failIo(path, ": the sidecar names more than ", mostLightMaps, " light maps");
        cv::extractChannel(readImage(path, left), depth, 0);
        left -= depth.total();
        frame.files.push_back(path);
        frame.images[name] = depth;
    });
}

}  // namespace brume
