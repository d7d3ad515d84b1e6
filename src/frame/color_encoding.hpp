// The sRGB transfer curve between stored and scene-linear colour, and quantising with dither.
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace brume {

/// The piecewise curve of IEC 61966-2-1 in fp64, extended to negative numbers as an odd function.
double srgbEncode(double linear);
double srgbDecode(double encoded);

/// n values in fp32, relative error of the power part below 5e-7; NaN stays NaN, +inf stays +inf.
void srgbEncodeRow(const float* linear, float* encoded, int n);
void srgbDecodeRow(const float* encoded, float* linear, int n);

/// Stored colour (CV_8U, CV_16U or CV_32F; grey, grey + alpha, RGB or RGBA) as CV_32FC4: colour decoded if
/// `srgb`, alpha (1 where there is none) as it is; integers are fractions of their largest value.
cv::Mat toLinearRgba(const cv::Mat& stored, bool srgb);

/// CV_32FC4 scene-linear or CV_32F to 8 bits, sRGB-encoded and clipped (NaN gives 0), with dither: each
/// channel is rounded up with the probability of its fraction, decided by a hash of pixel, channel, frame and
/// seed. Values within 2^-12 of a step hit it exactly. Alpha is dithered linearly, and dropped unless
/// `withAlpha`.
cv::Mat toSrgb8(const cv::Mat& image, bool withAlpha, int frameIndex, uint32_t seed);

}  // namespace brume
