#include <algorithm>
#include <cmath>
#include <iomanip>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "error.hpp"
#include "frame/color_encoding.hpp"
#include "frame/inspect.hpp"
#include "frame/inspect_evidence.hpp"

namespace brume {

namespace {

using Rgb = cv::Vec3b;

/// Near to far: pale yellow, orange, magenta, violet, deep blue.
Rgb depthColor(double place) {
    static const cv::Vec3d stops[] = {
        {255, 244, 170}, {250, 160, 60}, {205, 60, 90}, {110, 40, 130}, {25, 25, 75}};
    const double x = std::clamp(place, 0., 1.) * 4;
    const int k = std::min(int(x), 3);
    const cv::Vec3d c = stops[k] + (x - k) * (stops[k + 1] - stops[k]);
    return {cv::saturate_cast<uchar>(c[0]), cv::saturate_cast<uchar>(c[1]), cv::saturate_cast<uchar>(c[2])};
}

struct LogRange {
    double low = 0, high = 1;
    double place(float z) const { return (std::log(z) - low) / (high - low); }
};

LogRange rangeOf(const DepthStatistics& s) {
    if (!(s.p1 > 0)) return {};
    const double low = std::log(s.p1), high = std::log(s.p99);
    return {low - .05, std::max(high, low + .1) + .05};
}

cv::Mat depthPicture(const cv::Mat& depth, const LogRange& range) {
    cv::Mat picture(depth.size(), CV_8UC3);
    for (int j = 0; j < depth.rows; ++j)
        for (int i = 0; i < depth.cols; ++i) {
            const float z = depth.at<float>(j, i);
            picture.at<Rgb>(j, i) = std::isnan(z)   ? Rgb(0, 0, 0)
                                    : std::isinf(z) ? Rgb(255, 255, 255)
                                                    : depthColor(range.place(z));
        }
    return picture;
}

void label(cv::Mat& picture, const std::string& words, cv::Point at, double size = .4) {
    cv::putText(picture, words, at, cv::FONT_HERSHEY_SIMPLEX, size, {20, 20, 20}, 3, cv::LINE_AA);
    cv::putText(picture, words, at, cv::FONT_HERSHEY_SIMPLEX, size, {235, 235, 235}, 1, cv::LINE_AA);
}

std::string metres(double z) {
    std::ostringstream out;
    out << std::setprecision(3) << z << " m";
    return out.str();
}

cv::Mat histogramPicture(const cv::Mat& depth, const LogRange& range, cv::Size size) {
    constexpr int bins = 96;
    std::vector<double> count(bins);
    for (int j = 0; j < depth.rows; ++j)
        for (int i = 0; i < depth.cols; ++i) {
            const float z = depth.at<float>(j, i);
            if (std::isfinite(z)) ++count[std::clamp(int(range.place(z) * bins), 0, bins - 1)];
        }
    const double most = *std::max_element(count.begin(), count.end());
    cv::Mat picture(size, CV_8UC3, cv::Scalar(34, 34, 36));
    const int left = 8, right = size.width - 8, floor = size.height - 28, top = 12;
    for (int b = 0; b < bins && most > 0; ++b) {
        const int x0 = left + (right - left) * b / bins, x1 = left + (right - left) * (b + 1) / bins;
        // Square roots, so that the small groups show.
        const int height = int(std::lround(std::sqrt(count[b] / most) * (floor - top)));
        const Rgb c = depthColor((b + .5) / bins);
        cv::rectangle(picture, {x0, floor - height, std::max(1, x1 - x0), height},
                      cv::Scalar(c[0], c[1], c[2]), cv::FILLED);
    }
    cv::line(picture, {left, floor}, {right, floor}, {120, 120, 120});
    for (const double place : {0., .25, .5, .75, 1.}) {
        const int x = left + int((right - left) * place);
        const double z = std::exp(range.low + place * (range.high - range.low));
        cv::line(picture, {x, floor}, {x, floor + 4}, {120, 120, 120});
        label(picture, metres(z), {std::clamp(x - 22, 2, size.width - 58), size.height - 8}, .36);
    }
    return picture;
}

cv::Mat scaledTo(const cv::Mat& picture, int height, int interpolation) {
    cv::Mat out;
    cv::resize(picture, out, {std::max(1, picture.cols * height / picture.rows), height}, 0, 0,
               interpolation);
    return out;
}

}  // namespace

cv::Mat depthColors(const cv::Mat& depth) { return depthPicture(depth, rangeOf(depthStatistics(depth))); }

cv::Mat inspectionPicture(const FramePair& frame) {
    const int height = std::clamp(frame.size().height, 120, 480);
    const LogRange range = rangeOf(depthStatistics(frame.depth));
    const cv::Mat color = scaledTo(toSrgb8(frame.color, false, 0, 0), height, cv::INTER_AREA);
    const cv::Mat depth = scaledTo(depthPicture(frame.depth, range), height, cv::INTER_NEAREST);
    cv::Mat all;
    cv::hconcat(std::vector<cv::Mat>{color, depth, histogramPicture(frame.depth, range, {420, height})}, all);
    return toLinearRgba(all, true);
}

cv::Mat readingsPicture(const Capture& capture, const std::vector<Reading>& readings, int width) {
    std::vector<cv::Mat> thumbnails;
    for (size_t k = 0; k < std::min<size_t>(readings.size(), 8); ++k) {
        const cv::Mat depth = thinnedReading(capture, readings[k].encoding).depth;
        cv::Mat picture = scaledTo(depthPicture(depth, rangeOf(depthStatistics(depth))),
                                   width * depth.rows / depth.cols, cv::INTER_NEAREST);
        picture = picture(cv::Rect(0, 0, std::min(width, picture.cols), picture.rows)).clone();
        if (picture.cols < width)
            cv::copyMakeBorder(picture, picture, 0, 0, 0, width - picture.cols, cv::BORDER_CONSTANT);
        std::ostringstream words;
        words << k + 1 << ": " << std::setprecision(2) << readings[k].score << "  "
              << readings[k].name.substr(0, 34);
        label(picture, words.str(), {4, 14}, .36);
        thumbnails.push_back(picture);
    }
    if (thumbnails.empty()) failIo(capture.depthPath, ": no reading makes sense of its numbers");
    const int columns = thumbnails.size() > 4 ? 4 : int(thumbnails.size());
    std::vector<cv::Mat> rows;
    for (size_t k = 0; k < thumbnails.size(); k += size_t(columns)) {
        std::vector<cv::Mat> row(
            thumbnails.begin() + std::ptrdiff_t(k),
            thumbnails.begin() + std::ptrdiff_t(std::min(thumbnails.size(), k + size_t(columns))));
        while (int(row.size()) < columns) row.push_back(cv::Mat::zeros(thumbnails[0].size(), CV_8UC3));
        cv::Mat joined;
        cv::hconcat(row, joined);
        rows.push_back(joined);
    }
    cv::Mat all;
    cv::vconcat(rows, all);
    return toLinearRgba(all, true);
}

}  // namespace brume
