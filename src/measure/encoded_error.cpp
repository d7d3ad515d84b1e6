#include "measure/encoded_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "frame/color_encoding.hpp"

namespace brume {
namespace {

uint32_t hash(uint32_t x) {  // Murmur3's finaliser
    x ^= x >> 16;
    x *= 0x85ebca6bu;
    x ^= x >> 13;
    x *= 0xc2b2ae35u;
    return x ^ x >> 16;
}

double clipped(double x) { return x < 0 ? 0 : x > 1 ? 1 : x; }  // NaN stays NaN

}  // namespace

SampleGrid sampleGrid(cv::Size image, size_t count, uint32_t seed) {
    SampleGrid grid;
    grid.cells = image;
    if (size_t(image.area()) > count) {
        double edge = std::sqrt(double(image.area()) / double(std::max<size_t>(1, count)));
        grid.cells = {std::clamp(int(image.width / edge), 1, image.width),
                      std::clamp(int(image.height / edge), 1, image.height)};
    }
    auto place = [&](int cell, int cells, int length, uint32_t random) {
        int begin = int(int64_t(cell) * length / cells), end = int(int64_t(cell + 1) * length / cells);
        return begin + int(uint64_t(random) * uint64_t(end - begin) >> 32);
    };
    for (int j = 0; j < grid.cells.height; j++)
        for (int i = 0; i < grid.cells.width; i++) {
            uint32_t random = hash(hash(hash(seed) + uint32_t(j)) + uint32_t(i));
            grid.pixels.emplace_back(place(i, grid.cells.width, image.width, random),
                                     place(j, grid.cells.height, image.height, hash(random)));
        }
    return grid;
}

double encodedDifference(const cv::Vec4d& a, const cv::Vec4d& b) {
    double largest = 0;
    for (int c = 0; c < 3; c++) {
        double d = 255 * std::abs(srgbEncode(clipped(a[c])) - srgbEncode(clipped(b[c])));
        if (std::isnan(d)) d = std::isnan(a[c]) && std::isnan(b[c]) ? 0 : HUGE_VAL;
        largest = std::max(largest, d);
    }
    return largest;
}

std::vector<double> encodedErrors(const cv::Mat& image, std::span<const cv::Point> pixels,
                                  std::span<const ReferencePixel> truth) {
    std::vector<double> errors(pixels.size());
    for (size_t k = 0; k < pixels.size(); k++)
        errors[k] = truth[k].ambiguous ? std::nan("")
                                       : encodedDifference(image.at<cv::Vec4f>(pixels[k]), truth[k].color);
    return errors;
}

ErrorStatistics errorStatistics(std::span<const double> errors, std::span<const cv::Point> pixels) {
    ErrorStatistics s;
    std::vector<double> known;
    double sum = 0;
    for (size_t k = 0; k < errors.size(); k++) {
        if (std::isnan(errors[k])) continue;
        if (known.empty() || errors[k] > s.worst) s.worst = errors[k], s.place = pixels[k];
        sum += errors[k] * errors[k];
        known.push_back(errors[k]);
    }
    s.compared = known.size();
    s.leftOut = errors.size() - known.size();
    s.rms = known.empty() ? 0 : std::sqrt(sum / double(known.size()));
    s.percentile = known.empty() ? 0 : percentileOf(known, .999);
    return s;
}

double percentileOf(std::vector<double> values, double share) {
    if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
    // A product such as .999·1000 must not round up to the next place.
    size_t place = size_t(std::ceil(share * double(values.size()) * (1 - 1e-12)));
    place = std::clamp<size_t>(place, 1, values.size()) - 1;
    std::nth_element(values.begin(), values.begin() + ptrdiff_t(place), values.end());
    return values[place];
}

}  // namespace brume
