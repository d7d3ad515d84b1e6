// The fog colour that a picture already holds.
#pragma once

#include <opencv2/core/matx.hpp>
#include <string>

#include "frame/frame_pair.hpp"

namespace brume {

struct Airlight {
    cv::Vec3d color;  ///< scene-linear
    std::string how;  ///< "median of the sky", "dark channel"
};

/// The median of the sky where it is at least 1 % of the picture. Otherwise by the dark channel (He, Sun and
/// Tang 2009): haze lifts the darkest channel of every neighbourhood, so of the farther half of the pixels
/// the .1 % whose darkest neighbour is brightest, and their median. Thread-safe, deterministic.
Airlight pickAirlight(const FramePair& frame);

}  // namespace brume
