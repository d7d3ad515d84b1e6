// FIRs of the levels that fog_blur does not decimate, on the CPU: four rows side by side, a vector lane a
// pixel of each, so that filtering along rows reads whole vectors, as filtering across does.
#pragma once

#include <array>

#include "common/filter_lines.hpp"
#include "common/fir_lines.hpp"
#include "fog_blur/sharp_cpu.hpp"

namespace fog_blur {

/// Rows side by side; floats of one step along them.
constexpr int laneRows = 4, laneFloats = 4 * laneRows;
/// Outputs made at a time, and the longest reach of a level.
constexpr int atOnce = 8, longestReach = 19;

// Steps along rows, of as many as lie side by side.
template <int count>
BRUME_INLINE void putAlong(float* const* rows, int at, const Four (&a)[count]) {
    for (int part = 0; part < count; part += 4) {
        Four b[4] = {a[part], a[part + 1], a[part + 2], a[part + 3]};
        blur::transpose(b);
        for (int k = 0; k < laneRows; k++) *(Four*)(rows[k] + at + 4 * part) = b[k];
    }
}
template <int count>
BRUME_INLINE void putAlong(float* const* rows, int at, const blur::Two (&a)[count]) {
    for (int k = 0; k < count; k += 2) {
        *(blur::Two*)(rows[0] + at + 4 * k) =
            __builtin_shufflevector(a[k], a[k + 1], 0, 1, 2, 3, 8, 9, 10, 11);
        *(blur::Two*)(rows[1] + at + 4 * k) =
            __builtin_shufflevector(a[k], a[k + 1], 4, 5, 6, 7, 12, 13, 14, 15);
    }
}

// Rows of `count` filtered pixels, from `lanes` at the first; whole groups of eight. Meanwhile as many pixels
// of the rows `soon` are asked for, if any: a few at a time, since a core waits where it asks for more than
// it has room for.
template <class Wide, class Taps>
BRUME_INLINE void alongOf(float* const* rows, const float* lanes, const Taps& taps, int count,
                          const float* const* soon) {
    // A register holds so many of the rows.
    typedef typename Wide::Register Vector;
    constexpr int floats = sizeof(Vector) / 4;
    auto ask = [&](int from, int end) __attribute__((always_inline)) {
        for (int k = 0; k < laneRows && soon; k++)
            for (int x = from; x < end; x += 4) __builtin_prefetch(soon[k] + 4 * x);
    };
    for (int i = 0; i < count; i += atOnce) {
        ask(i, i + atOnce);
        for (int row = 0; row < laneFloats; row += floats)
            for (int part = 0; part < atOnce; part += Wide::sums) {
                Vector a[Wide::sums];
                blur::sumPairs<Wide, 1>(
                    a, taps, [&](int k, int t) __attribute__((always_inline)) {
                        return blur::loaded<Vector>(lanes + laneFloats * (i + part + k + t) + row);
                    });
                putAlong(rows + row / 4, 4 * (i + part), a);
            }
    }
    ask(count, count + 2 * taps.last);
}
template <class Wide>
BRUME_INLINE void filterAlongBy(float* const* rows, const float* lanes, const blur::Stretch& taps, int count,
                                const float* const* soon) {
    blur::withTaps<Wide, longestReach>(
        taps, [&](const auto& known)
                  __attribute__((always_inline)) { alongOf<Wide>(rows, lanes, known, count, soon); });
}
BRUME_WIDE(void, filterAlong,
           (float* const* rows, const float* lanes, const blur::Stretch& taps, int count,
            const float* const* soon),
           (rows, lanes, taps, count, soon))
// Eight rows of filtered pixels, rows[0] at the first; whole groups of four.
template <class Wide>
BRUME_INLINE void filterAcrossBy(float* const* out, const float* const* rows, const blur::Stretch& taps,
                                 int count) {
    blur::acrossBy<Wide, blur::Unwatched, longestReach>(out, atOnce, rows, 0, taps, (count + 3) / 4 * 16);
}
BRUME_WIDE(void, filterAcross,
           (float* const* out, const float* const* rows, const blur::Stretch& taps, int count),
           (out, rows, taps, count))

// Four rows of pixels, made sharp, and their deviations side by side; whole groups of four pixels.
template <class Wide>
BRUME_INLINE void interleaveRowsBy(float* lanes, float* laneSigmas, const float* const* colors,
                                   const float* const* sigmas, int count) {
    for (int i = 0; i < count; i += 4) {
        typename Wide::Four a[4];
        for (int k = 0; k < laneRows; k++) a[k] = sharpened(Wide::load(colors[k] + 4 * i));
        blur::transpose(a);
        for (int k = 0; k < 4; k++) Wide::store(lanes + laneFloats * (i + k), a[k]);
        for (int k = 0; k < 4; k++)
            for (int row = 0; row < laneRows; row++)
                laneSigmas[laneRows * (i + k) + row] = sigmas[row][i + k];
    }
}

BRUME_WIDE(void, interleaveRows,
           (float* lanes, float* laneSigmas, const float* const* colors, const float* const* sigmas,
            int count),
           (lanes, laneSigmas, colors, sigmas, count))

// What a blur of `sigma` takes of them.
template <class Wide>
BRUME_INLINE void weighLanesBy(float* out, const float* lanes, const float* laneSigmas, float sigma,
                               int count) {
    const float inverse = 1.0f / sigma;
    const auto one = typename Wide::Four{} + 1.0f;
    for (int i = 0; i < count; i += 4) {
        const auto weights = blur::least(Wide::load(laneSigmas + laneRows * i) * inverse, one);
        auto weigh = [&](auto k) __attribute__((always_inline)) {
            const int at = laneFloats * (i + k);
            Wide::store(out + at, Wide::load(lanes + at) * blur::spreadPart<k>(weights));
        };
        using std::integral_constant;
        weigh(integral_constant<int, 0>()), weigh(integral_constant<int, 1>());
        weigh(integral_constant<int, 2>()), weigh(integral_constant<int, 3>());
    }
}
BRUME_WIDE(void, weighLanes,
           (float* out, const float* lanes, const float* laneSigmas, float sigma, int count),
           (out, lanes, laneSigmas, sigma, count))

/// The rows round those being made, four side by side, `margin` pixels wider than `width` on each side and
/// with eight more to the right that mean nothing.
class LaneRows {
  public:
    LaneRows(const Source& source, int width, int margin)
        : source_(source),
          margin_(margin),
          wide_((width + 2 * margin + atOnce + 3) / 4 * 4),
          groups_((atOnce + 2 * margin) / laneRows + 3),
          colors_(size_t(groups_) * laneFloats * wide_),
          sigmas_(size_t(groups_) * laneRows * wide_),
          rowColors_(size_t(laneRows) * 4 * wide_),
          rowSigmas_(size_t(laneRows) * wide_) {}
    void begin(int x0, int count) { from_ = done_ = 0, x0_ = x0, count_ = count; }
    // Has rows y to y + 7, with those that lie `around` above and below; y rises.
    void advance(int y, int around) {
        const int first = std::max(0, y - around) / laneRows,
                  end = (std::min(y + atOnce + around, source_.color.rows) + laneRows - 1) / laneRows;
        if (first < from_ || first > done_) from_ = done_ = first;
        for (; done_ < end; done_++) take(done_);
        from_ = std::max(from_, done_ - groups_);
    }
    // Of rows 4·group and on, from `before` pixels left of x0 on; before <= margin.
    const float* color(int group, int before) const {
        return colors_.data() + (size_t(group % groups_) * wide_ + margin_ - before) * laneFloats;
    }
    const float* sigma(int group, int before) const {
        return sigmas_.data() + (size_t(group % groups_) * wide_ + margin_ - before) * laneRows;
    }

    // The picture's rows that are taken after those of `group`, from `before` pixels left of x0 on.
    std::array<const float*, laneRows> rowsAfter(int group, int before) const {
        std::array<const float*, laneRows> rows;
        for (int k = 0; k < laneRows; k++) {
            const int y = std::min(group * laneRows + atOnce + k, source_.color.rows - 1);
            rows[k] = source_.color.ptr<float>(y) + 4 * std::max(x0_ - before, 0);
        }
        return rows;
    }

  private:
    void take(int group) {
        const int first = x0_ - margin_, count = (count_ + 2 * margin_ + 3) / 4 * 4,
                  width = source_.color.cols, last = source_.color.rows - 1;
        const bool isInside = first >= 0 && first + count <= width;
        const float *colors[laneRows], *sigmas[laneRows];
        for (int k = 0; k < laneRows; k++) {
            const int y = std::min(group * laneRows + k, last);
            const float *color = source_.color.ptr<float>(y), *sigma = source_.sigma.ptr<float>(y),
                        *soon = source_.sigma.ptr<float>(std::min(y + atOnce, last));
            for (int x = std::max(first, 0); x < std::min(first + count, width); x += 16)
                __builtin_prefetch(soon + x);
            colors[k] = color + 4 * first, sigmas[k] = sigma + first;
            if (isInside) continue;
            float *toColor = rowColors_.data() + size_t(k) * 4 * wide_,
                  *toSigma = rowSigmas_.data() + size_t(k) * wide_;
            replicate(toColor, toSigma, color, sigma, width, first, count);
            colors[k] = toColor, sigmas[k] = toSigma;
        }
        const size_t at = size_t(group % groups_) * wide_;
        interleaveRows(colors_.data() + at * laneFloats, sigmas_.data() + at * laneRows, colors, sigmas,
                       count);
    }
    // `count` pixels from column `first` on, and their deviations; beyond the edges as at them.
    static void replicate(float* toColor, float* toSigma, const float* color, const float* sigma, int width,
                          int first, int count) {
        blur::copyReplicated(toColor, color, width, first, count, [](float* out, const float* in, int n) {
            std::memcpy(out, in, size_t(n) * sizeof(float));
        });
        for (int i = 0; i < count; i++) toSigma[i] = sigma[std::clamp(first + i, 0, width - 1)];
    }
    const Source& source_;
    int margin_, wide_, groups_, from_ = 0, done_ = 0, x0_ = 0, count_ = 0;
    blur::Scratch colors_, sigmas_, rowColors_, rowSigmas_;
};

}  // namespace fog_blur
