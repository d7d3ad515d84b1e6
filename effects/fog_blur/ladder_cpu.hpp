// fog_blur's ladder on the CPU; twin of the ladder in fog_blur.fs. Levels decimated by more than one are
// small images by now; the others live only as the few rows that a tile of the output needs, and only where
// some pixel of it lies between them.
#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "common/stream.hpp"
#include "fog_blur/small_cpu.hpp"

namespace fog_blur {

/// Pixels across a tile, and rows of it that are made together: a cell.
constexpr int tileWidth = cellWidth, madeRows = cellHeight;
static_assert(madeRows == blur::acrossRows);

// The weighted sum of four nodes for each pixel; nodes[0] is the sharp picture. Every pixel's four weights
// lie beside each other, as its four channels do.
template <class Pixels>
BRUME_INLINE typename Pixels::Vector sumOfNodes(typename Pixels::Vector weights, const float* const* node,
                                                int i) {
    typedef typename Pixels::Vector Vector;
    auto at = [&](int k) { return *(const Vector*)(node[k] + 4 * i); };
    auto weight = [&](auto k) {
        constexpr int n = k;
        if constexpr (sizeof(Vector) == sizeof(Four))
            return __builtin_shufflevector(weights, weights, n, n, n, n, 4 + n, 4 + n, 4 + n, 4 + n, 8 + n,
                                           8 + n, 8 + n, 8 + n, 12 + n, 12 + n, 12 + n, 12 + n);
        else
            return __builtin_shufflevector(weights, weights, n, n, n, n);
    };
    using std::integral_constant;
    return ((weight(integral_constant<int, 0>()) * at(0) + weight(integral_constant<int, 1>()) * at(1)) +
            weight(integral_constant<int, 2>()) * at(2)) +
           weight(integral_constant<int, 3>()) * at(3);
}
BRUME_VECTORISE static void mix(float* out, const Places& places, const float* nodeWeights,
                                const float* const* nodes, int count) {
    auto rowAt = [&](int i, int next) { return *(const One*)(nodeWeights + 4 * (places.entry[i] + next)); };
    auto fourRows = [&](int i, int next) {
        const blur::Two a = __builtin_shufflevector(rowAt(i, next), rowAt(i + 1, next), 0, 1, 2, 3, 4, 5, 6,
                                                    7),
                        b = __builtin_shufflevector(rowAt(i + 2, next), rowAt(i + 3, next), 0, 1, 2, 3, 4, 5,
                                                    6, 7);
        return (Four)__builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    };
    int i = 0;
    auto mixOne = [&](int at) {
        const One below = rowAt(at, 0), weights = below + places.share[at] * (rowAt(at, 1) - below);
        *(One*)(out + 4 * at) = sumOfNodes<blur::Ones>(weights, nodes + places.first[at], at);
    };
    for (; i + 4 <= count; i += 4) {
        const int first = places.first[i];
        if (places.first[i + 1] == first && places.first[i + 2] == first && places.first[i + 3] == first) {
            const Four below = fourRows(i, 0),
                       weights = below + spread(places.share + i) * (fourRows(i, 1) - below);
            *(Four*)(out + 4 * i) = sumOfNodes<blur::Fours>(weights, nodes + first, i);
        } else {
            for (int k = 0; k < 4; k++) mixOne(i + k);
        }
    }
    for (; i < count; i++) mixOne(i);
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
    void begin(int x0, int count) { from_ = done_ = 0, x0_ = x0, count_ = count; }
    // Makes rows y to y + madeRows - 1, with those that lie `around` above and below; y rises.
    void advance(int y, int around) {
        const int first = std::max(0, y - around);
        if (first < from_ || first > done_) from_ = done_ = first;
        for (; done_ <= std::min(y + madeRows - 1 + around, source_.color.rows - 1); done_++)
            sharpReplicated(slot(colors_, 4, done_), slot(sigmas_, 1, done_), source_, done_, x0_ - margin_,
                            count_ + 2 * margin_, madeRows);
        from_ = std::max(from_, done_ - lines_);
    }
    // From `before` pixels left of the tile on; before <= margin.
    const float* color(int y, int before) { return slot(colors_, 4, y) + 4 * (margin_ - before); }
    const float* sigma(int y, int before) { return slot(sigmas_, 1, y) + (margin_ - before); }

  private:
    float* slot(const blur::Scratch& rows, int channels, int y) {
        return rows.data() + size_t(y % lines_) * channels * wide_;
    }
    const Source& source_;
    int margin_, wide_, lines_, from_ = 0, done_ = 0, x0_ = 0, count_ = 0;
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
          made_(4 * size_t(level.factor > 1 ? 1 : madeRows) * wide_),
          ring_(size_t(lines_) * 4 * tileWidth),
          between_(std::max(4 * size_t(tileWidth + 2 * reach_),
                            blur::roomBetween(level.factor, tileWidth + level.factor))),
          rows_(lines_) {
        if (level.factor > 1) groups_ = blur::phaseGroups(level.factor, level.up);
    }
    int margin() const { return reach_; }
    void begin(int x0, int count) { done_ = 0, x0_ = x0, count_ = count; }
    bool isSmall() const { return level_->factor > 1; }
    // Prepares rows y to y + rowCount - 1 of a picture `height` px high. y rises, and may leave rows out.
    void make(SharpRows& sharp, bool keepEdges, int y, int rowCount, int height) {
        y_ = y;
        if (isSmall()) return askForRows(y + rowCount + 2 * level_->factor);
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
    // Row y + k from pixel x0 on, until the next call.
    const float* row(int k) {
        if (!isSmall()) return made(k);
        const int from = x0_ / level_->factor * level_->factor, before = x0_ - from;
        blur::enlargeRow(small_, level_->factor, level_->up, groups_.data(), y_ + k, from, count_ + before,
                         between_.data(), made(0));
        return made(0) + 4 * before;
    }

  private:
    // The small rows that rows y to y + madeRows - 1 take first.
    void askForRows(int y) const {
        const int factor = level_->factor, x = x0_ / factor + blur::smallMargin - 2;
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
    int reach_, lines_, done_ = 0, x0_ = 0, y_ = 0, count_ = 0;
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
    void begin(int x0, int count) {
        count_ = count;
        sharp_.begin(x0, count);
        for (TileLevel& level : levels_) level.begin(x0, count);
    }
    /// Calls put(k, row) with each blurred row y + k.
    template <class Put>
    void make(int y, int rowCount, int height, const Nodes& needed, const Extremes& extremes, Put put) {
        const int levelCount = int(levels_.size());
        const bool isSharp = needed.high < needed.low,
                   isLevel = needed.low == needed.high && extremes.isEven();
        int around = 0;
        for (int node = needed.low; node <= needed.high; node++)
            around = std::max(around, levels_[node - 1].margin());
        sharp_.advance(y, around);
        for (int node = needed.low; node <= needed.high; node++)
            levels_[node - 1].make(sharp_, ladder_.keepEdges, y, rowCount, height);
        for (int k = 0; k < rowCount; k++) {
            float* row = mixed_.data();
            const float* self = sharp_.color(y + k, 0);
            if (isSharp || isLevel) {
                std::copy_n(isSharp ? self : levels_[needed.low - 1].row(k), 4 * count_, row);
            } else {
                // The sharp row in place of nodes that no pixel needs.
                for (const float*& node : nodes_) node = self;
                for (int node = needed.low; node <= needed.high; node++)
                    nodes_[node] = levels_[node - 1].row(k);
                placesOf(places_, ladder_.largest, levelCount, sharp_.sigma(y + k, 0), count_);
                mix(row, places_, ladder_.nodeWeights.data(), nodes_.data(), count_);
            }
            if (!isSharp && ladder_.keepEdges) divide(row, self, count_);
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

/// The blurred picture; `finish(y, x0, count, row)` sees each stretch of it before it is written, the fourth
/// channel meaning nothing until then.
template <class Finish>
void ladderBlur(const Source& source, const Ladder& ladder, const Cells& cells,
                std::span<const cv::Mat> small, cv::Mat& out, bool streams, Finish finish) {
    const int width = out.cols, height = out.rows, tiles = cells.columns,
              bands = std::clamp(height / 270, 1, 8);
    cv::parallel_for_(
        cv::Range(0, bands * tiles),
        [&](const cv::Range& range) {
            Tile tile(source, ladder, small);
            for (int n = range.start; n < range.end; n++) {
                const int band = n / tiles, column = n % tiles, x0 = column * tileWidth,
                          count = std::min(tileWidth, width - x0);
                tile.begin(x0, count);
                for (int cell = cells.rows * band / bands; cell < cells.rows * (band + 1) / bands; cell++) {
                    const int y = cell * madeRows;
                    tile.make(y, std::min(madeRows, height - y), height, cells.nodes[cells.at(column, cell)],
                              cells.extremes[cells.at(column, cell)], [&](int k, float* row) {
                                  finish(y + k, x0, count, row);
                                  brume::putRow(out.ptr<float>(y + k) + 4 * x0, row, 4 * size_t(count),
                                                streams);
                              });
                }
            }
            if (streams) brume::streamEnd();
        },
        bands * tiles);
}

}  // namespace fog_blur
