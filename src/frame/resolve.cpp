#include "frame/resolve.hpp"

#include <cmath>
#include <limits>
#include <opencv2/core/utility.hpp>

#include "frame/color_encoding.hpp"
#include "modules/module.hpp"

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

/// Numerator and denominator of the confidence-weighted mean: c/Z and c, side by side.
cv::Mat weightedInverse(const cv::Mat& depth) {
    cv::Mat pairs(depth.size(), CV_32FC2);
    for (int j = 0; j < depth.rows; ++j) {
        const float* z = depth.ptr<float>(j);
        float* p = pairs.ptr<float>(j);
        for (int i = 0; i < depth.cols; ++i) {
            const bool known = !std::isnan(z[i]);
            p[2 * i] = known ? 1 / z[i] : 0;  // the sky's is 0
            p[2 * i + 1] = known ? 1 : 0;
        }
    }
    return pairs;
}

void fillUnknown(const cv::Mat& color, cv::Mat& depth, cv::Mat unknown) {
    SmoothFunction& smooth = moduleFunction<SmoothFunction>("edge_filters", "brumeSmooth");
    const cv::Mat guide = toSrgb8(color, false, 0, 0);
    const cv::Mat pairs = weightedInverse(depth);
    // λ carries a surface some 30 px into a hole before its weight falls by e; σ of 8 of 255 stops it at
    // edges. Where no weight arrives in fp32, wider and blunter until some does.
    double lambda = 1000, sigma = 8;
    for (int round = 0; round < 6 && cv::countNonZero(unknown) > 0; ++round, lambda *= 32, sigma *= 4) {
        cv::Mat smoothed;
        smooth(guide, pairs, lambda, sigma, smoothed);
        for (int j = 0; j < depth.rows; ++j) {
            const float* p = smoothed.ptr<float>(j);
            float* z = depth.ptr<float>(j);
            uchar* m = unknown.ptr(j);
            for (int i = 0; i < depth.cols; ++i) {
                if (!m[i] || !(p[2 * i + 1] > 1e-30f)) continue;
                z[i] = p[2 * i] > 0 ? p[2 * i + 1] / p[2 * i] : infinity;
                m[i] = 0;
            }
        }
    }
    depth.setTo(infinity, unknown);
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
    if (!unknown.empty() || moveSky) depth = captured.depth.clone();
    if (!unknown.empty()) {
        if (policy.unknown == UnknownDepth::Fill)
            fillUnknown(captured.color, depth, unknown.clone());
        else
            depth.setTo(infinity, unknown);
    }
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
