// What is known of a frame besides its pixels, in fp64.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/types.hpp>

#include "frame/camera.hpp"

namespace brume {

/// What `derive` functions and plans may look at.
struct DeriveContext {
    Camera camera;
    cv::Size size;  ///< of the image being worked on
    cv::Size frameSize;
    double time = 0;
    int frameIndex = 0;
    uint32_t seed = 0;
    std::shared_ptr<const nlohmann::json> extras;  ///< the frame's sidecar, or null
};

}  // namespace brume
