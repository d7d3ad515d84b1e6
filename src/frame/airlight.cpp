#include "frame/airlight.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace brume {

namespace {

using Colors = std::vector<cv::Vec3f>;

cv::Vec3d medianOf(const Colors& colors) {
    cv::Vec3d median;
    std::vector<float> values(colors.size());
    for (int c = 0; c < 3; ++c) {
        for (size_t k = 0; k < colors.size(); ++k) values[k] = colors[k][c];
        const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
        std::nth_element(values.begin(), middle, values.end());
        median[c] = *middle;
    }
    return median;
}

bool isFinite(const cv::Vec4f& p) {
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
}

Colors skyColors(const FramePair& frame) {
    Colors colors;
    for (int j = 0; j < frame.color.rows; ++j)
        for (int i = 0; i < frame.color.cols; ++i) {
            const cv::Vec4f& p = frame.color.at<cv::Vec4f>(j, i);
            if (std::isinf(frame.depth.at<float>(j, i)) && isFinite(p)) colors.emplace_back(p[0], p[1], p[2]);
        }
    return colors;
}

/// The lowest channel within 1/64 of the picture's width.
cv::Mat darkChannel(const cv::Mat& color) {
    cv::Mat lowest(color.size(), CV_32F), dark;
    for (int j = 0; j < color.rows; ++j)
        for (int i = 0; i < color.cols; ++i) {
            const cv::Vec4f& p = color.at<cv::Vec4f>(j, i);
            lowest.at<float>(j, i) = isFinite(p) ? std::min({p[0], p[1], p[2]}) : 0;
        }
    const int patch = 2 * (color.cols / 128) + 1;
    cv::erode(lowest, dark, cv::getStructuringElement(cv::MORPH_RECT, {patch, patch}));
    return dark;
}

Colors haziest(const FramePair& frame) {
    std::vector<float> depths;
    for (int j = 0; j < frame.depth.rows; ++j)
        for (int i = 0; i < frame.depth.cols; ++i)
            if (const float z = frame.depth.at<float>(j, i); !std::isnan(z)) depths.push_back(z);
    float middle = 0;
    if (!depths.empty()) {
        std::nth_element(depths.begin(), depths.begin() + std::ptrdiff_t(depths.size() / 2), depths.end());
        middle = depths[depths.size() / 2];
    }
    const cv::Mat dark = darkChannel(frame.color);
    struct Pixel {
        float dark;
        cv::Point at;
    };
    std::vector<Pixel> pixels;
    for (int j = 0; j < dark.rows; ++j)
        for (int i = 0; i < dark.cols; ++i)
            if (frame.depth.at<float>(j, i) >= middle && isFinite(frame.color.at<cv::Vec4f>(j, i)))
                pixels.push_back({dark.at<float>(j, i), {i, j}});
    const size_t count = std::min(pixels.size(), std::max<size_t>(1, dark.total() / 1000));
    // Ties by place, so that the choice is the same everywhere.
    std::partial_sort(pixels.begin(), pixels.begin() + std::ptrdiff_t(count), pixels.end(),
                      [](const Pixel& a, const Pixel& b) {
                          return std::tuple(-a.dark, a.at.y, a.at.x) < std::tuple(-b.dark, b.at.y, b.at.x);
                      });
    Colors colors;
    for (size_t k = 0; k < count; ++k) {
        const cv::Vec4f& p = frame.color.at<cv::Vec4f>(pixels[k].at);
        colors.emplace_back(p[0], p[1], p[2]);
    }
    return colors;
}

}  // namespace

Airlight pickAirlight(const FramePair& frame) {
    const Colors sky = skyColors(frame);
    if (!sky.empty() && sky.size() * 100 >= frame.color.total()) return {medianOf(sky), "median of the sky"};
    const Colors hazy = haziest(frame);
    if (hazy.empty()) return {{0, 0, 0}, "no finite colour"};
    return {medianOf(hazy), "dark channel"};
}

}  // namespace brume
