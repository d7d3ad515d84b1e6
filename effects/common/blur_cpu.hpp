// Separable blurs of RGBA float images on the CPU: FIR, decimated FIR, recursion. Edges replicate exactly.
// Twin of blur.glsl; both read the numbers of blur_design.hpp.
#pragma once

#include <algorithm>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "common/blur_lines.hpp"
#include "common/fir_lines.hpp"
#include "common/scratch.hpp"

namespace blur {

/// Both sides of a half kernel.
inline std::vector<float> wholeTaps(std::span<const float> half) {
    std::vector<float> taps(half.rbegin(), half.rend());
    taps.insert(taps.end(), half.begin() + 1, half.end());
    return taps;
}

/// A symmetric FIR along rows, then along columns. `half` holds the centre tap and one side's. `in` and `out`
/// are CV_32FC4 of one size and do not overlap.
inline void separableFir(const cv::Mat& in, cv::Mat& out, std::span<const float> half) {
    const std::vector<float> taps = wholeTaps(half);
    const int tapCount = int(taps.size()), reach = tapCount / 2, width = in.cols, height = in.rows;
    // Upright tiles, one a task: no row is filtered twice. The filtered rows that four output rows need stay
    // in the L2 cache where they can.
    const int lines = tapCount - 1 + acrossRows, threads = cv::getNumThreads();
    const int widest = std::clamp(384 * 1024 / (16 * lines), 32, 960);
    const int tiles = std::min((width + 31) / 32, ((width - 1) / widest / threads + 1) * threads);
    const int tile = ((width - 1) / tiles / 32 + 1) * 32;
    auto filterTiles = [&](const cv::Range& range) {
        Scratch padded(4 * size_t(tile + 2 * reach)), ring(size_t(lines) * 4 * tile);
        std::vector<const float*> rows(lines);
        auto slot = [&](int y) { return ring.data() + size_t(y % lines) * 4 * tile; };
        for (int index = range.start; index < range.end; index++) {
            const int x0 = index * tile, count = std::min(tile, width - x0);
            // Only pixels within reach of an edge need a padded row. The parts keep firAlong's step of 32 px.
            const int inside0 = std::min((std::max(reach - x0, 0) + 31) / 32 * 32, count),
                      inside1 =
                          std::min(inside0 + std::max(width - reach - x0 - inside0, 0) / 32 * 32, count);
            auto filterRow = [&](int y, int from, int end) {
                if (from == end) return;
                float* to = slot(y) + 4 * from;
                filterReplicated(to, 4 * (end - from), padded.data(), in.ptr<float>(y), width,
                                 x0 + from - reach, end - from + 2 * reach, [&](const float* line) {
                                     firAlong(to, line, taps.data(), tapCount, end - from,
                                              in.ptr<float>(std::min(y + 1, height - 1)) + 4 * (x0 + from));
                                 });
            };
            for (int y = 0, done = 0; y < height; y += acrossRows) {
                for (; done <= std::min(y + acrossRows - 1 + reach, height - 1); done++) {
                    filterRow(done, 0, inside0);
                    filterRow(done, inside0, inside1);
                    filterRow(done, inside1, count);
                }
                for (int u = 0; u < lines; u++) rows[u] = slot(std::clamp(y - reach + u, 0, height - 1));
                float* to[acrossRows];
                const int made = std::min(acrossRows, height - y);
                for (int k = 0; k < made; k++) to[k] = out.ptr<float>(y + k) + 4 * x0;
                firAcross(to, made, rows.data(), 1, taps.data(), tapCount, 4 * count);
            }
        }
    };
    cv::parallel_for_(cv::Range(0, (width - 1) / tile + 1), filterTiles, tiles);
}

/// The numbers of a decimated blur, see blur_design.hpp.
struct DecimatedBlur {
    int factor = 1;                    ///< px of the image per px of the small one
    std::span<const float> prefilter;  ///< half, before taking every factor-th pixel
    std::span<const float> small;      ///< half, on the small image
    std::span<const float> up;         ///< 4 × factor cubic B-spline weights
};

/// Small pixels on each side beyond the first and last that lie within the image.
constexpr int smallMargin = 4;
inline int smallLength(int length, int factor) { return (length - 1) / factor + 1 + 2 * smallMargin; }

/// Every factor-th pixel of the filtered image; small pixel (i, j) sits at ((i - margin)·factor, ...).
/// `filterRow(y, first, count, padded, result, floats, filter)` calls `filter` on row y's `count` pixels from
/// `first` on, beyond the edges replicated, for which `padded` has room; what it writes are the `floats`
/// floats at `result`.
/// `scratch`, where large enough, lends its memory.
template <class FilterRow>
cv::Mat decimateRows(int width, int height, int factor, std::span<const float> half, const cv::Mat& scratch,
                     FilterRow filterRow) {
    const int reach = int(half.size()) - 1;
    const int smallWidth = smallLength(width, factor), smallHeight = smallLength(height, factor);
    const std::vector<float> taps = wholeTaps(half);
    const int tapCount = int(taps.size()), pairCount = reach + 1;
    const int lines = tapCount + (acrossRows - 1) * factor;
    std::vector<float> pairs(8 * pairCount, 0.0f);
    for (int t = -reach; t <= reach; t++)
        for (int c = 0; c < 4; c++) pairs[4 * (t + reach) + c] = half[std::abs(t)];
    bool fits = scratch.isContinuous() && scratch.total() >= size_t(smallWidth) * smallHeight;
    cv::Mat small = fits ? cv::Mat(smallHeight, smallWidth, CV_32FC4, scratch.data)
                         : cv::Mat(smallHeight, smallWidth, CV_32FC4);
    const int bands = std::clamp(smallHeight / 16, 1, cv::getNumThreads());
    cv::parallel_for_(cv::Range(0, bands), [&](const cv::Range& range) {
        // Room for two spare taps and four spare outputs.
        const int first = -smallMargin * factor - reach;
        const int count = (smallWidth - 1) * factor + 2 * pairCount;
        Scratch padded(4 * size_t(count)), ring(size_t(lines) * 4 * smallWidth);
        std::vector<const float*> rows(lines);
        auto slot = [&](int y) { return ring.data() + size_t(y % lines) * 4 * smallWidth; };
        for (int band = range.start; band < range.end; band++) {
            int j0 = smallHeight * band / bands, j1 = smallHeight * (band + 1) / bands;
            int done = std::clamp((j0 - smallMargin) * factor - reach, 0, height - 1);
            for (int j = j0; j < j1; j += acrossRows) {
                const int rowCount = std::min(acrossRows, j1 - j), y = (j - smallMargin) * factor;
                for (; done <= std::clamp(y + (rowCount - 1) * factor + reach, 0, height - 1); done++) {
                    float* result = slot(done);
                    filterRow(done, first, count, padded.data(), result, 4 * smallWidth,
                              [&](const float* line) {
                                  decimateLine(result, line, pairs.data(), pairCount, factor, smallWidth);
                              });
                }
                for (int u = 0; u < lines; u++) rows[u] = slot(std::clamp(y - reach + u, 0, height - 1));
                float* to[acrossRows];
                for (int k = 0; k < rowCount; k++) to[k] = small.ptr<float>(j + k);
                firAcross(to, rowCount, rows.data(), factor, taps.data(), tapCount, 4 * smallWidth);
            }
        }
    });
    return small;
}

inline cv::Mat decimate(const cv::Mat& in, int factor, std::span<const float> half, const cv::Mat& scratch) {
    auto filterRow = [&](int y, int first, int count, float* padded, float* result, int floats, auto filter) {
        filterReplicated(result, floats, padded, in.ptr<float>(y), in.cols, first, count, filter);
    };
    return decimateRows(in.cols, in.rows, factor, half, scratch, filterRow);
}

/// What enlargeLine wants of the weights.
inline std::vector<float> phasePairs(int factor, std::span<const float> up) {
    std::vector<float> pairs(size_t(factor + 1) / 2 * 32, 0.0f);
    for (int phase = 0; phase < factor; phase++)
        for (int m = 0; m < 4; m++)
            for (int c = 0; c < 4; c++) pairs[phase / 2 * 32 + 8 * m + phase % 2 * 4 + c] = up[4 * phase + m];
    return pairs;
}

/// Pixels of row y of the enlarged small image from column `from`, a multiple of `factor`, on. `between` has
/// room for a row of the small image.
inline void enlargeRow(const cv::Mat& small, int factor, std::span<const float> up, const float* pairs, int y,
                       int from, int count, float* between, float* out) {
    int j = y / factor + smallMargin, phase = y % factor, i = from / factor + smallMargin - 1;
    const float* rows[4];
    for (int m = 0; m < 4; m++) rows[m] = small.ptr<float>(j - 1 + m) + 4 * i;
    fourSum(between, rows, up.data() + 4 * phase, 4 * std::min((count - 1) / factor + 4, small.cols - i));
    enlargeLine(out, between + 4, pairs, factor, count);
}

inline void decimatedBlur(const cv::Mat& in, cv::Mat& out, const DecimatedBlur& blur) {
    // The output is written last, so its memory can hold the small image until then.
    cv::Mat small = decimate(in, blur.factor, blur.prefilter, out);
    Scratch memory(4 * small.total());
    cv::Mat blurred(small.size(), CV_32FC4, memory.data());
    separableFir(small, blurred, blur.small);
    std::vector<float> pairs = phasePairs(blur.factor, blur.up);
    cv::parallel_for_(
        cv::Range(0, in.rows),
        [&](const cv::Range& range) {
            Scratch between(4 * size_t(small.cols));
            for (int y = range.start; y < range.end; y++)
                enlargeRow(blurred, blur.factor, blur.up, pairs.data(), y, 0, in.cols, between.data(),
                           out.ptr<float>(y));
        },
        4 * cv::getNumThreads());
}

}  // namespace blur
