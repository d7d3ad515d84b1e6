// Reading captured frames: colour and depth files, sidecars, encodings. Everything is converted here, once.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "frame/depth_encoding.hpp"
#include "frame/frame_pair.hpp"

namespace brume {

/// In a depth file's place: the picture has none.
inline constexpr const char* noDepth = "none";

/// What the command line may say about a frame; anything left empty comes from the sidecar, then from the
/// file.
struct ReadOptions {
    /// The depth file; patterns and folders are sequence.hpp's. Empty: depth in the EXR, or named by the
    /// sidecar, or NAME.depth.EXT beside. noDepth: whatever there is, everything is sky.
    std::string depth;
    std::optional<DepthEncoding> encoding;
    std::shared_ptr<const nlohmann::json> camera;  ///< as a sidecar's "camera" (sidecar.hpp)
    std::optional<bool> colorIsSrgb;               ///< overrides the sidecar's and the format's habit
    size_t maxPixels = size_t(1) << 28;            ///< refuse larger images before memory is taken
};

/// Reads one frame. Throws Error (Io) naming the file and the reason: missing, empty, truncated, absurd size,
/// colour and depth of different shape, no depth, depth unknown everywhere. Safe to call from several
/// threads.
FramePair readFrame(const std::string& path, const ReadOptions& options = {});

/// One image file as stored, CV_32FC(1..4): channels in RGBA order, the transfer curve not undone, integers
/// as fractions of their largest value; EXR premultiplied as it is there. Throws Error (Io).
cv::Mat readImage(const std::string& path, size_t maxPixels = size_t(1) << 28);

/// One image file as colour, CV_32FC4: scene-linear, alpha unassociated. Throws Error (Io).
cv::Mat readColor(const std::string& path, size_t maxPixels = size_t(1) << 28);

}  // namespace brume
