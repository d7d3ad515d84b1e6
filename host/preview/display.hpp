// Images as the window shows them: 8 bits, RGB.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

namespace brume::preview {

/// Scene-linear colour exactly as `brume apply` writes it to a PNG: CV_8UC3.
cv::Mat pictureBytes(const cv::Mat& color, int frameIndex, unsigned seed);

/// Where two results differ.
struct Difference {
    cv::Mat heat;  ///< CV_8UC3: decades from 1e-8 (black) to 1e-2 (white); green where one is not a number
    double largest = 0, mean = 0;  ///< of |a - b|, largest of R, G, B, finite pixels only
    cv::Point where;               ///< of the largest
    size_t unlike = 0;             ///< pixels of which only one is finite
};
Difference differenceOf(const cv::Mat& a, const cv::Mat& b);

/// The colour of a place on the heat map's scale, 0 to 1: for its legend.
cv::Vec3b heatColor(double place);
inline constexpr double heatLow = 1e-8, heatHigh = 1e-2;

}  // namespace brume::preview
