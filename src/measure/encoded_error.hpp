// How far an image is from the truth as a viewer would count it: in 8-bit steps, after clipping to 0..1 and
// sRGB encoding.
#pragma once

#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "effect/plugin.hpp"

namespace brume {

/// One pixel in each cell of a grid over an image, row by row.
struct SampleGrid {
    cv::Size cells;
    std::vector<cv::Point> pixels;  ///< cells.area() of them
};
/// At most `count` cells of about square shape, all pixels where the image has no more. A hash of cell and
/// seed places the pixel in its cell: the same grid every time.
SampleGrid sampleGrid(cv::Size image, size_t count, uint32_t seed = 1);

/// |enc(clip(a)) - enc(clip(b))|·255, the largest of R, G, B; +inf where `a` is NaN and `b` is not.
double encodedDifference(const cv::Vec4d& a, const cv::Vec4d& b);

/// encodedDifference of a CV_32FC4 image and the truth at each pixel; NaN where the truth is ambiguous.
std::vector<double> encodedErrors(const cv::Mat& image, std::span<const cv::Point> pixels,
                                  std::span<const ReferencePixel> truth);

/// In 8-bit steps.
struct ErrorStatistics {
    double worst = 0, rms = 0;
    double percentile = 0;    ///< the 99.9th: the smallest error that 99.9 % of the pixels do not exceed
    cv::Point place{-1, -1};  ///< the worst pixel; (-1, -1) where nothing was compared
    size_t compared = 0, leftOut = 0;
    bool operator==(const ErrorStatistics&) const = default;
};
/// Of encodedErrors' answer; NaN entries are counted and left out.
ErrorStatistics errorStatistics(std::span<const double> errors, std::span<const cv::Point> pixels);

/// The smallest of `values` that at least `share` (0..1] of them do not exceed; NaN for none.
double percentileOf(std::vector<double> values, double share);

}  // namespace brume
