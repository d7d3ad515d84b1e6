// Where in a frame the check asks the reference.
#pragma once

#include <opencv2/core/types.hpp>
#include <vector>

namespace brume {

/// At most `count` different pixels: corners, borders, and the inside evenly, by a sequence of low
/// discrepancy.
std::vector<cv::Point> spreadPixels(cv::Size size, size_t count);

}  // namespace brume
