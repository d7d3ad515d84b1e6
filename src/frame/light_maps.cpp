#include "frame/light_maps.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "error.hpp"
#include "frame/read.hpp"

namespace brume {

constexpr size_t mostLightMaps = 256;

void readLightMaps(FramePair& frame, size_t maxPixels) {
    if (!frame.extras || !frame.extras->is_object() || !frame.extras->contains("lights")) return;
    const std::filesystem::path folder = frame.extras->value("sidecar_folder", std::string());
    size_t left = maxPixels, maps = 0;
    for (const auto& light : frame.extras->at("lights")) {
        if (!light.is_object() || !light.contains("shadow_map") || !light["shadow_map"].is_string()) continue;
        const std::string name = light["shadow_map"];
        if (frame.images.count(name)) continue;
        cv::Mat depth;
        // A name costs a few bytes, and many may mean one file.
        const std::string path = (folder / name).string();
        if (++maps > mostLightMaps)
            failIo(path, ": the sidecar names more than ", mostLightMaps, " light maps");
        cv::extractChannel(readImage(path, left), depth, 0);
        left -= depth.total();
        frame.files.push_back(path);
        frame.images[name] = depth;
    }
}

}  // namespace brume
