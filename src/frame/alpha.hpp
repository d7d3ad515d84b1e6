// Between premultiplied (associated) alpha, as EXR stores it, and unassociated, as effects see it.
#pragma once

#include <opencv2/core/mat.hpp>

namespace brume {

/// CV_32FC4 in place: colour divided by alpha. Where alpha is 0 (or NaN) colour is left as it is: a glow that
/// covers nothing survives both ways.
void unpremultiply(cv::Mat& rgba);
/// The inverse, into `out` (may be `rgba` itself).
void premultiply(const cv::Mat& rgba, cv::Mat& out);
/// True where alpha is 1 everywhere: such pictures are written without it.
bool isOpaque(const cv::Mat& rgba);

}  // namespace brume
