// fog_blur's ladder on the CPU; twin of the ladder in fog_blur.fs. Levels decimated by more than one are made
// first, as small images; the others live only as the few rows that a tile of the output needs.
#pragma once

#include <bit>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "common/decimated.hpp"

namespace fog_blur {

using blur::One;

/// The numbers of DERIVED, one entry a level; see fog_blur.fs.
struct LadderLevel {
    float sigma = 0;
    int factor = 1;
    std::span<const float> taps, prefilter, up;
};
struct Ladder {
    std::vector<LadderLevel> levels;
    std::span<const float> nodeWeights;
    float firstVariance = 0;
    bool keepEdges = true;
};

/// The picture to blur, and each pixel's standard deviation, CV_32F px.
struct Source {
    cv::Mat color, sigma;
};

// Finite colour, and a weight of 1.
BRUME_VECTORISE static void sharpen(float* out, const float* color, int count) {
    blur::copyFinite(out, color, 4 * count);
    for (int i = 0; i < count; i++) out[4 * i + 3] = 1.0f;
}

// What a blur of `sigma` takes of sharp pixels: colour times weight, and the weight.
BRUME_VECTORISE static void weigh(float* out, const float* sharp, const float* sigmas, float sigma,
                                  int count) {
    const float inverse = 1.0f / sigma;
    for (int i = 0; i < count; i++) {
        float weight = std::min(sigmas[i] * inverse, 1.0f);
        *(One*)(out + 4 * i) = *(const One*)(sharp + 4 * i) * weight;
    }
}

// A row's sharp pixels and their standard deviations from column `first` on, beyond the edges replicated.
inline void sharpReplicated(float* sharp, float* sigmas, const Source& source, int y, int first, int count) {
    const float *color = source.color.ptr<float>(y), *sigma = source.sigma.ptr<float>(y);
    const int width = source.color.cols;
    int inside0 = std::clamp(first, 0, width), inside1 = std::clamp(first + count, inside0, width);
    // The next row is asked for while this one is worked on.
    const float* next = source.color.ptr<float>(std::min(y + 1, source.color.rows - 1));
    for (int x = inside0, step; x < inside1; x += step) {
        step = std::min(64, inside1 - x);
        for (int k = 0; k < step; k += 4) __builtin_prefetch(next + 4 * (x + k));
        sharpen(sharp + 4 * (x - first), color + 4 * x, step);
    }
    std::copy(sigma + inside0, sigma + inside1, sigmas + (inside0 - first));
    float left[4], right[4];
    sharpen(left, color, 1);
    sharpen(right, color + 4 * (width - 1), 1);
    for (int i = 0; i < std::min(count, -first); i++)
        std::memcpy(sharp + 4 * i, left, sizeof left), sigmas[i] = sigma[0];
    for (int i = std::max(0, width - first); i < count; i++)
        std::memcpy(sharp + 4 * i, right, sizeof right), sigmas[i] = sigma[width - 1];
}

// `memory` has room for the small image.
inline cv::Mat smallLevel(const Source& source, const LadderLevel& level, bool keepEdges,
                          const cv::Mat& scratch, float* memory) {
    const int width = source.color.cols;
    auto rowOf = [&](int y, float* row) {
        blur::Scratch sigmas(width);
        sharpReplicated(row, sigmas.data(), source, y, 0, width);
        if (keepEdges) weigh(row, row, sigmas.data(), level.sigma, width);
        return row;
    };
    cv::Mat small =
        blur::decimateRows(width, source.color.rows, level.factor, level.prefilter, scratch, rowOf);
    cv::Mat blurred(small.size(), CV_32FC4, memory);
    blur::separableFir(small, blurred, level.taps);
    return blurred;
}

// Which four levels a variance lies between, and their weights.
struct Place {
    int first;
    One weights;
};
BRUME_INLINE Place placeOf(const Ladder& ladder, float sigma) {
    const int count = int(ladder.levels.size());
    float x = sigma * sigma / ladder.firstVariance, place = x;
    int interval = 0;
    if (x >= 1.0f) {
        int bits = std::bit_cast<int>(x), octave = (bits >> 23) - 126;
        interval = std::min(octave, count - 2);
        place = octave > count - 2 ? 1.0f : std::bit_cast<float>((bits & 0x007fffff) | 0x3f800000) - 1.0f;
    }
    float sampled = place * 16.0f;
    int below = std::min(int(sampled), 15);
    const One* table = (const One*)ladder.nodeWeights.data() + 17 * interval + below;
    return {std::clamp(interval - 1, 0, std::max(0, count - 3)),
            table[0] + (sampled - float(below)) * (table[1] - table[0])};
}

// Divides by the weight; where hardly any is left, the pixel itself makes up for it.
BRUME_VECTORISE static void interpolate(const Ladder& ladder, const float* const* nodes, const float* sigmas,
                                        float* out, int count) {
    const int nodeCount = int(ladder.levels.size());
    for (int i = 0; i < count; i++) {
        One self = *(const One*)(nodes[0] + 4 * i), result = self;
        if (sigmas[i] > 0.0f) {
            Place place = placeOf(ladder, sigmas[i]);
            One sum = {};
            for (int k = 0; k < 4 && place.first + k <= nodeCount; k++)
                sum += place.weights[k] * *(const One*)(nodes[place.first + k] + 4 * i);
            result = sum;
            if (ladder.keepEdges) {
                float weight = std::max(sum[3], 0.05f);
                result = (sum + (weight - sum[3]) * self) * (1.0f / weight);
            }
        }
        *(One*)(out + 4 * i) = result;
    }
}

// Rows of a tile that are made together.
constexpr int madeRows = blur::acrossRows;

// The rows round those being made, `margin` pixels wider than the tile on each side.
class SharpRows {
  public:
    SharpRows(const Source& source, int tile, int margin)
        : source_(source),
          margin_(margin),
          wide_(tile + 2 * margin),
          lines_(2 * margin + madeRows),
          colors_(size_t(lines_) * 4 * wide_),
          sigmas_(size_t(lines_) * wide_) {}
    void begin(int y0, int x0, int count) { done_ = std::max(0, y0 - margin_), x0_ = x0, count_ = count; }
    void advance(int y) {
        for (; done_ <= std::min(y + madeRows - 1 + margin_, source_.color.rows - 1); done_++)
            sharpReplicated(slot(colors_, 4, done_), slot(sigmas_, 1, done_), source_, done_, x0_ - margin_,
                            count_ + 2 * margin_);
    }
    // From `before` pixels left of the tile on; before <= margin.
    const float* color(int y, int before) { return slot(colors_, 4, y) + 4 * (margin_ - before); }
    const float* sigma(int y, int before) { return slot(sigmas_, 1, y) + (margin_ - before); }

  private:
    float* slot(const blur::Scratch& rows, int channels, int y) {
        return rows.data() + size_t(y % lines_) * channels * wide_;
    }
    const Source& source_;
    int margin_, wide_, lines_, done_ = 0, x0_ = 0, count_ = 0;
    blur::Scratch colors_, sigmas_;
};

// One level's rows of a tile: horizontally filtered ones in a ring, the finished ones in `made`.
class TileLevel {
  public:
    TileLevel(const LadderLevel& level, int tile, const cv::Mat& small)
        : level_(&level),
          small_(small),
          tile_(tile),
          wide_(int(blur::roomEnlarged(level.factor, tile + level.factor)) / 4),
          taps_(level.factor > 1 ? std::vector<float>{1} : blur::wholeTaps(level.taps)),
          reach_(int(taps_.size()) / 2),
          lines_(2 * reach_ + madeRows),
          made_(4 * size_t(madeRows) * wide_),
          ring_(size_t(lines_) * 4 * tile),
          between_(
              std::max(4 * size_t(tile + 2 * reach_), blur::roomBetween(level.factor, tile + level.factor))),
          rows_(lines_) {
        if (level.factor > 1) groups_ = blur::phaseGroups(level.factor, level.up);
    }
    int margin() const { return reach_; }
    void begin(int y0, int x0, int count) { done_ = std::max(0, y0 - reach_), x0_ = x0, count_ = count; }
    // Makes rows y to y + rowCount - 1 of a picture `height` px high; row(k) then points at pixel x0 of one.
    void make(SharpRows& sharp, bool keepEdges, int y, int rowCount, int height) {
        if (level_->factor > 1) {
            int from = x0_ / level_->factor * level_->factor;
            before_ = x0_ - from;
            for (int k = 0; k < rowCount; k++)
                blur::enlargeRow(small_, level_->factor, level_->up, groups_.data(), y + k, from,
                                 count_ + before_, between_.data(), made(k));
            return;
        }
        const int taps = int(taps_.size());
        for (; done_ <= std::min(y + rowCount - 1 + reach_, height - 1); done_++) {
            const float* line = sharp.color(done_, reach_);
            if (keepEdges) {
                weigh(between_.data(), line, sharp.sigma(done_, reach_), level_->sigma, count_ + 2 * reach_);
                line = between_.data();
            }
            blur::firAlong(slot(done_), line, taps_.data(), taps, count_, line);
        }
        for (int u = 0; u < lines_; u++) rows_[u] = slot(std::clamp(y - reach_ + u, 0, height - 1));
        float* to[madeRows];
        for (int k = 0; k < rowCount; k++) to[k] = made(k);
        blur::firAcross(to, rowCount, rows_.data(), taps_.data(), taps, 4 * count_);
    }
    const float* row(int k) const { return made(k) + 4 * before_; }

  private:
    float* slot(int y) const { return ring_.data() + size_t(y % lines_) * 4 * tile_; }
    float* made(int k) const { return made_.data() + size_t(k) * 4 * wide_; }

    const LadderLevel* level_;
    cv::Mat small_;
    int tile_, wide_;
    std::vector<float> taps_;
    int reach_, lines_, done_ = 0, x0_ = 0, count_ = 0, before_ = 0;
    blur::Scratch made_, ring_, between_;
    std::vector<float> groups_;
    std::vector<const float*> rows_;
};

// The lowest and the highest node that pixels of these standard deviations are interpolated from; none: high
// < low.
struct NodeRange {
    int low = 1, high = 0;
};
// Of standard deviations, which compare as their bits do: the least above 0, and the largest.
BRUME_VECTORISE static void extremes(const float* sigmas, int count, int& least, int& most) {
    int low = least, high = most;
    for (int i = 0; i < count; i++) {
        int bits = std::bit_cast<int>(sigmas[i]);
        high = std::max(high, bits);
        low = std::min(low, bits > 0 ? bits : 0x7f800000);
    }
    least = low, most = high;
}
inline NodeRange nodesOf(const Ladder& ladder, const cv::Mat& sigmas) {
    int least = 0x7f800000, most = 0;
    for (int y = 0; y < sigmas.rows; y++) extremes(sigmas.ptr<float>(y), sigmas.cols, least, most);
    if (most == 0) return {};
    return {placeOf(ladder, std::bit_cast<float>(least)).first,
            placeOf(ladder, std::bit_cast<float>(most)).first + 3};
}

/// The blurred picture; its fourth channel means nothing until `finish(y, x0, count)` has seen that stretch
/// of `out`.
template <class Finish>
void ladderBlur(const Source& source, const Ladder& ladder, cv::Mat& out, Finish finish) {
    const int width = out.cols, height = out.rows, levelCount = int(ladder.levels.size());
    std::vector<cv::Mat> small(levelCount);
    std::vector<blur::Scratch> memory;
    for (int l = 0; l < levelCount; l++)
        if (int factor = ladder.levels[l].factor; factor > 1) {
            memory.emplace_back(4 * size_t(blur::smallLength(width, factor)) *
                                blur::smallLength(height, factor));
            small[l] = smallLevel(source, ladder.levels[l], ladder.keepEdges, out, memory.back().data());
        }

    const int tile = 320, bands = std::clamp(height / 48, 1, 4 * cv::getNumThreads());
    cv::parallel_for_(cv::Range(0, bands), [&](const cv::Range& range) {
        std::vector<TileLevel> levels;
        int margin = 0;
        for (int l = 0; l < levelCount; l++) {
            levels.emplace_back(ladder.levels[l], tile, small[l]);
            margin = std::max(margin, levels.back().margin());
        }
        SharpRows sharp(source, tile, margin);
        std::vector<const float*> nodes(levelCount + 1);
        for (int band = range.start; band < range.end; band++) {
            int y0 = int(int64_t(height) * band / bands), y1 = int(int64_t(height) * (band + 1) / bands);
            for (int x0 = 0; x0 < width; x0 += tile) {
                int count = std::min(tile, width - x0);
                // Only the levels that this tile's pixels lie between are made.
                NodeRange needed = nodesOf(ladder, source.sigma(cv::Rect(x0, y0, count, y1 - y0)));
                const int first = std::max(needed.low, 1), last = std::min(needed.high, levelCount);
                sharp.begin(y0, x0, count);
                for (int node = first; node <= last; node++) levels[node - 1].begin(y0, x0, count);
                for (int y = y0; y < y1; y += madeRows) {
                    const int rowCount = std::min(madeRows, y1 - y);
                    sharp.advance(y);
                    for (int node = first; node <= last; node++)
                        levels[node - 1].make(sharp, ladder.keepEdges, y, rowCount, height);
                    for (int k = 0; k < rowCount; k++) {
                        nodes[0] = sharp.color(y + k, 0);
                        for (int node = first; node <= last; node++) nodes[node] = levels[node - 1].row(k);
                        interpolate(ladder, nodes.data(), sharp.sigma(y + k, 0),
                                    out.ptr<float>(y + k) + 4 * x0, count);
                        finish(y + k, x0, count);
                    }
                }
            }
        }
    });
}

}  // namespace fog_blur
