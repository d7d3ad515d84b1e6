// What an EXR header says of a frame: the one-file form's attributes (docs/FRAMES.md).
#pragma once

#include <ImfForward.h>

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "frame/camera.hpp"
#include "frame/depth_encoding.hpp"

namespace brume {

struct ExrStatements {
    std::optional<Camera> camera;  ///< brumeFx, brumeFy, brumeCx, brumeCy, brumeWorldFromCamera
    std::optional<double> time;    ///< brumeTime, s
    /// brumeDepthEncoding, as the command line's --depth-encoding.
    std::optional<DepthEncoding> encoding;
    /// brumeSidecar, JSON: what the capture knew besides; its "sidecar_folder" is made good for this file's
    /// place.
    std::shared_ptr<const nlohmann::json> extras;
};

/// From a header's attributes (Decoded's "attributes"). Throws Error (Io) naming `path` where one makes no
/// sense.
ExrStatements getStatements(const nlohmann::json& attributes, const std::string& path);

/// Doubles as they are: what getStatements gives back to the bit. `folder` is where the file will stand.
void putStatements(Imf::Header& header, const ExrStatements& statements, const std::string& folder);

}  // namespace brume
