// One tile of fog_blur's output on the CPU: the rows of the levels it needs, made as it goes down.
#pragma once

#include "fog_blur/lanes_cpu.hpp"
#include "fog_blur/mix_cpu.hpp"
#include "fog_blur/small_cpu.hpp"

namespace fog_blur {

/// Pixels across a tile, and rows of it that are made together: a cell.
constexpr int tileWidth = cellWidth, madeRows = cellHeight;
static_assert(madeRows == atOnce && tileWidth % atOnce == 0);

// A level that is not decimated: rows filtered along themselves in a ring, the finished ones in `made`.
class FirLevel {
  public:
    explicit FirLevel(const LadderLevel& level)
        : level_(&level),
          lines_(2 * reach() + madeRows + 2 * laneRows),
          ring_(size_t(lines_) * ringStride),
          made_(size_t(madeRows) * 4 * tileWidth),
          weighed_(size_t(tileWidth + 2 * reach() + atOnce) * laneFloats) {}
    int reach() const { return int(level_->taps.size()) - 1; }
    void begin() { done_ = 0; }
    // Rows y to y + 7 of a picture `height` px high; y rises, and may leave rows out. The level that reaches
    // farthest asks for the rows that come next.
    void make(const LaneRows& sharp, bool keepEdges, int y, int count, int height, bool asks) {
        done_ = std::max(done_, std::max(0, y - reach()) / laneRows);
        for (; done_ * laneRows < std::min(y + madeRows + reach(), height); done_++) {
            const float* lanes = sharp.color(done_, reach());
            if (keepEdges) {
                weighLanes(weighed_.data(), lanes, sharp.sigma(done_, reach()), level_->sigma,
                           (count + 2 * reach() + 3) / 4 * 4);
                lanes = weighed_.data();
            }
            float* to[laneRows];
            for (int k = 0; k < laneRows; k++) to[k] = slot(laneRows * done_ + k);
            const auto soon = sharp.rowsAfter(done_, reach());
            filterAlong(to, lanes + reach() * laneFloats, taps(), count, asks ? soon.data() : nullptr);
        }
        const float* rows[madeRows + 2 * longestReach];
        for (int u = 0; u < madeRows + 2 * reach(); u++)
            rows[u] = slot(std::clamp(y - reach() + u, 0, height - 1));
        float* to[madeRows];
        for (int k = 0; k < madeRows; k++) to[k] = made_.data() + size_t(k) * 4 * tileWidth;
        filterAcross(to, rows + reach(), taps(), count);
    }
    const float* row(int k) const { return made_.data() + size_t(k) * 4 * tileWidth; }

  private:
    blur::Stretch taps() const { return {level_->taps.data(), 0, reach()}; }
    float* slot(int y) const { return ring_.data() + size_t(y % lines_) * ringStride; }
    static constexpr size_t ringStride = blur::spacedStride(4 * tileWidth);
    const LadderLevel* level_;
    int lines_, done_ = 0;  // groups of rows in the ring
    blur::Scratch ring_, made_, weighed_;
};

// A level that is a small image: single rows of it, enlarged when asked for.
class EnlargedLevel {
  public:
    EnlargedLevel(const LadderLevel& level, const cv::Mat& small)
        : level_(&level),
          small_(small),
          phases_(blur::phaseGroups(level.factor, level.up, boxCount)),
          made_(blur::roomEnlarged(level.factor, tileWidth + level.factor)) {}
    // Asks for the small rows that rows y to y + 7 take first, below those before.
    void askFor(int y, int x0, int count) const {
        const int factor = level_->factor, x = x0 / factor + blur::smallMargin - 2;
        for (int j = (y + factor - 1) / factor; j * factor < y + madeRows; j++) {
            const int row = j + blur::smallMargin + 1;
            if (row >= small_.rows) break;
            for (int i = 0; i < 4 * (count / factor + 6); i += 16)
                __builtin_prefetch(small_.ptr<float>(row) + 4 * x + i);
        }
    }
    int factor() const { return level_->factor; }
    // `count` pixels of row y from x0 on, until the next call.
    const float* row(int y, int x0, int count) const {
        const int before = x0 % level_->factor;
        blur::enlargeRow<boxCount>(small_, level_->factor, level_->up, phases_.data(), y, x0 - before,
                                   count + before, made_.data());
        return made_.data() + 4 * before;
    }

  private:
    const LadderLevel* level_;
    cv::Mat small_;
    blur::Scratch phases_, made_;
};

// madeRows at a time.
class Tile {
  public:
    Tile(const Source& source, const Ladder& ladder, std::span<const cv::Mat> small)
        : source_(source),
          ladder_(ladder),
          sharp_(source, tileWidth, marginOf(ladder)),
          self_(4 * size_t(tileWidth)),
          mixed_(4 * size_t(tileWidth)) {
        for (size_t l = 0; l < ladder.levels.size(); l++)
            if (ladder.levels[l].factor == 1)
                firs_.emplace_back(ladder.levels[l]);
            else
                enlarged_.emplace_back(ladder.levels[l], small[l]);
        nodes_.resize(ladder.levels.size() + 2);
    }
    void begin(int x0, int count) {
        x0_ = x0, count_ = count;
        sharp_.begin(x0, count);
        for (FirLevel& level : firs_) level.begin();
    }
    /// Rows y to y + rowCount, finished: rows that end.changesColor() go through end.finish(), others get
    /// end.alphas() only.
    template <class End>
    void make(int y, int rowCount, int height, const Nodes& needed, const Extremes& extremes, const End& end,
              cv::Mat& out, bool streams) {
        const bool isSharp = needed.high < needed.low,
                   isLevel = needed.low == needed.high && extremes.isEven();
        const int firEnd = std::min(needed.high, int(firs_.size()));
        if (needed.low <= firEnd) {
            sharp_.advance(y, firs_[firEnd - 1].reach());
            for (int node = needed.low; node <= firEnd; node++)
                firs_[node - 1].make(sharp_, ladder_.keepEdges, y, count_, height, node == firEnd);
        }
        for (int node = std::max(needed.low, firEnd + 1); node <= needed.high; node++) {
            const EnlargedLevel& level = enlargedAt(node);
            level.askFor(y + rowCount + 2 * level.factor(), x0_, count_);
        }
        auto rowOf = [&](int node, int k) {
            return node <= int(firs_.size()) ? firs_[node - 1].row(k)
                                             : enlargedAt(node).row(y + k, x0_, count_);
        };
        for (int k = 0; k < rowCount; k++) {
            // Meanwhile the next cell's colours and deviations are asked for; FIRs have asked for theirs.
            const int below = std::min(y + k + madeRows, height - 1);
            const float* soonSigma = source_.sigma.ptr<float>(below) + x0_;
            for (int x = 0; x < count_; x += 16) __builtin_prefetch(soonSigma + x);
            float *self = self_.data(), *to = out.ptr<float>(y + k) + 4 * x0_;
            sharpen(self, source_.color.ptr<float>(y + k) + 4 * x0_, count_);
            // The sharp row in place of nodes that no pixel needs.
            for (const float*& node : nodes_) node = self;
            MixedRow row = {};
            if (isLevel) nodes_[0] = rowOf(needed.low, k);
            if (!isSharp && !isLevel) {
                for (int node = needed.low; node <= needed.high; node++) nodes_[node] = rowOf(node, k);
                placesOf(places_, ladder_.spacing, ladder_.largest, int(ladder_.levels.size()),
                         source_.sigma.ptr<float>(y + k) + x0_, count_);
                row.places = &places_;
            }
            row.nodeWeights = ladder_.nodeWeights.data(), row.nodes = nodes_.data();
            row.sharp = self, row.alphas = end.alphas(y + k, x0_);
            row.isWeighed = !isSharp && ladder_.keepEdges;
            row.soon = source_.color.ptr<float>(below) + 4 * x0_;
            row.out = end.changesColor() ? mixed_.data() : to;
            row.streams = !end.changesColor() && streams && brume::canStreamPlanes();
            row.count = count_;
            mix(row);
            if (end.changesColor()) {
                end.finish(y + k, x0_, count_, mixed_.data());
                brume::putRow(to, mixed_.data(), 4 * size_t(count_), streams);
            }
        }
    }

  private:
    static int marginOf(const Ladder& ladder) {
        int margin = 0;
        for (const LadderLevel& level : ladder.levels)
            if (level.factor == 1) margin = std::max(margin, int(level.taps.size()) - 1);
        return margin;
    }
    // Levels that are decimated come after those that are not.
    const EnlargedLevel& enlargedAt(int node) const { return enlarged_[size_t(node) - 1 - firs_.size()]; }

    const Source& source_;
    const Ladder& ladder_;
    int x0_ = 0, count_ = 0;
    LaneRows sharp_;
    std::vector<FirLevel> firs_;
    std::vector<EnlargedLevel> enlarged_;
    std::vector<const float*> nodes_;
    blur::Scratch self_, mixed_;
    Places places_;
};

}  // namespace fog_blur
