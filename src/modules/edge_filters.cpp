// OpenCV's edge-aware filters, behind a door that opens only when needed.
#include <opencv2/ximgproc/edge_filter.hpp>

#include "modules/module.hpp"

using namespace brume;

extern "C" __attribute__((visibility("default"))) void brumeSmooth(const cv::Mat& guide, const cv::Mat& image,
                                                                   double lambda, double sigmaColor,
                                                                   cv::Mat& smooth) {
    cv::ximgproc::fastGlobalSmootherFilter(guide, image, smooth, lambda, sigmaColor);
}

static_assert(std::is_same_v<decltype(brumeSmooth), SmoothFunction>);
