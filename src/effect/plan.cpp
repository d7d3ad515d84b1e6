#include "effect/plan.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "frame/color_encoding.hpp"

namespace brume {

ImageBounds ImageBounds::mixedWith(double from, double to) const {
    ImageBounds mixed = *this;
    mixed.low = std::min(low, from), mixed.high = std::max(high, to);
    if (lowest.empty()) return mixed;
    cv::min(lowest, cv::Scalar::all(from), mixed.lowest);
    cv::max(highest, cv::Scalar::all(to), mixed.highest);
    // Dark pixels may become `to` and bright ones stay: at most mean(max(x, to)), whose x lie between the
    // tile's ends. The bend of max is largest where all of them lie at one end or the other. Likewise below.
    mixed.leastMean = leastMean.clone(), mixed.greatestMean = greatestMean.clone();
    mixed.leastMean.forEach<cv::Vec3f>([&](cv::Vec3f& mean, const int* at) {
        const auto &low = lowest.at<cv::Vec3f>(at), &high = highest.at<cv::Vec3f>(at),
                   &mixedLow = mixed.lowest.at<cv::Vec3f>(at), &mixedHigh = mixed.highest.at<cv::Vec3f>(at);
        auto& greatest = mixed.greatestMean.at<cv::Vec3f>(at);
        for (int n = 0; n < 3; n++) {
            const float range = high[n] - low[n];
            auto share = [&](float x) { return range > 0 ? (x - low[n]) / range : 1.0f; };
            const float bottom = std::max(low[n], float(to)), top = std::min(high[n], float(from));
            greatest[n] = bottom + share(greatest[n]) * (mixedHigh[n] - bottom);
            mean[n] = mixedLow[n] + share(mean[n]) * (top - mixedLow[n]);
        }
    });
    return mixed;
}

ImageBounds ImageBounds::anywhere(double from, double to) {
    ImageBounds bounds;
    bounds.low = from, bounds.high = to;
    return bounds;
}

double PlanInput::visible(double a, double b) const {
    a *= gain, b *= gain;
    if (std::isnan(a) || std::isnan(b)) return a == b ? 0 : HUGE_VAL;
    if (isLast) return std::abs(srgbEncode(std::clamp(a, 0., 1.)) - srgbEncode(std::clamp(b, 0., 1.)));
    const double larger = std::max(std::abs(a), std::abs(b));
    if (larger <= 1) return std::abs(srgbEncode(a) - srgbEncode(b));
    // The curve's slope at 1: what a ratio makes of a value that is darkened to just below white.
    return std::isinf(larger) ? (a == b ? 0 : HUGE_VAL) : std::abs(a - b) / larger * (1.055 / 2.4);
}

double PlanInput::largestUnseen(double lowest) const {
    if (std::isinf(gain)) return 0;
    const double slope = 1.055 / 2.4;  // of the curve at 1
    double error;
    if (isLast && lowest >= 1) {
        error = lowest - srgbDecode(1 - tolerance);
    } else if (lowest >= 1) {
        error = lowest * tolerance / slope;
    } else {
        // The curve is concave: an error shows most just above `lowest`, downwards.
        const double encoded = srgbEncode(std::max(0., lowest));
        error = encoded <= tolerance ? srgbDecode(tolerance) : lowest - srgbDecode(encoded - tolerance);
    }
    return error / gain;
}

double PlanInput::mixingShows(double opacity, double from, double to) const {
    if (!(opacity > 0)) return 0;
    // A pixel changes most at one end of what there is, or where clipping begins.
    double most = 0;
    auto within = [&](double color) { return std::clamp(color, input.low, std::max(input.low, input.high)); };
    for (double color : {input.low, within(0), within(1), input.high})
        for (double light : {from, to}) {
            const double mixed = opacity >= 1 ? light : color * (1 - opacity) + light * opacity;
            most = std::max(most, visible(color, mixed));
        }
    return most;
}

}  // namespace brume
