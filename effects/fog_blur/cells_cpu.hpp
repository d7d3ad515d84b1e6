// Which levels of fog_blur's ladder which part of the picture needs, on the CPU: work is done only there.
#pragma once

#include <algorithm>
#include <bit>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "common/blur_lines.hpp"
#include "fog_blur/ladder_design.hpp"
#include "fog_blur/sharp_cpu.hpp"

namespace fog_blur {

/// The numbers of DERIVED, one entry a level; see fog_blur.fs.
struct LadderLevel {
    float sigma = 0;
    int factor = 1;
    std::span<const float> taps, prefilter, up;
};
struct Ladder {
    std::vector<LadderLevel> levels;
    std::span<const float> nodeWeights;
    float largest = 0;
    bool keepEdges = true;
    Spacing spacing = spacingOf(1);
};

/// Pixels of a cell, the part of the picture that is decided on together: decimateAll takes its rows together
/// and a tile of the output is as wide.
constexpr int cellWidth = 128, cellHeight = blur::blockRows;

// Between which levels pixels lie: the first of four, where in nodeWeights to look, and how far on to the
// next entry.
struct Places {
    int first[cellWidth], entry[cellWidth];
    float share[cellWidth];
};
BRUME_VECTORISE static void placesOf(Places& places, const Spacing& s, float largest, int levelCount,
                                     const float* sigmas, int count) {
    const int lastInterval = levelCount - 1, lastFirst = std::max(0, levelCount - 3);
    const int rungBits = std::countr_zero(unsigned(s.rungs)), noBits = 127 << rungBits;
    const float octaves = float(1 << (lastInterval / s.rungs - 1)), scale = float(s.top) * octaves,
                inverse = 1.0f / octaves, from = float(lastFrom(s)),
                perLast = float(1 / (s.top - lastFrom(s)));
    for (int i = 0; i < count; i++) {
        const float strength = sigmas[i] > 0.0f ? sigmas[i] / largest : 0.0f, x = strength * strength * scale;
        const int bits = std::bit_cast<int>(x),
                  after = (bits >> (23 - rungBits)) - noBits + 1;  // the interval
        const float within = std::bit_cast<float>(((bits << rungBits) & 0x007fffff) | 0x3f800000) - 1.0f,
                    last = std::min((x * inverse - from) * perLast, 1.0f);
        const int interval = x >= 1.0f ? std::min(after, lastInterval) : 0;
        const float place = x >= 1.0f ? (after >= lastInterval ? last : within) : x, sampled = place * 16.0f;
        const int below = int(sampled);
        places.first[i] = std::min(std::max(interval - 1, 0), lastFirst);
        places.entry[i] = samplesPerInterval * interval + below;
        places.share[i] = sampled - float(below);
    }
}

/// Of a cell's standard deviations: the least, the least above 0, and the largest.
struct Extremes {
    float least = HUGE_VALF, leastBlurred = HUGE_VALF, most = 0;
    bool isEven() const { return least == most; }
};
BRUME_VECTORISE static void extend(Extremes& extremes, const float* sigmas, int count) {
    // They compare as their bits do.
    constexpr int infinite = 0x7f800000;
    int least = infinite, leastBlurred = infinite, most = 0;
    for (int i = 0; i < count; i++) {
        const int bits = std::bit_cast<int>(sigmas[i]);
        most = std::max(most, bits);
        least = std::min(least, bits);
        leastBlurred = std::min(leastBlurred, bits > 0 ? bits : infinite);
    }
    extremes.least = std::min(extremes.least, std::bit_cast<float>(least));
    extremes.leastBlurred = std::min(extremes.leastBlurred, std::bit_cast<float>(leastBlurred));
    extremes.most = std::max(extremes.most, std::bit_cast<float>(most));
}

/// The lowest and the highest level that a cell's pixels lie between, of those after the sharp picture; none:
/// high < low. One, where every pixel is at that level.
struct Nodes {
    int low = 1, high = 0;
    bool has(int node) const { return low <= node && node <= high; }
};
inline Nodes nodesOf(const Extremes& extremes, const Spacing& s, float largest, int levelCount) {
    if (extremes.most == 0) return {};
    const float sigmas[2] = {extremes.leastBlurred, extremes.most};
    Places places;
    placesOf(places, s, largest, levelCount, sigmas, 2);
    // At a level itself no other has a weight, and pixels below it lie in the interval before.
    int interval = places.entry[1] / samplesPerInterval, sample = places.entry[1] % samplesPerInterval;
    if (places.share[1] == 0.0f && sample == 0 && interval > 0) interval--, sample = samplesPerInterval - 1;
    if (places.share[1] == 0.0f && sample == samplesPerInterval - 1 && sigmas[0] == sigmas[1])
        return {interval + 1, interval + 1};
    return {std::max(places.first[0], 1), std::min(firstNode(interval, levelCount) + 3, levelCount)};
}

/// The picture's cells, row by row.
struct Cells {
    int columns = 0, rows = 0;
    std::vector<Extremes> extremes;
    std::vector<Nodes> nodes;
    size_t at(int column, int row) const { return size_t(row) * columns + column; }
};

/// `sigmaOf(y, x, count, row)` fills a stretch of the source's standard deviations first.
template <class SigmaOf>
Cells findCells(Source& source, const Ladder& ladder, SigmaOf sigmaOf) {
    const int width = source.sigma.cols, height = source.sigma.rows, levelCount = int(ladder.levels.size());
    Cells cells;
    cells.columns = (width + cellWidth - 1) / cellWidth;
    cells.rows = (height + cellHeight - 1) / cellHeight;
    cells.extremes.resize(size_t(cells.columns) * cells.rows);
    cells.nodes.resize(cells.extremes.size());
    cv::parallel_for_(
        cv::Range(0, cells.rows),
        [&](const cv::Range& range) {
            for (int row = range.start; row < range.end; row++) {
                for (int y = cellHeight * row; y < std::min(cellHeight * (row + 1), height); y++)
                    for (int column = 0; column < cells.columns; column++) {
                        const int x = cellWidth * column, count = std::min(cellWidth, width - x);
                        float* sigma = source.sigma.ptr<float>(y) + x;
                        sigmaOf(y, x, count, sigma);
                        extend(cells.extremes[cells.at(column, row)], sigma, count);
                    }
                for (size_t n = cells.at(0, row); n < cells.at(0, row + 1); n++)
                    cells.nodes[n] = nodesOf(cells.extremes[n], ladder.spacing, ladder.largest, levelCount);
            }
        },
        4 * cv::getNumThreads());
    return cells;
}

/// A mark for each cell that lies at most so many columns and rows beside a marked one.
inline std::vector<char> grown(const std::vector<char>& marks, const Cells& cells, int columns, int rows) {
    std::vector<char> wide(marks.size()), whole(marks.size());
    auto grow = [](auto at, auto to, int length, int distance) {
        for (int i = 0, since = distance; i < length; i++) {
            since = at(i) ? 0 : since + 1;
            to(i) = since <= distance;
        }
        for (int i = length - 1, since = distance; i >= 0; i--) {
            since = at(i) ? 0 : since + 1;
            to(i) |= since <= distance;
        }
    };
    for (int row = 0; row < cells.rows; row++)
        grow([&](int i) { return marks[cells.at(i, row)]; },
             [&](int i) -> char& { return wide[cells.at(i, row)]; }, cells.columns, columns);
    for (int column = 0; column < cells.columns; column++)
        grow([&](int i) { return wide[cells.at(column, i)]; },
             [&](int i) -> char& { return whole[cells.at(column, i)]; }, cells.rows, rows);
    return whole;
}

}  // namespace fog_blur
