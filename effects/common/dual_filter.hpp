// Dual filtering on the CPU (Bjørge 2015): halve with five bilinear taps, double with eight, as GPUs blur.
// Twin of dual_filter.glsl.
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace blur {

/// What makes a dual filter of standard deviation σ.
struct DualFilter {
    int levels = 1;    ///< how often the image is halved
    float offset = 0;  ///< px of the finer image between neighbouring taps
    float share = 1;   ///< of the blurred image in the result; less than 1 below a σ of 1 px
};

constexpr int dualLevelsMost = 6;
/// Px of the smallest image on each side beyond the image proper, so that edges replicate.
constexpr int dualMargin = 4;

/// Variance per level, in squared px of the finer image. Every step of a filter moves by no mean, so
/// variances add: a bilinear tap at x between texels adds x² + f·(1 - f), f the fraction of x.
inline double dualVariance(double offset) {
    auto tap = [](double from, double by) {
        double f = from + by - std::floor(from + by);
        return by * by + f * (1 - f);
    };
    double halving = .5 * tap(.5, 0) + .25 * (tap(.5, offset) + tap(.5, -offset));
    double d = offset / 2, doubling = 0;  // along one axis: two sides at ±2d, two at 0, four corners at ±d
    for (double sign : {-1., 1.})
        doubling += (tap(.25, 2 * d * sign) + tap(.25, 0) + 4 * tap(.25, d * sign)) / 12;
    return halving + 4 * doubling;
}

/// The fewest levels whose taps stand no farther apart than `offsetMost`, and the offset that makes the
/// variance σ². From a σ of 106 on the taps of the last level part.
inline DualFilter dualFilter(double sigma) {
    constexpr double offsetMost = 2;
    DualFilter filter;
    if (sigma < 1) {
        filter.share = float(sigma * sigma);
        return filter;
    }
    auto perLevel = [&](int levels) { return sigma * sigma * 3 / (std::pow(4., levels) - 1); };
    while (filter.levels < dualLevelsMost && perLevel(filter.levels) > dualVariance(offsetMost))
        filter.levels++;
    double low = 0, high = sigma + 1;
    for (int n = 0; n < 60; n++) {
        double middle = (low + high) / 2;
        (dualVariance(middle) < perLevel(filter.levels) ? low : high) = middle;
    }
    filter.offset = float(low);
    return filter;
}

/// NaN counts as 0, ±inf as ±65504.
inline cv::Vec4f finiteAt(const cv::Mat& image, int x, int y) {
    cv::Vec4f c = image.at<cv::Vec4f>(std::clamp(y, 0, image.rows - 1), std::clamp(x, 0, image.cols - 1));
    for (int n = 0; n < 4; n++)
        if (!std::isfinite(c[n])) c[n] = std::isnan(c[n]) ? 0 : std::copysign(65504.0f, c[n]);
    return c;
}

/// Sets each pixel of `to` to `color(tap)`; tap(dx, dy) is `from`, bilinear, at place + d, `place` where the
/// pixel's column or row lies in `from`, counted from texel centres.
template <class Place, class Color>
void dualStep(const cv::Mat& from, cv::Mat& to, Place place, Color color) {
    cv::parallel_for_(cv::Range(0, to.rows), [&](const cv::Range& range) {
        for (int j = range.start; j < range.end; j++)
            for (int i = 0; i < to.cols; i++)
                to.at<cv::Vec4f>(j, i) = color([&, atX = place(i, from.cols, to.cols),
                                                atY = place(j, from.rows, to.rows)](float dx, float dy) {
                    float x = atX + dx, y = atY + dy, left = std::floor(x), upper = std::floor(y);
                    float fx = x - left, fy = y - upper;
                    int u = int(left), v = int(upper);
                    cv::Vec4f above = finiteAt(from, u, v) * (1 - fx) + finiteAt(from, u + 1, v) * fx;
                    cv::Vec4f below = finiteAt(from, u, v + 1) * (1 - fx) + finiteAt(from, u + 1, v + 1) * fx;
                    return cv::Vec4f(above * (1 - fy) + below * fy);
                });
    });
}

/// `in` and `out` are CV_32FC4 of one size and do not overlap.
inline void dualBlur(const cv::Mat& in, cv::Mat& out, DualFilter filter) {
    auto halved = [&](auto tap) {
        float d = filter.offset;
        cv::Vec4f corners = (tap(-d, -d) + tap(d, -d)) + (tap(-d, d) + tap(d, d));
        return cv::Vec4f(.5f * tap(0.f, 0.f) + .125f * corners);
    };
    auto doubled = [&](auto tap) {
        float d = .5f * filter.offset;
        cv::Vec4f corners = (tap(-d, -d) + tap(d, -d)) + (tap(-d, d) + tap(d, d));
        cv::Vec4f sides = (tap(-2 * d, 0.f) + tap(2 * d, 0.f)) + (tap(0.f, -2 * d) + tap(0.f, 2 * d));
        return cv::Vec4f((2.f * corners + sides) * (1.f / 12));
    };
    auto wider = [](int i, int from, int to) { return 2 * i - (2 * to - from) / 2 + .5f; };
    auto narrower = [](int i, int from, int to) { return .5f * (i + (2 * from - to) / 2) - .25f; };
    auto length = [&](int length, int k) {
        return (((length - 1) >> filter.levels) + 1 + 2 * dualMargin) << (filter.levels - k);
    };
    auto level = [&](int k) { return cv::Mat(length(in.rows, k), length(in.cols, k), CV_32FC4); };
    cv::Mat image = in;
    for (int k = 1; k <= filter.levels; k++) {
        cv::Mat half = level(k);
        dualStep(image, half, wider, halved);
        image = half;
    }
    for (int k = filter.levels - 1; k >= 0; k--) {
        cv::Mat twice = k ? level(k) : out;
        dualStep(image, twice, narrower, doubled);
        image = twice;
    }
    if (filter.share < 1)
        for (int j = 0; j < in.rows; j++)
            for (int i = 0; i < in.cols; i++) {
                cv::Vec4f& c = out.at<cv::Vec4f>(j, i);
                c = finiteAt(in, i, j) * (1 - filter.share) + c * filter.share;
            }
}

}  // namespace blur
