// Depth carried to pixels that have none, along the edges of the colour image.
#pragma once

#include <opencv2/core/mat.hpp>

namespace brume {

// All take colour as CV_32FC4 and depth as CV_32F (m; +inf sky, NaN unknown). Finite depth is averaged as
// 1/Z, weighted by confidence: fgs(c/Z)/fgs(c), fgs being OpenCV's fast global smoother (Min et al. 2014)
// guided by colour. Sky is not averaged: a pixel is sky where more of the weight that reaches it is sky's.

/// Fills NaN, whatever the hole's size; everything else stays as it is.
void fillUnknown(const cv::Mat& color, cv::Mat& depth);

/// Depth at the colour's size. Smaller depth is brought up along colour edges, unknown stays unknown (but
/// islands of a sample or two close); larger depth is sampled at pixel centres.
cv::Mat depthAtSize(const cv::Mat& color, const cv::Mat& depth);

/// Finite depth smoothed over about `radius` px, not across colour edges; sky and unknown stay.
void smoothDepth(const cv::Mat& color, cv::Mat& depth, double radius);

}  // namespace brume
