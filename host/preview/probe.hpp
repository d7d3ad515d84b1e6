// Everything known about one pixel.
#pragma once

#include <opencv2/core/matx.hpp>
#include <opencv2/core/types.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "preview/frame_loader.hpp"
#include "preview/renderer.hpp"

namespace brume::preview {

struct Probe {
    cv::Point pixel;                    ///< column, row from the top
    cv::Vec4f before;                   ///< scene-linear, as captured
    std::optional<cv::Vec4f> after;     ///< what the chain made of it
    float captured = 0;                 ///< m, planar; +inf sky, NaN unknown
    float depth = 0;                    ///< m, planar, as effects see it: filled, the sky's policy applied
    double distance = 0;                ///< m along the ray; +inf sky
    std::optional<cv::Vec3d> position;  ///< m, world; nothing for sky and unknown
    cv::Vec3d direction;                ///< world, unit: of the ray through the pixel
    std::optional<cv::Vec4f> transmittance;
};

/// `rendered` may be null, of another frame, or smaller than the frame: then it is read at the nearest pixel,
/// or left out. `pixel` must lie within the frame.
Probe probeAt(const LoadedFrame& frame, const Rendered* rendered, cv::Point pixel);

/// The same as lines of label and value, for people.
std::vector<std::pair<std::string, std::string>> probeLines(const Probe& probe);

}  // namespace brume::preview
