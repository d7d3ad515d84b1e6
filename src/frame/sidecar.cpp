#include "frame/sidecar.hpp"

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "error.hpp"
#include "file_status.hpp"
#include "frame/camera_limits.hpp"
#include "frame/image_file.hpp"
#include "frame/key_values.hpp"
#include "nearest_name.hpp"
#include "strict_json.hpp"

namespace brume {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

double number(const json& object, const char* key, const std::string& where) {
    const json& value = object.at(key);
    if (!value.is_number()) failIo(where, ": ", key, " is ", shownJson(value), ", not a number");
    return value.get<double>();
}

void requireKnown(const json& object, const std::vector<std::string>& known, const std::string& where) {
    if (!object.is_object()) failIo(where, ": must be an object");
    for (const auto& [key, value] : object.items())
        if (std::find(known.begin(), known.end(), key) == known.end())
            failIo(where, ": there is no key ", key, suggestion(key, known));
}

void requireOneOf(const json& object, const char* one, const char* other, const std::string& where) {
    if (object.contains(one) && object.contains(other))
        failIo(where, ": ", one, " and ", other, " say the same thing twice: leave one out");
}

cv::Matx44d pose(const json& camera, const std::string& where) {
    if (camera.contains("world_from_camera")) {
        const json& m = camera["world_from_camera"];
        if (!m.is_array() || m.size() != 16)
            failIo(where, ": world_from_camera must be 16 numbers, row by row");
        cv::Matx44d matrix;
        for (int k = 0; k < 16; ++k) {
            if (!m[k].is_number())
                failIo(where, ": world_from_camera holds ", shownJson(m[k]), ", not a number");
            matrix.val[k] = m[k];
        }
        return matrix;
    }
    const double height = camera.contains("height") ? number(camera, "height", where) : 1.6;
    const double pitch = camera.contains("pitch_degrees") ? number(camera, "pitch_degrees", where) : 0;
    return Camera::standing(height, pitch);
}

}  // namespace

Camera cameraFromJson(const json& c, cv::Size size, const std::string& where) {
    requireKnown(c,
                 {"fx", "fy", "cx", "cy", "pixel_centres", "horizontal_view_degrees", "height",
                  "pitch_degrees", "world_from_camera"},
                 where);
    for (const char* focal : {"fx", "fy"}) requireOneOf(c, focal, "horizontal_view_degrees", where);
    for (const char* part : {"height", "pitch_degrees"}) requireOneOf(c, part, "world_from_camera", where);
    Camera camera = Camera::withHorizontalView(size, 60);
    if (c.contains("horizontal_view_degrees")) {
        const double degrees = number(c, "horizontal_view_degrees", where);
        if (!(degrees > 0 && degrees < 180)) failIo(where, ": horizontal_view_degrees is ", degrees);
        camera = Camera::withHorizontalView(size, degrees);
    }
    if (c.contains("fx")) camera.fx = camera.fy = number(c, "fx", where);
    if (c.contains("fy")) camera.fy = number(c, "fy", where);
    if (!c.contains("fx") && !c.contains("horizontal_view_degrees")) camera.fx = camera.fy;
    const json centres = c.value("pixel_centres", json("half"));
    if (centres != "half" && centres != "whole")
        failIo(where, ": pixel_centres is ", shownJson(centres), ", not half or whole (numbers)");
    const double shift = centres == "whole" ? .5 : 0;
    if (c.contains("cx")) camera.cx = number(c, "cx", where) + shift;
    if (c.contains("cy")) camera.cy = number(c, "cy", where) + shift;
    camera.worldFromCamera = pose(c, where);
    if (const std::string problem = problemOf(camera); !problem.empty()) failIo(where, ": ", problem);
    return camera;
}

std::shared_ptr<const json> parseCamera(const std::string& text) {
    const std::string where = "camera " + text;
    try {
        auto camera = std::make_shared<const json>(keyValues(text, where));
        cameraFromJson(*camera, {1, 1}, where);
        return camera;
    } catch (const Error& e) {
        throw Error(ErrorKind::Usage, e.what());
    } catch (const json::exception& e) {
        failUsage(where, ": ", reasonOf(e));
    }
}

bool statesPose(const json& camera) {
    return camera.contains("height") || camera.contains("world_from_camera");
}

std::optional<Camera> Sidecar::camera(cv::Size size) const {
    if (!extras || !extras->contains("camera")) return std::nullopt;
    return cameraFromJson((*extras)["camera"], size, path + ": camera");
}

bool Sidecar::statesPose() const {
    return extras && extras->contains("camera") && brume::statesPose((*extras)["camera"]);
}

Sidecar readSidecar(const std::string& imagePath) {
    Sidecar sidecar;
    const fs::path path = fs::path(imagePath).replace_extension(".json");
    if (!isThere(path) || path == imagePath) return sidecar;
    sidecar.path = path.string();
    const std::string content = readText(sidecar.path, 64);
    json root;
    try {
        root = parseJson(content);
    } catch (const Error& e) {
        failIo(sidecar.path, ": ", e.what());
    } catch (const json::exception& e) {
        failIo(sidecar.path, ": is not JSON: ", reasonOf(e));
    }
    if (!root.is_object()) failIo(sidecar.path, ": must hold an object");
    try {
        if (root.contains("depth")) {
            const json& depth = root["depth"];
            if (depth.is_object() && depth.contains("file")) {
                if (!depth["file"].is_string()) failIo(sidecar.path, ": depth: file must be a name");
                sidecar.depthFile = (path.parent_path() / depth["file"].get<std::string>()).string();
            }
            const bool onlyFile = depth.is_object() && depth.size() == depth.count("file");
            if (!onlyFile) sidecar.encoding = depthEncodingFromJson(depth, sidecar.path + ": depth");
        }
        if (root.contains("color")) {
            requireKnown(root["color"], {"encoding"}, sidecar.path + ": color");
            const std::string encoding = root["color"].value("encoding", "srgb");
            if (encoding != "srgb" && encoding != "linear")
                failIo(sidecar.path, ": color: encoding is ", encoding, ", not srgb or linear");
            sidecar.colorIsSrgb = encoding == "srgb";
        }
        if (root.contains("time")) sidecar.time = number(root, "time", sidecar.path);
        root["sidecar_folder"] = path.parent_path().string();
        sidecar.extras = std::make_shared<const json>(std::move(root));
        sidecar.camera({1, 1});  // its mistakes belong to reading the sidecar
    } catch (const json::exception& e) {
        failIo(sidecar.path, ": ", reasonOf(e));
    }
    return sidecar;
}

}  // namespace brume
