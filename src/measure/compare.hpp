// The one comparer: classes first, by bits, then |a - b| ≤ abs + rel·|b|. NaN never passes for a number.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

namespace brume {

struct Comparison {
    bool passed = true;
    double worst = 0;         ///< largest |a - b| among finite pairs; +inf when classes differ
    double mean = 0;          ///< of |a - b| over finite pairs
    double worstOfBound = 0;  ///< largest |a - b| / bound; > 1 fails; +inf when classes differ
    cv::Point place{0, 0};    ///< where worstOfBound sits
    int channel = 0;
    double a = 0, b = 0;                           ///< the two values there
    size_t compared = 0, leftOut = 0, failed = 0;  ///< pixels
    /// One line: the worst value's difference, place and two values, how much of the bound it used, the mean.
    std::string describe() const;
};

/// Compares two CV_32F/CV_64F images of equal size and channels; throws Error (CheckFailed) for unlike ones.
/// NaN matches NaN, whatever its bits; +inf matches only +inf. `allowance` (CV_64F one channel, or empty) is
/// added to each pixel's bound; `ambiguous` (CV_8U, or empty) marks pixels counted and left out.
Comparison compareImages(const cv::Mat& a, const cv::Mat& b, double abs, double rel,
                         const cv::Mat& allowance = {}, const cv::Mat& ambiguous = {});

/// In dB, peak 1, over all pixels and RGB, both clipped to 0..1 and sRGB-encoded as float. +inf for equal
/// images, NaN where either holds a NaN.
double psnrEncoded(const cv::Mat& a, const cv::Mat& b);

}  // namespace brume
