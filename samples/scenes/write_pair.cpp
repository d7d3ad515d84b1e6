#include "write_pair.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "error.hpp"
#include "frame/write.hpp"

namespace scenes {
namespace {

constexpr double framesPerSecond = 25;

template <class Values>
nlohmann::json list(const Values& values) {
    return std::vector(std::begin(values.val), std::end(values.val));
}

nlohmann::json lightsOf(const Scene& scene, const std::string& shadowFile, const cv::Matx44d& worldToShadow) {
    nlohmann::json lights = {{{"type", "directional"},
                              {"direction", list(scene.sunDirection)},
                              {"color", list(scene.sunColor)},
                              {"shadow_map", shadowFile},
                              {"world_to_shadow", list(worldToShadow)}}};
    for (const PointLight& light : scene.lights)
        lights.push_back({{"type", "point"},
                          {"position", list(light.position)},
                          {"color", list(light.color)},
                          {"range", light.range},
                          {"attenuation", list(light.attenuation)}});
    return lights;
}

std::string shadowFileOf(const Scene& scene) { return scene.name + ".sun.exr"; }

}  // namespace

PairWriter::PairWriter(const std::string& folder, const Scene& scene, const ShadowMap& shadow, int frames)
    : folder_(folder), scene_(scene), worldToShadow_(shadow.worldToShadow), frames_(frames) {
    std::error_code problem;
    std::filesystem::create_directories(folder, problem);
    if (problem) brume::failIo(folder, ": the folder cannot be made: ", problem.message());
    brume::WriteOptions data;
    data.isData = true;
    brume::writeImage(folder_ + "/" + shadowFileOf(scene), shadow.depth, data);
}

std::string PairWriter::write(const Capture& capture, int index) const {
    char number[16] = "";
    if (frames_ > 1) std::snprintf(number, sizeof number, "_%04d", index);
    const std::string stem = folder_ + "/" + scene_.name + number;
    brume::writeImage(stem + ".exr", capture.color);
    brume::WriteOptions data;
    data.isData = true;
    brume::writeImage(stem + ".depth.exr", capture.depth, data);

    const brume::Camera& camera = capture.camera;
    const nlohmann::json sidecar = {
        {"depth",
         {{"encoding", "device"}, {"near", scene_.nearPlane}, {"far", scene_.farPlane}, {"reversed", true}}},
        {"camera",
         {{"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"world_from_camera", list(camera.worldFromCamera)}}},
        {"color", {{"encoding", "linear"}}},
        {"time", index / framesPerSecond},
        {"ambient", list((scene_.ambientUp + scene_.ambientDown) * .5f)},
        {"lights", lightsOf(scene_, shadowFileOf(scene_), worldToShadow_)}};
    std::ofstream file(stem + ".json");
    file << sidecar.dump(1) << '\n';
    if (!file.flush()) brume::failIo(stem, ".json: cannot be written");
    return stem + ".exr";
}

}  // namespace scenes
