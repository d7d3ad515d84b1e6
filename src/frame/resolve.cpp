#include "frame/resolve.hpp"

#include <cmath>
#include <limits>
#include <opencv2/core/utility.hpp>

#include "frame/guided_depth.hpp"

namespace brume {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float notKnown = std::numeric_limits<float>::quiet_NaN();

/// CV_8U, 255 where `test(z)`; empty if nowhere.
template <class Test>
cv::Mat where(const cv::Mat& depth, Test test) {
    cv::Mat mask(depth.size(), CV_8U);
    bool any = false;
    for (int j = 0; j < depth.rows; ++j) {
        const float* z = depth.ptr<float>(j);
        uchar* m = mask.ptr(j);
        uchar row = 0;
        for (int i = 0; i < depth.cols; ++i) row |= m[i] = test(z[i]) ? 255 : 0;
        any |= row != 0;
    }
    return any ? mask : cv::Mat();
}

void placeSky(cv::Mat& depth, const cv::Mat& sky, const Camera& camera, double distance) {
    for (int j = 0; j < depth.rows; ++j) {
        float* z = depth.ptr<float>(j);
        const uchar* m = sky.ptr(j);
        for (int i = 0; i < depth.cols; ++i)
            if (m[i]) z[i] = float(distance / cv::norm(camera.ray(i, j)));
    }
}

}  // namespace

ReadyFrame resolveDepth(const FramePair& captured, const DepthPolicy& policy) {
    ReadyFrame ready;
    ready.frame = captured;
    const cv::Mat unknown = where(captured.depth, [](float z) { return std::isnan(z); });
    const cv::Mat sky = where(captured.depth, [](float z) { return z == infinity; });
    const bool moveSky = policy.sky == SkyPolicy::AtDistance && !sky.empty();
    cv::Mat& depth = ready.frame.depth;
    if (!unknown.empty() || moveSky || policy.smooth > 0) depth = captured.depth.clone();
    if (!unknown.empty()) {
        if (policy.unknown == UnknownDepth::Fill)
            fillUnknown(captured.color, depth);
        else
            depth.setTo(infinity, unknown);
    }
    if (policy.smooth > 0) smoothDepth(captured.color, depth, policy.smooth);
    if (moveSky) placeSky(depth, sky, captured.camera, policy.skyDistance);

    const bool keepUnknown = policy.unknown == UnknownDepth::Keep && !unknown.empty();
    const bool keepSky = policy.sky == SkyPolicy::Untouched && !sky.empty();
    if (keepUnknown || keepSky) ready.restore = cv::Mat::zeros(depth.size(), CV_8U);
    if (keepUnknown) ready.restore.setTo(1, unknown);
    if (keepSky) ready.restore.setTo(2, sky);
    return ready;
}

void restorePixels(const ReadyFrame& ready, cv::Mat& color, cv::Mat& transmittance) {
    if (ready.restore.empty()) return;
    ready.frame.color.copyTo(color, ready.restore);
    if (transmittance.empty()) return;
    transmittance.setTo(cv::Scalar::all(notKnown), ready.restore == 1);
    transmittance.setTo(cv::Scalar::all(1), ready.restore == 2);
}

}  // namespace brume
