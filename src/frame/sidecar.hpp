// NAME.json beside a colour image: what the image files cannot say (docs/FRAMES.md).
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "frame/camera.hpp"
#include "frame/depth_encoding.hpp"

namespace brume {

struct Sidecar {
    std::string path;       ///< empty: there is none
    std::string depthFile;  ///< a path usable from here, or empty
    std::optional<DepthEncoding> encoding;
    std::optional<bool> colorIsSrgb;
    std::optional<double> time;  ///< s
    std::shared_ptr<const nlohmann::json> extras;

    /// The camera of an image of `size`; nothing where the sidecar does not state one.
    std::optional<Camera> camera(cv::Size size) const;
    /// Whether it says where the eye stands.
    bool statesPose() const;
};

/// Reads NAME.json of an image NAME.EXT if there is one. Throws Error (Io) naming file, key and value.
Sidecar readSidecar(const std::string& imagePath);

/// The camera of an image of `size` by a sidecar's "camera" object; errors begin with `where`.
Camera cameraFromJson(const nlohmann::json& camera, cv::Size size, const std::string& where);

/// Whether such an object says where the eye stands.
bool statesPose(const nlohmann::json& camera);

/// Such an object as people state it: "fx=525,fy=525,cx=319.5,cy=239.5,pixel_centres=whole". Throws Error
/// (Usage).
std::shared_ptr<const nlohmann::json> parseCamera(const std::string& text);

/// The sidecar's "depth" object; errors begin with `where`.
DepthEncoding depthEncodingFromJson(const nlohmann::json& object, const std::string& where);

}  // namespace brume
