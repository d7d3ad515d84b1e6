// fog_blur's ladder on the CPU; twin of the ladder in fog_blur.fs. Levels decimated by more than one are made
// first, as small images; the others live only as the few rows that a tile of the output needs.
#pragma once

#include <bit>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "common/blur_cpu.hpp"

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

// What a blur of `sigma` takes: finite colour times weight, and the weight.
BRUME_VECTORISE static void weigh(float* out, const float* color, const float* sigmas, float sigma,
                                  bool keepEdges, int count) {
    float inverse = 1.0f / sigma;
    for (int i = 0; i < count; i++) {
        float weight = !keepEdges || sigmas[i] >= sigma ? 1.0f : sigmas[i] * inverse;
        for (int n = 0; n < 3; n++) {
            float x = color[4 * i + n];
            float bounded = std::fabs(x) > 3.4028235e38f ? std::copysign(65504.0f, x) : x;
            out[4 * i + n] = (x == x ? bounded : 0.0f) * weight;
        }
        out[4 * i + 3] = weight;
    }
}

inline void weighReplicated(float* out, const Source& source, float sigma, bool keepEdges, int y, int first,
                            int count) {
    const float *color = source.color.ptr<float>(y), *sigmas = source.sigma.ptr<float>(y);
    const int width = source.color.cols;
    int inside0 = std::clamp(first, 0, width), inside1 = std::clamp(first + count, inside0, width);
    weigh(out + 4 * (inside0 - first), color + 4 * inside0, sigmas + inside0, sigma, keepEdges,
          inside1 - inside0);
    float left[4], right[4];
    weigh(left, color, sigmas, sigma, keepEdges, 1);
    weigh(right, color + 4 * (width - 1), sigmas + width - 1, sigma, keepEdges, 1);
    for (int i = 0; i < std::min(count, -first); i++) std::memcpy(out + 4 * i, left, sizeof left);
    for (int i = std::max(0, width - first); i < count; i++) std::memcpy(out + 4 * i, right, sizeof right);
}

inline cv::Mat smallLevel(const Source& source, const LadderLevel& level, bool keepEdges) {
    auto filterRow = [&](int y, int first, int count, std::vector<float>& padded, float*, int, auto filter) {
        weighReplicated(padded.data(), source, level.sigma, keepEdges, y, first, count);
        filter(padded.data());
    };
    cv::Mat small =
        blur::decimateRows(source.color.cols, source.color.rows, level.factor, level.prefilter, filterRow);
    cv::Mat blurred(small.size(), CV_32FC4);
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

// One level's rows of a tile: horizontally filtered ones in a ring, the finished row in `row`.
class TileLevel {
  public:
    TileLevel(const LadderLevel& level, int tile)
        : level_(&level),
          tile_(tile),
          reach_(int(level.taps.size()) - 1),
          row(4 * size_t(tile + 2 * level.factor)) {
        if (level.factor > 1) {
            pairs_ = blur::phasePairs(level.factor, level.up);
        } else {
            ring_.resize(size_t(2 * reach_ + 1) * 4 * tile);
            padded_.resize(4 * size_t(tile + 2 * reach_));
            before_.resize(reach_ + 1), after_.resize(reach_ + 1);
        }
    }
    void begin(int y0, int x0, int count) { done_ = std::max(0, y0 - reach_), x0_ = x0, count_ = count; }
    // Points at the pixel x0 of row y.
    const float* make(const Source& source, const cv::Mat& small, bool keepEdges, int y) {
        if (level_->factor > 1) {
            int from = x0_ / level_->factor * level_->factor;
            padded_.resize(4 * size_t(small.cols));
            blur::enlargeRow(small, level_->factor, level_->up, pairs_.data(), y, from, count_ + x0_ - from,
                             padded_.data(), row.data());
            return row.data() + 4 * (x0_ - from);
        }
        const int last = source.color.rows - 1;
        for (; done_ <= std::min(y + reach_, last); done_++) {
            weighReplicated(padded_.data(), source, level_->sigma, keepEdges, done_, x0_ - reach_,
                            count_ + 2 * reach_);
            const float* center = padded_.data() + 4 * reach_;
            for (int t = 1; t <= reach_; t++) before_[t] = center - 4 * t, after_[t] = center + 4 * t;
            blur::symmetricSum(slot(done_), center, before_.data(), after_.data(), level_->taps.data(),
                               reach_, 4 * count_);
        }
        for (int t = 1; t <= reach_; t++)
            before_[t] = slot(std::max(y - t, 0)), after_[t] = slot(std::min(y + t, last));
        blur::symmetricSum(row.data(), slot(y), before_.data(), after_.data(), level_->taps.data(), reach_,
                           4 * count_);
        return row.data();
    }

  private:
    float* slot(int y) { return ring_.data() + size_t(y % (2 * reach_ + 1)) * 4 * tile_; }

    const LadderLevel* level_;
    int tile_, reach_, done_ = 0, x0_ = 0, count_ = 0;
    std::vector<float> row, ring_, padded_, pairs_;
    std::vector<const float*> before_, after_;
};

/// The blurred picture; its fourth channel means nothing.
inline void ladderBlur(const Source& source, const Ladder& ladder, cv::Mat& out) {
    const int width = out.cols, height = out.rows, levelCount = int(ladder.levels.size());
    std::vector<cv::Mat> small(levelCount);
    for (int l = 0; l < levelCount; l++)
        if (ladder.levels[l].factor > 1) small[l] = smallLevel(source, ladder.levels[l], ladder.keepEdges);

    const int tile = 320, bands = std::clamp(height / 48, 1, 4 * cv::getNumThreads());
    cv::parallel_for_(cv::Range(0, bands), [&](const cv::Range& range) {
        std::vector<TileLevel> levels;
        for (const LadderLevel& level : ladder.levels) levels.emplace_back(level, tile);
        std::vector<float> sharp(4 * tile);
        std::vector<const float*> nodes(levelCount + 1);
        for (int band = range.start; band < range.end; band++) {
            int y0 = int(int64_t(height) * band / bands), y1 = int(int64_t(height) * (band + 1) / bands);
            for (int x0 = 0; x0 < width; x0 += tile) {
                int count = std::min(tile, width - x0);
                // Only the levels that this tile's pixels lie between are made.
                std::vector<char> needed(levelCount + 4, 0);
                for (int y = y0; y < y1; y++)
                    for (int x = x0; x < x0 + count; x++) {
                        float sigma = source.sigma.ptr<float>(y)[x];
                        if (sigma > 0.0f) needed[placeOf(ladder, sigma).first] = 1;
                    }
                auto isNeeded = [&](int node) {
                    for (int k = 0; k < 4; k++)
                        if (node >= k && needed[node - k]) return true;
                    return false;
                };
                for (int l = 0; l < levelCount; l++)
                    if (isNeeded(l + 1)) levels[l].begin(y0, x0, count);
                for (int y = y0; y < y1; y++) {
                    const float* sigmas = source.sigma.ptr<float>(y) + x0;
                    weigh(sharp.data(), source.color.ptr<float>(y) + 4 * x0, sigmas, 1.0f, false, count);
                    nodes[0] = sharp.data();
                    for (int l = 0; l < levelCount; l++)
                        if (isNeeded(l + 1))
                            nodes[l + 1] = levels[l].make(source, small[l], ladder.keepEdges, y);
                    interpolate(ladder, nodes.data(), sigmas, out.ptr<float>(y) + 4 * x0, count);
                }
            }
        }
    });
}

}  // namespace fog_blur
