#include "frame/guided_depth.hpp"

#include <cmath>
#include <limits>

#include "frame/color_encoding.hpp"
#include "modules/module.hpp"

namespace brume {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float notKnown = std::numeric_limits<float>::quiet_NaN();

/// Weights of one pixel: c/Z and c of finite depth, c of sky, c of unknown.
cv::Vec4f weights(float z) {
    if (std::isnan(z)) return {0, 0, 0, 1};
    if (z == infinity) return {0, 0, 1, 0};
    return {1 / z, 1, 0, 0};
}

cv::Mat smoothed(const cv::Mat& guide, const cv::Mat& weights, double lambda, double sigma) {
    cv::Mat out;
    moduleFunction<SmoothFunction>("edge_filters", "brumeSmooth")(guide, weights, lambda, sigma, out);
    return out;
}

/// σ of colour, of 255: contrasts above it stop the smoother.
constexpr double edgeSigma = 8;

}  // namespace

void fillUnknown(const cv::Mat& color, cv::Mat& depth) {
    cv::Mat known(depth.size(), CV_32FC3);
    int left = 0;
    for (int j = 0; j < depth.rows; ++j)
        for (int i = 0; i < depth.cols; ++i) {
            const cv::Vec4f w = weights(depth.at<float>(j, i));
            known.at<cv::Vec3f>(j, i) = {w[0], w[1], w[2]};
            left += w[3] > 0;
        }
    const cv::Mat guide = toSrgb8(color, false, 0, 0);
    // λ carries a surface some 30 px into a hole before its weight falls by e. Where no weight arrives in
    // fp32, further and over blunter edges until some does.
    double lambda = 1000, sigma = edgeSigma;
    for (int round = 0; round < 6 && left > 0; ++round, lambda *= 32, sigma *= 4) {
        const cv::Mat reached = smoothed(guide, known, lambda, sigma);
        for (int j = 0; j < depth.rows; ++j)
            for (int i = 0; i < depth.cols; ++i) {
                float& z = depth.at<float>(j, i);
                const cv::Vec3f& w = reached.at<cv::Vec3f>(j, i);
                if (!std::isnan(z) || !(w[1] + w[2] > 1e-30f)) continue;
                z = w[2] > w[1] ? infinity : w[1] / w[0];
                --left;
            }
    }
    if (left == 0) return;
    for (int j = 0; j < depth.rows; ++j)  // nothing is known at all
        for (int i = 0; i < depth.cols; ++i)
            if (std::isnan(depth.at<float>(j, i))) depth.at<float>(j, i) = infinity;
}

cv::Mat depthAtSize(const cv::Mat& color, const cv::Mat& depth) {
    const double x = double(depth.cols) / color.cols, y = double(depth.rows) / color.rows;
    cv::Mat out(color.size(), CV_32F);
    if (x >= 1 && y >= 1) {
        for (int j = 0; j < out.rows; ++j)
            for (int i = 0; i < out.cols; ++i)
                out.at<float>(j, i) = depth.at<float>(int((j + .5) * y), int((i + .5) * x));
        return out;
    }
    // Each sample counts at the pixel its centre falls in; the smoother carries it to its neighbours.
    cv::Mat scattered = cv::Mat::zeros(color.size(), CV_32FC4);
    for (int j = 0; j < depth.rows; ++j)
        for (int i = 0; i < depth.cols; ++i)
            scattered.at<cv::Vec4f>(int((j + .5) / y), int((i + .5) / x)) = weights(depth.at<float>(j, i));
    const cv::Mat guide = toSrgb8(color, false, 0, 0);
    const double spacing = std::max(1 / x, 1 / y);
    const cv::Mat reached = smoothed(guide, scattered, spacing * spacing, edgeSigma);
    for (int j = 0; j < out.rows; ++j)
        for (int i = 0; i < out.cols; ++i) {
            const cv::Vec4f& w = reached.at<cv::Vec4f>(j, i);
            const float nearest = depth.at<float>(std::min(int((j + .5) * y), depth.rows - 1),
                                                  std::min(int((i + .5) * x), depth.cols - 1));
            float& z = out.at<float>(j, i);
            if (!(w[1] + w[2] + w[3] > 1e-30f))
                z = nearest;  // walled in by edges
            else if (w[3] > w[1] + w[2])
                z = notKnown;
            else
                z = w[2] > w[1] ? infinity : w[1] / w[0];
        }
    return out;
}

void smoothDepth(const cv::Mat& color, cv::Mat& depth, double radius) {
    cv::Mat finite(depth.size(), CV_32FC2);
    for (int j = 0; j < depth.rows; ++j)
        for (int i = 0; i < depth.cols; ++i) {
            const cv::Vec4f w = weights(depth.at<float>(j, i));
            finite.at<cv::Vec2f>(j, i) = {w[0], w[1]};
        }
    const cv::Mat reached = smoothed(toSrgb8(color, false, 0, 0), finite, radius * radius, edgeSigma);
    for (int j = 0; j < depth.rows; ++j)
        for (int i = 0; i < depth.cols; ++i) {
            float& z = depth.at<float>(j, i);
            const cv::Vec2f& w = reached.at<cv::Vec2f>(j, i);
            if (std::isfinite(z) && w[0] > 1e-30f) z = w[1] / w[0];
        }
}

}  // namespace brume
