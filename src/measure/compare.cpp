#include "measure/compare.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <vector>

#include "error.hpp"
#include "frame/color_encoding.hpp"

namespace brume {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// By bits: a compiler may assume that arithmetic never meets a NaN. Sign is kept for infinities only.
enum ValueClass : int { Finite = 0, PlusInf = 1, MinusInf = 2, NaN = 3 };

inline int classOf(double x) {
    uint64_t bits = std::bit_cast<uint64_t>(x);
    uint64_t magnitude = bits & 0x7fffffffffffffffu;
    int isInf = magnitude == 0x7ff0000000000000u, isNan = magnitude > 0x7ff0000000000000u;
    return isInf * (1 + int(bits >> 63)) + isNan * NaN;
}

// Row by row into buffers without a branch, so that it vectorises; the search for the worst comes after.
template <class T>
void differences(const T* a, const T* b, int n, double* difference) {
    for (int k = 0; k < n; k++) {
        double x = a[k], y = b[k];
        int classX = classOf(x), classY = classOf(y);
        double d = std::abs(x - y);
        difference[k] = classX != classY ? infinity : classX != Finite ? 0 : d;
    }
}

template <class T>
Comparison compareTyped(const cv::Mat& a, const cv::Mat& b, double abs, double rel, const cv::Mat& allowance,
                        const cv::Mat& ambiguous) {
    Comparison result;
    int channels = a.channels(), width = a.cols * channels;
    std::vector<double> difference(width);
    double sum = 0, worstPart = -1;
    size_t finitePairs = 0;
    for (int j = 0; j < a.rows; j++) {
        const T* rowA = a.ptr<T>(j);
        const T* rowB = b.ptr<T>(j);
        differences(rowA, rowB, width, difference.data());
        for (int i = 0; i < a.cols; i++) {
            if (!ambiguous.empty() && ambiguous.at<uint8_t>(j, i)) {
                result.leftOut++;
                continue;
            }
            result.compared++;
            double extra = allowance.empty() ? 0 : allowance.at<double>(j, i);
            bool pixelFailed = false;
            for (int c = 0; c < channels; c++) {
                int k = i * channels + c;
                double d = difference[k], magnitude = std::abs(double(rowB[k]));
                // An infinite pair of one class differs by 0, and rel·inf must not excuse a finite one.
                double bound = abs + (classOf(magnitude) == Finite ? rel * magnitude : 0) + extra;
                double part = d == 0 ? 0 : d == infinity || !(bound > 0) ? infinity : d / bound;
                pixelFailed |= !(d <= bound) || d == infinity;
                result.worst = std::max(result.worst, d);
                if (d != infinity && classOf(double(rowA[k])) == Finite) sum += d, finitePairs++;
                if (part > worstPart) {
                    worstPart = part;
                    result.place = {i, j};
                    result.channel = c;
                    result.a = double(rowA[k]);
                    result.b = double(rowB[k]);
                }
            }
            result.failed += pixelFailed;
        }
    }
    result.worstOfBound = std::max(worstPart, 0.);
    result.mean = finitePairs ? sum / double(finitePairs) : 0;
    result.passed = result.failed == 0;
    return result;
}

double encodedSrgb(double x) { return srgbEncode(x < 0 ? 0 : x > 1 ? 1 : x); }  // NaN stays NaN

}  // namespace

std::string Comparison::describe() const {
    char line[320];
    std::string channelName = channel < 4 ? std::string(1, "RGBA"[channel]) : text("channel ", channel);
    if (compared == 0) return text("nothing compared, ", leftOut, " pixels left out");
    std::snprintf(line, sizeof line,
                  "worst %.3g, mean %.3g, %.3g of the bound at (%d, %d) %s: %.9g against %.9g; %zu pixels",
                  worst, mean, worstOfBound, place.x, place.y, channelName.c_str(), a, b, compared);
    return text(line, failed ? text(", ", failed, " failed") : "",
                leftOut ? text(", ", leftOut, " left out") : "");
}

Comparison compareImages(const cv::Mat& a, const cv::Mat& b, double abs, double rel, const cv::Mat& allowance,
                         const cv::Mat& ambiguous) {
    auto isFloating = [](const cv::Mat& m) { return m.depth() == CV_32F || m.depth() == CV_64F; };
    if (a.size() != b.size() || a.channels() != b.channels() || !isFloating(a) || !isFloating(b))
        throw Error(ErrorKind::CheckFailed,
                    text("cannot compare an image of ", a.cols, "×", a.rows, ", ", a.channels(),
                         " channels, with one of ", b.cols, "×", b.rows, ", ", b.channels(),
                         " channels: both must be float images of one shape"));
    if (a.depth() == CV_32F && b.depth() == CV_32F)
        return compareTyped<float>(a, b, abs, rel, allowance, ambiguous);
    cv::Mat wideA, wideB;  // exact
    a.convertTo(wideA, CV_64F);
    b.convertTo(wideB, CV_64F);
    return compareTyped<double>(wideA, wideB, abs, rel, allowance, ambiguous);
}

double psnrEncoded(const cv::Mat& a, const cv::Mat& b) {
    if (a.size() != b.size() || a.depth() != CV_32F || b.depth() != CV_32F || a.channels() < 3 ||
        b.channels() < 3)
        throw Error(ErrorKind::CheckFailed, "PSNR needs two CV_32F colour images of one size");
    double sum = 0;
    for (int j = 0; j < a.rows; j++)
        for (int i = 0; i < a.cols; i++)
            for (int c = 0; c < 3; c++) {
                double d = encodedSrgb(a.ptr<float>(j)[i * a.channels() + c]) -
                           encodedSrgb(b.ptr<float>(j)[i * b.channels() + c]);
                sum += d * d;
            }
    return -10 * std::log10(sum / (3. * double(a.total())));
}

}  // namespace brume
