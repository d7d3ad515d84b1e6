// An exact effect for feeding effects that read a second image: mirrored left to right, channels turned.
#pragma once

#include <memory>

#include "effect/effect.hpp"

namespace brume {

std::shared_ptr<const Effect> mirrorEffect();

/// What it makes of an image, bit for bit.
cv::Mat mirrored(const cv::Mat& image);

}  // namespace brume
