// fog_blur's decimated levels on the CPU, all made in one pass over the picture.
#pragma once

#include <span>
#include <vector>

#include "common/decimated.hpp"
#include "fog_blur/sharp_cpu.hpp"

namespace fog_blur {

/// The numbers of DERIVED, one entry a level; see fog_blur.fs.
struct LadderLevel {
    float sigma = 0;
    int factor = 1;
    std::span<const float> taps, prefilter, up;
};

/// Memory that small images of one picture take in turn.
class Room {
  public:
    cv::Mat take(cv::Size size) {
        memory_.emplace_back(4 * size_t(size.area()));
        return cv::Mat(size, CV_32FC4, memory_.back().data());
    }

  private:
    std::vector<blur::Scratch> memory_;
};

/// Rows of the picture; none: end <= first.
struct RowRange {
    int first = 0, end = 0;
};

// One decimated level in the making. The one above the largest blur weighs pixels as that does, but for a
// scale: they share a small image.
struct SmallLevel {
    const LadderLevel* level;
    blur::SmallImage image;
    int from = 0, end = 0;  // small rows that are made
};

// The small rows that rows `needed` are enlarged from, and what their FIR takes besides.
inline void chooseRows(SmallLevel& small, RowRange needed, int reach) {
    const int factor = small.level->factor;
    small.from = std::max(0, needed.first / factor + blur::smallMargin - 2 - reach);
    small.end = std::min(small.image.rows(), (needed.end - 1) / factor + blur::smallMargin + 4 + reach);
}

// Adds the picture to the small images, in one pass.
inline void decimateAll(const Source& source, std::span<SmallLevel> small, bool keepEdges) {
    using blur::blockRows;
    const int width = source.color.cols, height = source.color.rows;
    constexpr int stretch = 128;  // px of eight rows: sharp and weighed, they fit the first cache
    const int blocks = (height + blockRows - 1) / blockRows,
              bandCount = std::clamp(blocks / 8, 1, 4 * cv::getNumThreads());
    auto work = [&](const cv::Range& range) {
        blur::Scratch sharp(size_t(blockRows) * 4 * stretch), weighed(size_t(blockRows) * 4 * stretch);
        std::vector<std::vector<blur::BlockSum>> sums(small.size());
        for (int n = range.start; n < range.end; n++) {
            std::vector<blur::SmallImage::Band> bands;
            int from = blocks, to = 0;
            for (auto& s : small) {
                auto rowAt = [&](int block) {
                    return std::clamp(block < blocks ? s.image.rowAt(block * blockRows) : s.image.rows(),
                                      s.from, s.end);
                };
                bands.emplace_back(s.image, rowAt(blocks * n / bandCount),
                                   rowAt(blocks * (n + 1) / bandCount));
                if (bands.back().isDone()) continue;
                from = std::min(from, bands.back().firstBlock());
                to = std::max(to, bands.back().lastBlock() + 1);
            }
            for (int block = from; block < to; block++) {
                for (size_t l = 0; l < small.size(); l++) sums[l] = bands[l].sumsOf(block);
                for (int x = 0; x < width; x += stretch) {
                    const int count = std::min(stretch, width - x);
                    const float *sharpRows[blockRows], *weighedRows[blockRows], *sigmas[blockRows];
                    for (int k = 0; k < blockRows; k++) {
                        const int y = std::min(block * blockRows + k, height - 1);
                        const float* color = source.color.ptr<float>(y) + 4 * x;
                        for (int i = 0; i < 4 * stretch; i += 16) __builtin_prefetch(color + 4 * stretch + i);
                        float* row = sharp.data() + size_t(k) * 4 * stretch;
                        sharpen(row, color, count);
                        sharpRows[k] = row;
                        sigmas[k] = source.sigma.ptr<float>(y) + x;
                        weighedRows[k] = keepEdges ? weighed.data() + size_t(k) * 4 * stretch : row;
                    }
                    for (size_t l = 0; l < small.size(); l++) {
                        if (sums[l].empty()) continue;
                        for (int k = 0; k < blockRows && keepEdges; k++)
                            weigh(weighed.data() + size_t(k) * 4 * stretch, sharpRows[k], sigmas[k],
                                  small[l].level->sigma, count);
                        for (auto& sum : sums[l]) sum.sum += x == 0 ? 0 : 4 * stretch;
                        blur::addBlocks(sums[l].data(), int(sums[l].size()), weighedRows, 4 * count, false);
                    }
                }
                for (auto& band : bands) band.finish(block);
            }
        }
    };
    cv::parallel_for_(cv::Range(0, bandCount), work, bandCount);
}

/// The levels that are decimated by more than one, blurred; empty for the others, and without meaning in rows
/// that rows `needed` of the picture, one range a level, do not take. The last level weighs pixels as the one
/// before, of which none is beyond; its factor is the same.
inline std::vector<cv::Mat> smallLevels(const Source& source, std::span<const LadderLevel> levels,
                                        std::span<const RowRange> needed, bool keepEdges, Room& room) {
    const int width = source.color.cols, height = source.color.rows, last = int(levels.size()) - 1;
    auto isMade = [&](int l) { return levels[l].factor > 1 && needed[l].first < needed[l].end; };
    auto isTwin = [&](int l) { return l == last && l > 0 && levels[l - 1].factor > 1; };
    std::vector<SmallLevel> small;
    small.reserve(levels.size());
    std::vector<int> imageOf(levels.size(), -1);
    for (int l = 0; l <= last; l++) {
        if (!isMade(l)) continue;
        SmallLevel next{&levels[l], {width, height, levels[l].factor, levels[l].prefilter}};
        chooseRows(next, needed[l], int(levels[l].taps.size()) - 1);
        imageOf[l] = int(small.size());
        if (isTwin(l) && imageOf[l - 1] >= 0) {
            imageOf[l] = imageOf[l - 1];
            SmallLevel& own = small[imageOf[l]];
            own.from = std::min(own.from, next.from), own.end = std::max(own.end, next.end);
            continue;
        }
        if (isTwin(l)) next.level = &levels[l - 1];
        small.push_back(std::move(next));
    }
    for (SmallLevel& s : small)
        s.image.setMemory(room.take(blur::SmallImage::wholeSize(width, height, s.level->factor)));
    if (!small.empty()) decimateAll(source, small, keepEdges);

    std::vector<cv::Mat> blurred(levels.size());
    for (int l = 0; l <= last; l++) {
        if (!isMade(l)) continue;
        const SmallLevel& s = small[imageOf[l]];
        std::vector<float> taps(levels[l].taps.begin(), levels[l].taps.end());
        if (isTwin(l) && keepEdges)
            for (float& w : taps) w *= std::sqrt(levels[l - 1].sigma / levels[l].sigma);  // on either axis
        blurred[l] = room.take(s.image.image().size());
        cv::Mat rows = blurred[l].rowRange(s.from, s.end);
        blur::separableFir(s.image.image().rowRange(s.from, s.end), rows, taps);
    }
    return blurred;
}

}  // namespace fog_blur
