// Separable FIR blurs of RGBA float images on the CPU. Edges replicate exactly.
// Twin of blur.glsl; both read the numbers of blur_design.hpp.
#pragma once

#include <algorithm>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "common/blur_lines.hpp"
#include "common/fir_lines.hpp"
#include "common/scratch.hpp"
#include "common/stream.hpp"

namespace blur {

/// Both sides of a half kernel.
inline std::vector<float> wholeTaps(std::span<const float> half) {
    std::vector<float> taps(half.rbegin(), half.rend());
    taps.insert(taps.end(), half.begin() + 1, half.end());
    return taps;
}

// Along rows, then along columns: for FIRs that reach so far that tiles of separableFir would be most of the
// image.
inline void longFir(const cv::Mat& in, cv::Mat& out, std::span<const float> half, bool streams) {
    const int reach = int(half.size()) - 1, width = in.cols, height = in.rows;
    // Upright tiles, one a task: no row is filtered twice. The filtered rows that four output rows need stay
    // in the L2 cache where they can.
    const int lines = 2 * reach + acrossRows, threads = cv::getNumThreads();
    const int widest = std::clamp(640 * 1024 / (16 * lines), 32, 960);
    const int tiles = std::min((width + 31) / 32, ((width - 1) / widest / threads + 1) * threads);
    const int tile = ((width - 1) / tiles / 32 + 1) * 32;
    const size_t stride = spacedStride(4 * tile);
    auto filterTiles = [&](const cv::Range& range) {
        Scratch padded(4 * size_t(tile + 2 * reach)), ring(size_t(lines) * stride);
        Scratch finished(streams ? size_t(acrossRows) * 4 * tile : 0);
        std::vector<const float*> rows(lines);
        auto slot = [&](int y) { return ring.data() + size_t(y % lines) * stride; };
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
                                     firAlong(to, line + 4 * reach, half.data(), reach, end - from);
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
                for (int k = 0; k < made; k++)
                    to[k] = streams ? finished.data() + size_t(k) * 4 * tile : out.ptr<float>(y + k) + 4 * x0;
                firAcross(to, made, rows.data() + reach, half.data(), reach, 4 * count);
                for (int k = 0; k < made && streams; k++)
                    brume::putRow(out.ptr<float>(y + k) + 4 * x0, to[k], 4 * size_t(count), true);
            }
        }
        if (streams) brume::streamEnd();
    };
    cv::parallel_for_(cv::Range(0, (width - 1) / tile + 1), filterTiles, tiles);
}

/// A symmetric FIR along columns and rows. `half` holds the centre tap and one side's. `in` and `out`
/// are CV_32FC4 of one size and do not overlap; `streams`: CpuContext::outputIsStreamed.
inline void separableFir(const cv::Mat& in, cv::Mat& out, std::span<const float> half, bool streams = false) {
    const int reach = int(half.size()) - 1, width = in.cols, height = in.rows;
    constexpr int farthest = 32;
    static_assert(farthest <= longestSum);
    if (reach > farthest) return longFir(in, out, half, streams);
    // Columns come first, of the image as it is: eight rows of theirs are then filtered along themselves,
    // while they are in the caches. Tiles are as wide as the rows that these take stay in the L2 cache, or
    // as what neighbours both make, `reach` beyond their edges, is little.
    const int lines = 2 * reach + acrossRows, threads = cv::getNumThreads();
    const int widest = std::max({384 * 1024 / (16 * lines), 16 * reach, 64});
    const int tile = ((width - 1) / ((width - 1) / widest + 1) / 32 + 1) * 32, tiles = (width - 1) / tile + 1;
    const int groups = (height - 1) / acrossRows + 1,
              parts = std::clamp(4 * threads / tiles, 1, std::max(1, height / (8 * reach + 8)));
    const bool isCopied = streams && !brume::canStreamLines(out);
    // What is read next is asked for while the last is written, where memory is not the bound by itself.
    // Where the first cache has no room for the same columns of all rows, as their distance has it, they are
    // brought to where it has.
    const bool asks = reach > 5, isBrought = 2 * reach > rowsCached(in.step[0]);
    auto filterTiles = [&](const cv::Range& range) {
        const size_t stride = spacedStride(4 * (tile + 2 * reach));
        Scratch ring(lines * stride), summed(acrossRows * stride), finished(isCopied ? 4 * size_t(tile) : 0);
        std::vector<const float*> rows(lines);
        for (int index = range.start; index < range.end; index++) {
            const int x0 = index / parts * tile, count = std::min(tile, width - x0), part = index % parts;
            const int from = std::max(x0 - reach, 0), end = std::min(x0 + count + reach, width),
                      before = from - (x0 - reach), behind = x0 + count + reach - end;
            const int floats = 4 * (end - from);
            auto rowAt = [&](int row) { return in.ptr<float>(std::clamp(row, 0, height - 1)) + 4 * from; };
            auto slot = [&](int row) { return ring.data() + size_t(row % lines) * stride; };
            const int begin = groups * part / parts;
            int done = std::max(acrossRows * begin - reach, 0);  // rows in the ring
            for (int group = begin; group < groups * (part + 1) / parts; group++) {
                const int y = acrossRows * group, made = std::min(acrossRows, height - y);
                for (; isBrought && done < std::min(y + acrossRows + reach, height); done++)
                    copyPixels(slot(done), rowAt(done), floats);
                for (int u = 0; u < lines; u++) {
                    const int row = y - reach + u;
                    rows[u] = isBrought ? slot(std::clamp(row, 0, height - 1)) : rowAt(row);
                }
                float* to[acrossRows];
                for (int k = 0; k < made; k++) to[k] = summed.data() + k * stride + 4 * before;
                if (!firAcross(to, made, rows.data() + reach, half.data(), reach, floats) && !isBrought) {
                    for (int u = 0; u < lines; u++) {
                        copyPixels(slot(u), rows[u], floats);
                        rows[u] = slot(u);
                    }
                    firAcross(to, made, rows.data() + reach, half.data(), reach, floats);
                }
                for (int k = 0; k < made; k++) {
                    float *const first = to[k] - 4 * before, *const last = to[k] + floats - 4;
                    for (int i = 0; i < before; i++) std::memcpy(first + 4 * i, to[k], 16);
                    for (int i = 1; i <= behind; i++) std::memcpy(last + 4 * i, last, 16);
                    float* const result = out.ptr<float>(y + k) + 4 * x0;
                    firAlongShort(isCopied ? finished.data() : result, first + 4 * reach,
                                  {half.data(), 0, reach}, count, streams && !isCopied,
                                  asks ? rowAt(y + acrossRows + reach + k) : nullptr);
                    if (isCopied) brume::putRow(result, finished.data(), 4 * size_t(count), true);
                }
            }
        }
        if (streams) brume::streamEnd();
    };
    cv::parallel_for_(cv::Range(0, tiles * parts), filterTiles, tiles * parts);
}

}  // namespace blur
