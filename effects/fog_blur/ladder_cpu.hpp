// fog_blur's ladder on the CPU; twin of the ladder in fog_blur.fs. Levels decimated by more than one are
// small images by now; the others live only as the few rows that a tile of the output needs, and only where
// some pixel of it lies between them.
#pragma once

#include <bit>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "common/stream.hpp"
#include "fog_blur/small_cpu.hpp"

namespace fog_blur {

struct Ladder {
    std::vector<LadderLevel> levels;
    std::span<const float> nodeWeights;
    float firstVariance = 0;
    bool keepEdges = true;
};

/// Pixels across a tile, and rows of it that are made together.
constexpr int tileWidth = 128, madeRows = blur::acrossRows;

// Between which levels pixels lie: the first of four, where in nodeWeights to look, and how far on to the
// next entry.
struct Places {
    int first[tileWidth], entry[tileWidth];
    float share[tileWidth];
};
BRUME_VECTORISE static void placesOf(Places& places, float firstVariance, int levelCount, const float* sigmas,
                                     int count) {
    const int lastInterval = levelCount - 2, lastFirst = std::max(0, levelCount - 3);
    for (int i = 0; i < count; i++) {
        const float x = sigmas[i] * sigmas[i] / firstVariance;
        const int bits = std::bit_cast<int>(x), octave = (bits >> 23) - 126;
        const float within = std::bit_cast<float>((bits & 0x007fffff) | 0x3f800000) - 1.0f;
        const int interval = x >= 1.0f ? std::min(octave, lastInterval) : 0;
        const float place = x >= 1.0f ? (octave > lastInterval ? 1.0f : within) : x, sampled = place * 16.0f;
        const int below = std::min(int(sampled), 15);
        places.first[i] = std::min(std::max(interval - 1, 0), lastFirst);
        places.entry[i] = 17 * interval + below;
        places.share[i] = sampled - float(below);
    }
}

// The weighted sum of four nodes for each pixel; nodes[0] is the sharp picture.
BRUME_VECTORISE static void mix(float* out, const Places& places, const float* nodeWeights,
                                const float* const* nodes, int count) {
    for (int i = 0; i < count; i++) {
        const One* entry = (const One*)nodeWeights + places.entry[i];
        const One weights = entry[0] + places.share[i] * (entry[1] - entry[0]);
        const float* const* node = nodes + places.first[i];
        auto at = [&](int k) { return *(const One*)(node[k] + 4 * i); };
        *(One*)(out + 4 * i) =
            ((weights[0] * at(0) + weights[1] * at(1)) + weights[2] * at(2)) + weights[3] * at(3);
    }
}

// Divides by the weight; where hardly any is left, the pixel itself makes up for it.
BRUME_VECTORISE static void divide(float* out, const float* sharp, int count) {
    float sums[tileWidth], inverse[tileWidth + spreadMargin], missing[tileWidth + spreadMargin];
    for (int i = 0; i < count; i++) sums[i] = out[4 * i + 3];
    for (int i = 0; i < count; i++) {
        const float weight = std::max(sums[i], 0.05f);
        inverse[i] = 1.0f / weight;
        missing[i] = weight - sums[i];
    }
    int i = 0;
    for (; i + 4 <= count; i += 4) {
        const Four self = *(const Four*)(sharp + 4 * i), sum = *(const Four*)(out + 4 * i);
        *(Four*)(out + 4 * i) = (sum + spread(missing + i) * self) * spread(inverse + i);
    }
    for (; i < count; i++) {
        const One self = *(const One*)(sharp + 4 * i), sum = *(const One*)(out + 4 * i);
        *(One*)(out + 4 * i) = (sum + missing[i] * self) * inverse[i];
    }
}

// Of standard deviations, which compare as their bits do: the least above 0, and the largest.
struct Extremes {
    int least = 0x7f800000, most = 0;
};
BRUME_VECTORISE static void extend(Extremes& extremes, const float* sigmas, int count) {
    int least = extremes.least, most = extremes.most;
    for (int i = 0; i < count; i++) {
        const int bits = std::bit_cast<int>(sigmas[i]);
        most = std::max(most, bits);
        least = std::min(least, bits > 0 ? bits : 0x7f800000);
    }
    extremes = {least, most};
}
/// The lowest and the highest level that such pixels lie between, of those after the sharp picture; none:
/// high < low.
struct Nodes {
    int low = 1, high = 0;
};
inline Nodes nodesOf(const Extremes& extremes, float firstVariance, int levelCount) {
    if (extremes.most == 0) return {};
    const float sigmas[2] = {std::bit_cast<float>(extremes.least), std::bit_cast<float>(extremes.most)};
    Places places;
    placesOf(places, firstVariance, levelCount, sigmas, 2);
    return {std::max(places.first[0], 1), std::min(places.first[1] + 3, levelCount)};
}

// The rows round those being made, `margin` pixels wider than the tile on each side.
class SharpRows {
  public:
    SharpRows(const Source& source, int margin)
        : source_(source),
          margin_(margin),
          wide_(tileWidth + 2 * margin),
          lines_(2 * margin + madeRows),
          colors_(size_t(lines_) * 4 * wide_),
          sigmas_(size_t(lines_) * wide_ + 3) {}
    void begin(int y0, int x0, int count) { done_ = std::max(0, y0 - margin_), x0_ = x0, count_ = count; }
    void advance(int y) {
        for (; done_ <= std::min(y + madeRows - 1 + margin_, source_.color.rows - 1); done_++)
            sharpReplicated(slot(colors_, 4, done_), slot(sigmas_, 1, done_), source_, done_, x0_ - margin_,
                            count_ + 2 * margin_, madeRows);
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
    TileLevel(const LadderLevel& level, const cv::Mat& small)
        : level_(&level),
          small_(small),
          wide_(int(blur::roomEnlarged(level.factor, tileWidth + level.factor)) / 4),
          taps_(level.factor > 1 ? std::vector<float>{1} : blur::wholeTaps(level.taps)),
          reach_(int(taps_.size()) / 2),
          lines_(2 * reach_ + madeRows),
          made_(4 * size_t(madeRows) * wide_),
          ring_(size_t(lines_) * 4 * tileWidth),
          between_(std::max(4 * size_t(tileWidth + 2 * reach_),
                            blur::roomBetween(level.factor, tileWidth + level.factor))),
          rows_(lines_) {
        if (level.factor > 1) groups_ = blur::phaseGroups(level.factor, level.up);
    }
    int margin() const { return reach_; }
    void begin(int x0, int count) { done_ = 0, x0_ = x0, count_ = count; }
    // Makes rows y to y + rowCount - 1 of a picture `height` px high; row(k) then points at pixel x0 of one.
    // y rises, and may leave rows out.
    void make(SharpRows& sharp, bool keepEdges, int y, int rowCount, int height) {
        if (level_->factor > 1) {
            int from = x0_ / level_->factor * level_->factor;
            before_ = x0_ - from;
            askForRows(y + rowCount + 2 * level_->factor, from);
            for (int k = 0; k < rowCount; k++)
                blur::enlargeRow(small_, level_->factor, level_->up, groups_.data(), y + k, from,
                                 count_ + before_, between_.data(), made(k));
            return;
        }
        const int taps = int(taps_.size());
        done_ = std::max(done_, y - reach_);
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
    // The small rows that rows y to y + madeRows - 1 take first.
    void askForRows(int y, int from) const {
        const int factor = level_->factor, x = from / factor + blur::smallMargin - 2;
        for (int j = (y + factor - 1) / factor; j * factor < y + madeRows; j++) {
            if (j + blur::smallMargin + 1 >= small_.rows) break;
            const float* row = small_.ptr<float>(j + blur::smallMargin + 1) + 4 * x;
            for (int i = 0; i < 4 * (count_ / factor + 6); i += 16) __builtin_prefetch(row + i);
        }
    }
    float* slot(int y) const { return ring_.data() + size_t(y % lines_) * 4 * tileWidth; }
    float* made(int k) const { return made_.data() + size_t(k) * 4 * wide_; }

    const LadderLevel* level_;
    cv::Mat small_;
    int wide_;
    std::vector<float> taps_;
    int reach_, lines_, done_ = 0, x0_ = 0, count_ = 0, before_ = 0;
    blur::Scratch made_, ring_, between_;
    std::vector<float> groups_;
    std::vector<const float*> rows_;
};

// One tile's output, madeRows at a time.
class Tile {
  public:
    Tile(const Source& source, const Ladder& ladder, std::span<const cv::Mat> small)
        : ladder_(ladder), sharp_(source, marginOf(ladder)), mixed_(4 * size_t(tileWidth)) {
        for (size_t l = 0; l < ladder.levels.size(); l++) levels_.emplace_back(ladder.levels[l], small[l]);
        nodes_.resize(levels_.size() + 2);
    }
    void begin(int y0, int x0, int count) {
        count_ = count;
        sharp_.begin(y0, x0, count);
        for (TileLevel& level : levels_) level.begin(x0, count);
    }
    /// Calls put(k, row) with each blurred row y + k.
    template <class Put>
    void make(int y, int rowCount, int height, Put put) {
        const int levelCount = int(levels_.size());
        sharp_.advance(y);
        Extremes extremes;
        for (int k = 0; k < rowCount; k++) extend(extremes, sharp_.sigma(y + k, 0), count_);
        const Nodes needed = nodesOf(extremes, ladder_.firstVariance, levelCount);
        for (int node = needed.low; node <= needed.high; node++)
            levels_[node - 1].make(sharp_, ladder_.keepEdges, y, rowCount, height);
        for (int k = 0; k < rowCount; k++) {
            float* row = mixed_.data();
            const float* self = sharp_.color(y + k, 0);
            if (needed.high < needed.low) {
                std::copy_n(self, 4 * count_, row);
            } else {
                // The sharp row in place of nodes that no pixel needs.
                for (const float*& node : nodes_) node = self;
                for (int node = needed.low; node <= needed.high; node++)
                    nodes_[node] = levels_[node - 1].row(k);
                placesOf(places_, ladder_.firstVariance, levelCount, sharp_.sigma(y + k, 0), count_);
                mix(row, places_, ladder_.nodeWeights.data(), nodes_.data(), count_);
                if (ladder_.keepEdges) divide(row, self, count_);
            }
            put(k, row);
        }
    }

  private:
    static int marginOf(const Ladder& ladder) {
        int margin = 0;
        for (const LadderLevel& level : ladder.levels)
            if (level.factor == 1) margin = std::max(margin, int(level.taps.size()) - 1);
        return margin;
    }
    const Ladder& ladder_;
    int count_ = 0;
    SharpRows sharp_;
    std::vector<TileLevel> levels_;
    std::vector<const float*> nodes_;
    blur::Scratch mixed_;
    Places places_;
};

/// By level, the rows that have pixels between it and its neighbours. `sigmaOf(y, row)` fills a row of the
/// source's standard deviations first.
template <class SigmaOf>
std::vector<RowRange> findNeeded(Source& source, const Ladder& ladder, SigmaOf sigmaOf) {
    const int width = source.sigma.cols, height = source.sigma.rows, levelCount = int(ladder.levels.size());
    std::vector<Nodes> nodes(height);
    cv::parallel_for_(
        cv::Range(0, height),
        [&](const cv::Range& range) {
            for (int y = range.start; y < range.end; y++) {
                float* sigma = source.sigma.ptr<float>(y);
                Extremes extremes;
                sigmaOf(y, sigma);
                extend(extremes, sigma, width);
                nodes[y] = nodesOf(extremes, ladder.firstVariance, levelCount);
            }
        },
        4 * cv::getNumThreads());
    std::vector<RowRange> needed(levelCount);
    for (int y = 0; y < height; y++)
        for (int node = nodes[y].low; node <= nodes[y].high; node++) {
            RowRange& rows = needed[node - 1];
            if (rows.end == 0) rows.first = y;
            rows.end = y + 1;
        }
    return needed;
}

/// The blurred picture; `finish(y, x0, count, row)` sees each stretch of it before it is written, the fourth
/// channel meaning nothing until then.
template <class Finish>
void ladderBlur(const Source& source, const Ladder& ladder, std::span<const cv::Mat> small, cv::Mat& out,
                bool streams, Finish finish) {
    const int width = out.cols, height = out.rows;
    const int tiles = (width + tileWidth - 1) / tileWidth, bands = std::clamp(height / 270, 1, 8);
    cv::parallel_for_(
        cv::Range(0, bands * tiles),
        [&](const cv::Range& range) {
            Tile tile(source, ladder, small);
            for (int n = range.start; n < range.end; n++) {
                const int y0 = int(int64_t(height) * (n / tiles) / bands),
                          y1 = int(int64_t(height) * (n / tiles + 1) / bands), x0 = n % tiles * tileWidth,
                          count = std::min(tileWidth, width - x0);
                tile.begin(y0, x0, count);
                for (int y = y0; y < y1; y += madeRows)
                    tile.make(y, std::min(madeRows, y1 - y), height, [&](int k, float* row) {
                        finish(y + k, x0, count, row);
                        brume::putRow(out.ptr<float>(y + k) + 4 * x0, row, 4 * size_t(count), streams);
                    });
            }
            if (streams) brume::streamEnd();
        },
        bands * tiles);
}

}  // namespace fog_blur
