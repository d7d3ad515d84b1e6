#include "preview/display.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "frame/alpha.hpp"
#include "frame/color_encoding.hpp"

namespace brume::preview {

cv::Mat pictureBytes(const cv::Mat& color, int frameIndex, unsigned seed) {
    if (isOpaque(color)) return toSrgb8(color, false, frameIndex, seed);
    // The dither counts alpha as a channel where it is written.
    const cv::Mat bytes = toSrgb8(color, true, frameIndex, seed);
    cv::Mat rgb;
    cv::cvtColor(bytes, rgb, cv::COLOR_RGBA2RGB);
    return rgb;
}

namespace {

cv::Vec3b along(std::initializer_list<cv::Vec3d> stops, double place) {
    const double x = std::clamp(place, 0., 1.) * double(stops.size() - 1);
    const size_t k = std::min(size_t(x), stops.size() - 2);
    const cv::Vec3d* at = stops.begin() + k;
    const cv::Vec3d c = at[0] + (x - double(k)) * (at[1] - at[0]);
    return {cv::saturate_cast<uchar>(c[0]), cv::saturate_cast<uchar>(c[1]), cv::saturate_cast<uchar>(c[2])};
}

}  // namespace

cv::Vec3b heatColor(double place) {
    return along(
        {{12, 12, 16}, {60, 20, 90}, {160, 40, 100}, {230, 110, 50}, {250, 200, 90}, {255, 255, 245}}, place);
}

Difference differenceOf(const cv::Mat& a, const cv::Mat& b) {
    CV_Assert(a.size() == b.size() && a.type() == CV_32FC4 && b.type() == CV_32FC4);
    Difference result;
    result.heat.create(a.size(), CV_8UC3);
    std::mutex mutex;
    double sum = 0;
    const double low = std::log10(heatLow), high = std::log10(heatHigh);
    cv::parallel_for_(cv::Range(0, a.rows), [&](const cv::Range& rows) {
        double largest = -1, added = 0;
        cv::Point where;
        size_t unlike = 0;
        for (int j = rows.start; j < rows.end; j++)
            for (int i = 0; i < a.cols; i++) {
                const auto &p = a.at<cv::Vec4f>(j, i), &q = b.at<cv::Vec4f>(j, i);
                double most = 0;
                bool isUnlike = false;
                for (int c = 0; c < 3; c++) {
                    if (std::isfinite(p[c]) && std::isfinite(q[c]))
                        most = std::max(most, std::abs(double(p[c]) - double(q[c])));
                    else
                        isUnlike |= std::isfinite(p[c]) || std::isfinite(q[c]) ||
                                    std::isnan(p[c]) != std::isnan(q[c]);
                }
                added += most;
                unlike += isUnlike;
                if (most > largest) largest = most, where = {i, j};
                result.heat.at<cv::Vec3b>(j, i) =
                    isUnlike ? cv::Vec3b(80, 220, 120)
                             : heatColor(most > 0 ? (std::log10(most) - low) / (high - low) : 0);
            }
        std::lock_guard lock(mutex);
        sum += added;
        result.unlike += unlike;
        const bool isEarlier = largest == result.largest && (where.y < result.where.y);
        if (largest > result.largest || isEarlier) result.largest = largest, result.where = where;
    });
    result.mean = sum / double(a.total());
    return result;
}

}  // namespace brume::preview
