// Makes a captured frame ready for effects: unknown depth filled, the sky's policy applied; and afterwards
// puts the captured colour back where the chain's settings say so.
#pragma once

#include <map>
#include <string>

#include "frame/frame_pair.hpp"

namespace brume {

enum class UnknownDepth { Fill, Far, Keep };
enum class SkyPolicy { Infinite, AtDistance, Untouched };

struct DepthPolicy {
    UnknownDepth unknown = UnknownDepth::Fill;
    SkyPolicy sky = SkyPolicy::Infinite;
    double skyDistance = 0;  ///< m along the ray, for AtDistance
    double smooth = 0;       ///< px: finite depth smoothed that far along colour edges; 0: as captured
};

struct ReadyFrame {
    FramePair
        frame;  ///< depth holds no NaN; headers share memory with the captured frame where nothing changed
    cv::Mat restore;  ///< CV_8U, empty or: 1 = unknown kept, 2 = sky untouched
};

/// Fill and smoothing follow the edges of colour (guided_depth.hpp).
ReadyFrame resolveDepth(const FramePair& captured, const DepthPolicy& policy);

/// Gives restored pixels their captured colour back in a frame-sized `color`, and sets `transmittance` (may
/// be empty) to NaN at kept unknowns and 1 at untouched sky.
void restorePixels(const ReadyFrame& ready, cv::Mat& color, cv::Mat& transmittance);

}  // namespace brume
