// The inner loops of the separable blurs, over lines of RGBA floats. Every sum has one fixed order, so the
// same pixel gets the same bits whatever thread, tile or vector width computed it.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>

#include "common/fir_lines.hpp"

namespace blur {

// NaN as 0 and ±inf as ±65504, so that one bad pixel cannot spread over a whole blur; what is beyond ±1e38 as
// that, lest sums be infinite.
BRUME_VECTORISE static void copyFinite(float* out, const float* in, int floats) {
    for (int i = 0; i < floats; i++) {
        float x = in[i];
        const float magnitude = std::fabs(x),
                    bounded =
                        std::copysign(magnitude > 3.4028235e38f ? 65504.0f : std::min(magnitude, 1e38f), x);
        out[i] = x == x ? bounded : 0.0f;
    }
}

// Whole pixels of them, which as a rule are finite.
template <class Wide>
BRUME_INLINE void copyPixelsBy(float* out, const float* in, int floats) {
    typedef typename Wide::Register Vector;
    typename Wide::Watch watch;
    constexpr int one = sizeof(Vector) / 4;
    int i = 0;
    for (; i + one <= floats; i += one) {
        const Vector x = loaded<Vector>(in + i);
        watch.look(x);
        put(out + i, x);
    }
    if (!watch.areFinite()) i = 0;
    copyFinite(out + i, in + i, floats - i);
}
BRUME_WIDE(void, copyPixels, (float* out, const float* in, int floats), (out, in, floats))

BRUME_VECTORISE static bool allFinite(const float* in, int floats) {
    int largest = 0;
    for (int i = 0; i < floats; i++) largest = std::max(largest, std::bit_cast<int>(in[i]) & 0x7fffffff);
    return largest <= mostAdded;
}

/// Rows, so many bytes apart, of whose same columns a first cache of eight ways of 4 KB has room.
inline int rowsCached(size_t step) { return int(8 * 4096 / std::gcd(step, size_t(4096))); }
/// Floats from one row to the next that hold `floats`, such that it has room for those of many.
constexpr size_t spacedStride(int floats) { return size_t((floats + 15) / 16 | 1) * 16; }

// The line `count` pixels long from column `first` on of a row `width` pixels long whose edges replicate.
template <class Copy>
static inline void copyReplicated(float* out, const float* row, int width, int first, int count, Copy copy) {
    int inside0 = std::clamp(first, 0, width), inside1 = std::clamp(first + count, inside0, width);
    copy(out + 4 * (inside0 - first), row + 4 * inside0, 4 * (inside1 - inside0));
    float left[4], right[4];
    copy(left, row, 4);
    copy(right, row + 4 * (width - 1), 4);
    for (int i = 0; i < std::min(count, -first); i++) std::memcpy(out + 4 * i, left, sizeof left);
    for (int i = std::max(0, width - first); i < count; i++) std::memcpy(out + 4 * i, right, sizeof right);
}

// Runs `filter` on that line, of values as they are; and again, with its bad values replaced, if any got into
// the `floats` floats of its result: looking there is cheaper than looking at every input.
template <class Filter>
static inline void filterReplicated(float* result, int floats, float* padded, const float* row, int width,
                                    int first, int count, Filter filter) {
    if (first >= 0 && first + count <= width) {
        filter(row + 4 * first);
    } else {
        copyReplicated(padded, row, width, first, count,
                       [](float* out, const float* in, int n) { std::memcpy(out, in, n * sizeof(float)); });
        filter(padded);
    }
    if (allFinite(result, floats)) return;
    copyReplicated(padded, row, width, first, count, copyFinite);
    filter(padded);
}

// Sums of rows, as a decimation in the other direction takes them: sum += Σ weights[k]·rows[k], the rows
// first to first + count - 1 of one block. A sum that isFresh begins with it. In short stretches, so that
// rows stay in the first cache while all sums take them; meanwhile the rows' next stretch is asked for.
constexpr int blockRows = 8;
struct BlockSum {
    float* sum;
    float weights[blockRows];
    bool isFresh;
    int first, count;
};
template <class Wide, class Vector, int count, bool isFresh>
BRUME_INLINE void addBlock(float* sum, const float* const (&rows)[count], const float (&weights)[count],
                           int i) {
    auto row = [&](int k) __attribute__((always_inline)) { return loaded<Vector>(rows[k] + i); };
    Vector x = isFresh ? row(0) * weights[0] : fused<Wide>(weights[0], row(0), loaded<Vector>(sum + i));
    for (int k = 1; k < count; k++) x = fused<Wide>(weights[k], row(k), x);
    put(sum + i, x);
}
template <class Wide, int count, bool isFresh>
BRUME_INLINE void addStretch(const BlockSum& s, const float* const* blockOf, int from, int end) {
    const float* rows[count];
    float weights[count];
    for (int k = 0; k < count; k++) rows[k] = blockOf[s.first + k], weights[k] = s.weights[s.first + k];
    float* sum = s.sum;
    int i = from;
    typedef typename Wide::Register Vector;
    constexpr int floats = sizeof(Vector) / 4;
    for (; i + floats <= end; i += floats) addBlock<Wide, Vector, count, isFresh>(sum, rows, weights, i);
    for (; i < end; i += 4) addBlock<Wide, One, count, isFresh>(sum, rows, weights, i);
}
template <class Wide, int count>
BRUME_INLINE void addAsMany(const BlockSum& s, const float* const* rows, int from, int end) {
    if (s.isFresh)
        addStretch<Wide, count, true>(s, rows, from, end);
    else
        addStretch<Wide, count, false>(s, rows, from, end);
}
// `ahead`: rows to be asked for meanwhile, a stretch of each with every stretch.
struct RowsAhead {
    const float* rows[blockRows];
    int count = 0;
};
template <class Wide>
BRUME_INLINE void addBlocksBy(const BlockSum* sums, int sumCount, const float* const* blockOf, int floats,
                              const RowsAhead& ahead) {
    constexpr int stretch = 128;
    const int lines = stretch / 16 * ahead.count;
    const float* rows[blockRows];
    for (int k = 0; k < blockRows; k++) rows[k] = blockOf[k];
    for (int from = 0; from < floats; from += stretch) {
        const int end = std::min(from + stretch, floats);
        for (int s = 0, line = 0; s < sumCount; s++) {
            for (; line < lines * (s + 1) / sumCount; line++)
                __builtin_prefetch(ahead.rows[line / (stretch / 16)] + from + line % (stretch / 16) * 16);
            switch (sums[s].count) {
                case 1:
                    addAsMany<Wide, 1>(sums[s], rows, from, end);
                    break;
                case 2:
                    addAsMany<Wide, 2>(sums[s], rows, from, end);
                    break;
                case 3:
                    addAsMany<Wide, 3>(sums[s], rows, from, end);
                    break;
                case 4:
                    addAsMany<Wide, 4>(sums[s], rows, from, end);
                    break;
                case 5:
                    addAsMany<Wide, 5>(sums[s], rows, from, end);
                    break;
                case 6:
                    addAsMany<Wide, 6>(sums[s], rows, from, end);
                    break;
                case 7:
                    addAsMany<Wide, 7>(sums[s], rows, from, end);
                    break;
                default:
                    addAsMany<Wide, 8>(sums[s], rows, from, end);
            }
        }
    }
}

BRUME_WIDE(void, addBlocks,
           (const BlockSum* sums, int sumCount, const float* const* blockOf, int floats,
            const RowsAhead& ahead),
           (sums, sumCount, blockOf, floats, ahead))

// Four vectors of four pixels each, summed up: one vector of the four sums.
template <class Vector>
BRUME_INLINE Vector sumsOf(const Vector (&a)[4]) {
    Vector b[2];
    for (int k = 0; k < 2; k++)
        b[k] = pixels<0, 1, 4, 5>(a[2 * k], a[2 * k + 1]) + pixels<2, 3, 6, 7>(a[2 * k], a[2 * k + 1]);
    return pixels<0, 2, 4, 6>(b[0], b[1]) + pixels<1, 3, 5, 7>(b[0], b[1]);
}

// Every `step`-th pixel of a filtered line: out[j] = Σ quads[u]·line[j·step + 4u .. + 3], four taps at a
// time. `line` begins at the first tap of output 0; quads[u] holds taps 4u to 4u + 3, four times each.
// Writes, and reads for, up to three pixels beyond `count`.
template <class Wide>
BRUME_INLINE void decimateLineBy(float* out, const float* line, const float* quads, int quadCount, int step,
                                 int count) {
    typedef typename Wide::Four Four;
    for (int j = 0; j < count; j += 4) {
        const float* at = line + 4 * j * step;
        Four a[4] = {};
        for (int u = 0; u < quadCount; u++) {
            Four w = Wide::load(quads + 16 * u);
            for (int k = 0; k < 4; k++) a[k] = Wide::fused(w, Wide::load(at + 4 * k * step + 16 * u), a[k]);
        }
        Wide::store(out + 4 * j, sumsOf(a));
    }
}
BRUME_WIDE(void, decimateLine,
           (float* out, const float* line, const float* quads, int quadCount, int step, int count),
           (out, line, quads, quadCount, step, count))

// Σ s[k]·w[k], as two sums that do not wait for each other.
template <class Wide, class Vector, int count>
BRUME_INLINE Vector weighted(const Vector (&s)[count], const Vector* w) {
    Vector a = s[0] * w[0], b = s[1] * w[1];
    for (int k = 2; k < count; k += 2) {
        a = Wide::fused(s[k], w[k], a);
        if (k + 1 < count) b = Wide::fused(s[k + 1], w[k + 1], b);
    }
    return a + b;
}

// Six or four rows' weighted sum, four pixels from float i on.
template <class Wide, int taps>
BRUME_INLINE typename Wide::Four columnSum(const float* const (&from)[taps],
                                           const typename Wide::Four (&w)[taps], int i) {
    typename Wide::Four s[taps];
    for (int m = 0; m < taps; m++) s[m] = Wide::load(from[m] + i);
    return weighted<Wide>(s, w);
}
// One pixel of four, four times.
template <int k, class Vector>
BRUME_INLINE Vector fourTimes(Vector a) {
    return pixels<k, k, k, k>(a, a);
}
// Four pixels from `k` on of eight.
template <int k, class Vector>
BRUME_INLINE Vector fourFrom(Vector a, Vector b) {
    return pixels<k, k + 1, k + 2, k + 3>(a, b);
}

// Twice as many pixels: those in the place of a small one from five, those between from `near` on each side.
template <class Wide, int near>
BRUME_INLINE void doubleRows(float* out, const float* const (&rows)[6], const typename Wide::Four (&w)[6],
                             const float* phases, int width) {
    typedef typename Wide::Four Four;
    Four even[6], odd[6];
    for (int m = 0; m < 6; m++) {
        const Four both = Wide::load(phases + 16 * m);
        even[m] = fourTimes<0>(both);
        odd[m] = fourTimes<1>(both);
    }
    Four v[3] = {columnSum<Wide>(rows, w, 0), columnSum<Wide>(rows, w, 16), {}};
    for (int j = 0; 2 * j < width; j += 4, v[0] = v[1], v[1] = v[2]) {
        v[2] = columnSum<Wide>(rows, w, 4 * (j + 8));
        const Four s[6] = {v[0], fourFrom<1>(v[0], v[1]), fourFrom<2>(v[0], v[1]), fourFrom<3>(v[0], v[1]),
                           v[1], fourFrom<1>(v[1], v[2])};
        const Four five[5] = {s[0], s[1], s[2], s[3], s[4]}, four[4] = {s[1], s[2], s[3], s[4]};
        const Four a = weighted<Wide>(five, even),
                   b = near == 3 ? weighted<Wide>(s, odd) : weighted<Wide>(four, odd + 1);
        Wide::store(out + 8 * j, pixels<0, 4, 1, 5>(a, b));
        Wide::store(out + 8 * j + 16, pixels<2, 6, 3, 7>(a, b));
    }
}

// The same from one small pixel on each side: a cubic B-spline.
template <class Wide>
BRUME_INLINE void doubleRows(float* out, const float* const (&rows)[4], const typename Wide::Four (&w)[4],
                             const float* phases, int width) {
    typedef typename Wide::Four Four;
    Four even[3], odd[2];
    for (int m = 0; m < 3; m++) even[m] = fourTimes<0>(Wide::load(phases + 16 * m));
    for (int m = 0; m < 2; m++) odd[m] = fourTimes<1>(Wide::load(phases + 16 * (m + 1)));
    Four v = columnSum<Wide>(rows, w, 0), next = {};
    for (int j = 0; 2 * j < width; j += 4, v = next) {
        next = columnSum<Wide>(rows, w, 4 * (j + 4));
        const Four s[3] = {v, fourFrom<1>(v, next), fourFrom<2>(v, next)};
        const Four inner[2] = {s[1], s[2]}, a = weighted<Wide>(s, even), b = weighted<Wide>(inner, odd);
        Wide::store(out + 8 * j, pixels<0, 4, 1, 5>(a, b));
        Wide::store(out + 8 * j + 16, pixels<2, 6, 3, 7>(a, b));
    }
}

// `groups` of four phases a small pixel; six taps or four.
template <class Wide, int groups, int taps>
BRUME_INLINE void multiplyRows(float* out, const float* const (&rows)[taps],
                               const typename Wide::Four (&w)[taps], const float* phases, int factor,
                               int width) {
    typedef typename Wide::Four Four;
    constexpr int last = taps - 1;
    Four v = columnSum<Wide>(rows, w, 0), s[taps] = {};
    s[1] = fourTimes<0>(v), s[2] = fourTimes<1>(v), s[3] = fourTimes<2>(v);
    if constexpr (taps == 6) {
        s[4] = fourTimes<3>(v);
        v = columnSum<Wide>(rows, w, 16);
        s[5] = fourTimes<0>(v);
    }
    auto putNext = [&](Four next, int j) __attribute__((always_inline)) {
        for (int m = 0; m < last; m++) s[m] = s[m + 1];
        s[last] = next;
        for (int g = 0; g < groups; g++)
            Wide::store(out + 4 * (j * factor + 4 * g), weighted<Wide>(s, (const Four*)phases + taps * g));
    };
    // Four small pixels at a time, v holding what they come to need but for its first `held`.
    constexpr int held = taps == 6 ? 1 : 3;
    for (int j = 0; j * factor < width; j += 4) {
        auto put = [&](auto k) __attribute__((always_inline)) {
            if ((j + k) * factor >= width) return false;
            if constexpr (held + k == 4) v = columnSum<Wide>(rows, w, 4 * (j + (taps == 6 ? 8 : 4)));
            putNext(fourTimes<(held + k) % 4>(v), j + k);
            return true;
        };
        using std::integral_constant;
        if (!put(integral_constant<int, 0>()) || !put(integral_constant<int, 1>()) ||
            !put(integral_constant<int, 2>()) || !put(integral_constant<int, 3>()))
            break;
    }
}

// `factor` pixels for each of the small ones that six or four rows sum up to, with weights w: out[j·factor +
// phase] = Σ weight[phase][m]·sum[j + m], m < taps. phases[phase/4][m] holds four phases' weights, four times
// each. Writes whole groups of phases, so up to factor + 3 pixels beyond `width` (8 if factor is 2); reads up
// to eleven small pixels beyond the first that the last takes.
template <class Wide, int taps>
BRUME_INLINE void enlargeRowsOf(float* out, const float* const* from, const float* weights,
                                const float* phases, int factor, int width) {
    typedef typename Wide::Four Four;
    const float* rows[taps];
    Four w[taps];
    for (int m = 0; m < taps; m++) rows[m] = from[m], w[m] = Four{} + weights[m];
    if (factor == 2) {
        if constexpr (taps == 4)
            return doubleRows<Wide>(out, rows, w, phases, width);
        else
            return phases[4] == 0.0f ? doubleRows<Wide, 2>(out, rows, w, phases, width)
                                     : doubleRows<Wide, 3>(out, rows, w, phases, width);
    }
    switch ((factor + 3) / 4) {
        case 1:
            return multiplyRows<Wide, 1>(out, rows, w, phases, factor, width);
        case 2:
            return multiplyRows<Wide, 2>(out, rows, w, phases, factor, width);
        case 3:
            return multiplyRows<Wide, 3>(out, rows, w, phases, factor, width);
        default:
            return multiplyRows<Wide, 4>(out, rows, w, phases, factor, width);
    }
}
template <class Wide>
BRUME_INLINE void enlargeRowsBy(float* out, const float* const* from, const float* weights,
                                const float* phases, int factor, int width) {
    enlargeRowsOf<Wide, 6>(out, from, weights, phases, factor, width);
}
template <class Wide>
BRUME_INLINE void enlargeRowsByFourBy(float* out, const float* const* from, const float* weights,
                                      const float* phases, int factor, int width) {
    enlargeRowsOf<Wide, 4>(out, from, weights, phases, factor, width);
}
BRUME_WIDE(void, enlargeRows,
           (float* out, const float* const* from, const float* weights, const float* phases, int factor,
            int width),
           (out, from, weights, phases, factor, width))
BRUME_WIDE(void, enlargeRowsByFour,
           (float* out, const float* const* from, const float* weights, const float* phases, int factor,
            int width),
           (out, from, weights, phases, factor, width))

}  // namespace blur
