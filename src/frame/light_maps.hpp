// The depth maps that a sidecar's lights name (docs/FRAMES.md).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "frame/frame_pair.hpp"

namespace brume {

/// Reads each light's "shadow_map", beside the sidecar, into frame.images under the name the light gives it:
/// CV_32FC4, the stored value in R, G and B. Throws Error (Io) naming the file.
void readLightMaps(FramePair& frame, size_t maxPixels);

/// The files that a sidecar's content names so; 256 at most.
std::vector<std::string> lightMapsOf(const nlohmann::json& extras);

}  // namespace brume
