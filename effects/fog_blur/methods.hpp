// fog_blur on the CPU.
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "effect/plugin.hpp"
#include "fog_blur/derived.hpp"
#include "fog_blur/ladder_cpu.hpp"
#include "fog_blur/params.hpp"

namespace fog_blur {

// 1. Standard deviation of each pixel's blur, from the sum of the channels.
BRUME_INLINE float shareOf(float sum, float start, float inverse) {
    const float opacity = 1.0f - sum * (1.0f / 3.0f);
    return std::min(std::max((opacity - start) / inverse, 0.0f), 1.0f);
}
inline void shareRowBounded(float start, const float* transmittance, float* share, int count) {
    for (int i = 0; i < count; i++) {
        float t[3];
        for (int n = 0; n < 3; n++) {
            const float x = transmittance[4 * i + n];
            t[n] = brume::isNan(x) ? 0.0f : brume::isInf(x) ? std::copysign(65504.0f, x) : x;
        }
        share[i] = shareOf(t[0] + t[1] + t[2], start, 1.0f - start);
    }
}
// Of eight pixels. By hand: GCC takes channels apart at three times the cost.
BRUME_INLINE blur::Two sumsOfEight(const float* in) {
    typedef blur::Two Two;
    const Two a = *(const Two*)in, b = *(const Two*)(in + 8), c = *(const Two*)(in + 16),
              d = *(const Two*)(in + 24);
    const Two ab = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13),
              cd = __builtin_shufflevector(c, d, 0, 8, 1, 9, 4, 12, 5, 13),
              abBlue = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15),
              cdBlue = __builtin_shufflevector(c, d, 2, 10, 3, 11, 6, 14, 7, 15);
    const Two red = __builtin_shufflevector(ab, cd, 0, 1, 8, 9, 4, 5, 12, 13),
              green = __builtin_shufflevector(ab, cd, 2, 3, 10, 11, 6, 7, 14, 15),
              blue = __builtin_shufflevector(abBlue, cdBlue, 0, 1, 8, 9, 4, 5, 12, 13),
              sum = red + green + blue;
    return __builtin_shufflevector(sum, sum, 0, 4, 1, 5, 2, 6, 3, 7);
}
BRUME_VECTORISE static void sigmaRow(const FogBlur& p, float largest, const float* transmittance,
                                     float* sigma, int count) {
    const float falloff = p.falloff, start = p.start, inverse = 1.0f - start;
    constexpr int ahead = 512;  // px
    int i = 0, most = 0;
    for (; i + 8 <= count; i += 8) {
        __builtin_prefetch(transmittance + 4 * (i + ahead));
        __builtin_prefetch(transmittance + 4 * (i + ahead + 4));
        *(blur::Two*)(sigma + i) = sumsOfEight(transmittance + 4 * i);
    }
    for (; i < count; i++)
        sigma[i] = transmittance[4 * i] + transmittance[4 * i + 1] + transmittance[4 * i + 2];
    for (int k = 0; k < count; k++) most = std::max(most, std::bit_cast<int>(sigma[k]) & 0x7fffffff);
    if (most < 0x7f800000)
        for (int k = 0; k < count; k++) sigma[k] = shareOf(sigma[k], start, inverse);
    else
        shareRowBounded(start, transmittance, sigma, count);
    if (falloff != 1.0f)
        for (int k = 0; k < count; k++) sigma[k] = sigma[k] > 0.0f ? brume::powFast(sigma[k], falloff) : 0.0f;
    for (int k = 0; k < count; k++) sigma[k] *= largest;
}

inline Ladder ladderOf(const FogBlur& p, const brume::CpuContext& c) {
    Ladder ladder;
    auto levels = c.derived("levels"), tables = c.derived("levelTables");
    auto taps = c.derived("levelTaps"), prefilters = c.derived("prefilters"), phases = c.derived("phases");
    for (size_t l = 0; l + 4 <= levels.size(); l += 4) {
        LadderLevel level;
        level.sigma = levels[l];
        level.factor = int(levels[l + 1]);
        level.taps = taps.subspan(size_t(tables[l]), size_t(levels[l + 3]) + 1);
        level.prefilter = prefilters.subspan(size_t(tables[l + 1]), size_t(prefilterReach(level.factor)) + 1);
        level.up = phases.subspan(blur::enlargingTaps * size_t(tables[l + 2]),
                                  blur::enlargingTaps * size_t(level.factor));
        ladder.levels.push_back(level);
    }
    ladder.nodeWeights = c.derived("nodeWeights");
    ladder.largest = ladder.levels.back().sigma;
    ladder.keepEdges = p.edges == keep;
    ladder.spacing = spacingOf(p.rungs);
    return ladder;
}

// Weights of one axis, what lies beyond an edge added to the edge's.
inline void foldedGaussian(float sigma, float deviations, int at, int length, std::vector<float>& weights,
                           int& low) {
    const float scale = 0.5f / std::max(sigma * sigma, 1e-4f);
    const int reach = int(std::ceil(deviations * sigma));
    low = std::max(at - reach, 0);
    int high = std::min(at + reach, length - 1);
    weights.assign(high - low + 1, 0.0f);
    for (int d = -reach; d <= reach; d++)
        weights[std::clamp(at + d, low, high) - low] += brume::expFast(-float(d) * float(d) * scale);
}

// One pixel by the definition, its Gaussian cut at so many deviations; `row` is room for as many pixels as
// are looked at along one.
constexpr float gatherDeviations = 4;
struct GatherRoom {
    std::vector<float> across, down, row;
};
inline cv::Vec4f gathered(const FogBlur& p, const Source& source, int y, int x, GatherRoom& room,
                          float deviations = gatherDeviations) {
    cv::Vec4f self, sum;
    const int width = source.color.cols, height = source.color.rows;
    float sigma = source.sigma.at<float>(y, x), total = 0;
    sharpen(self.val, source.color.ptr<float>(y) + 4 * x, 1);
    if (!(sigma > 0)) return self;
    int left = 0, top = 0;
    foldedGaussian(sigma, deviations, x, width, room.across, left);
    foldedGaussian(sigma, deviations, y, height, room.down, top);
    room.row.resize(4 * size_t(width));
    float* row = room.row.data();
    for (size_t j = 0; j < room.down.size(); j++) {
        const int count = int(room.across.size());
        sharpen(row, source.color.ptr<float>(top + int(j)) + 4 * left, count);
        for (int i = 0; i < count && p.edges == keep; i += widestWeighed)
            weigh(row + 4 * i, row + 4 * i, source.sigma.ptr<float>(top + int(j)) + left + i, sigma,
                  std::min(widestWeighed, count - i));
        for (int i = 0; i < count; i++) {
            float w = room.across[i] * room.down[j];
            for (int n = 0; n < 4; n++) sum[n] += w * row[4 * i + n];
            total += w;
        }
    }
    sum *= 1.0f / total;
    float weight = p.edges == keep ? std::max(sum[3], 0.05f) : 1.0f;
    float missing = p.edges == keep ? weight - sum[3] : 0.0f;
    for (int n = 0; n < 3; n++) self[n] = (sum[n] + missing * self[n]) * (1.0f / weight);
    return self;
}

// 5. The fog's own light stays; what it let through of the clear picture is exchanged for the blurred one.
BRUME_VECTORISE static void finishRow(bool isSingle, const float* foggy, const float* clear,
                                      const float* transmittance, float* out, int count) {
    auto bounded = [](float x) {
        float y = brume::isInf(x) ? std::copysign(65504.0f, x) : x;
        return brume::isNan(x) ? 0.0f : y;
    };
    for (int i = 0; i < count && isSingle; i++)
        for (int n = 0; n < 3; n++) {
            float change = out[4 * i + n] - bounded(clear[4 * i + n]);
            out[4 * i + n] = bounded(foggy[4 * i + n]) + bounded(transmittance[4 * i + n]) * change;
        }
    for (int i = 0; i < count; i++) out[4 * i + 3] = foggy[4 * i + 3];
}

// What a run blurs, and how it ends.
struct Work {
    const FogBlur& p;
    const brume::CpuContext& c;
    const cv::Mat &transmittance, &clear;
    blur::Scratch sigmas;
    Source source;

    Work(const FogBlur& params, const brume::CpuContext& context)
        : p(params),
          c(context),
          transmittance(c.image("transmittance")),
          clear(c.image("clear")),
          sigmas(c.input.total()),
          source{p.order == single ? clear : c.input, cv::Mat(c.input.size(), CV_32F, sigmas.data())} {}
    void sigmaOf(int y, int x, int count, float* sigma) const {
        sigmaRow(p, c.derived("largestSigma")[0], transmittance.ptr<float>(y) + 4 * x, sigma, count);
    }
    void sigmaEverywhere() {
        for (int y = 0; y < source.sigma.rows; y++)
            sigmaOf(y, 0, source.sigma.cols, source.sigma.ptr<float>(y));
    }
    bool changesColor() const { return p.order == single; }
    const float* alphas(int y, int x) const { return c.input.ptr<float>(y) + 4 * x; }
    void finish(int y, int x, int count, float* row) const {
        finishRow(p.order == single, c.input.ptr<float>(y) + 4 * x, clear.ptr<float>(y) + 4 * x,
                  transmittance.ptr<float>(y) + 4 * x, row, count);
    }
};

inline void run(const FogBlur& p, const brume::CpuContext& c) {
    cv::Mat out = c.output;
    Work work(p, c);
    if (p.method != gatherMethod) {
        const Ladder ladder = ladderOf(p, c);
        const auto cells = findCells(work.source, ladder, [&](int y, int x, int count, float* sigma) {
            work.sigmaOf(y, x, count, sigma);
        });
        Room room;
        const auto small = smallLevels(work.source, ladder.levels, cells, ladder.keepEdges, room);
        return ladderBlur(work.source, ladder, cells, small, out, c.outputIsStreamed, work);
    }
    work.sigmaEverywhere();
    cv::parallel_for_(
        cv::Range(0, out.rows),
        [&](const cv::Range& range) {
            GatherRoom room;
            for (int y = range.start; y < range.end; y++)
                for (int x = 0; x < out.cols; x++)
                    out.at<cv::Vec4f>(y, x) = gathered(p, work.source, y, x, room);
        },
        4 * cv::getNumThreads());
    for (int y = 0; y < out.rows; y++) work.finish(y, 0, out.cols, out.ptr<float>(y));
}

}  // namespace fog_blur
