// The inner loops of the separable blurs, over lines of RGBA floats. Every sum has one fixed order, so the
// same pixel gets the same bits whatever thread, tile or vector width computed it.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "common/fir_lines.hpp"

namespace blur {

// NaN as 0 and ±inf as ±65504, so that one bad pixel cannot spread over a whole blur.
BRUME_VECTORISE static void copyFinite(float* out, const float* in, int floats) {
    for (int i = 0; i < floats; i++) {
        float x = in[i];
        float bounded = std::fabs(x) > 3.4028235e38f ? std::copysign(65504.0f, x) : x;
        out[i] = x == x ? bounded : 0.0f;
    }
}

BRUME_VECTORISE static bool allFinite(const float* in, int floats) {
    int largest = 0;
    for (int i = 0; i < floats; i++) largest = std::max(largest, std::bit_cast<int>(in[i]) & 0x7fffffff);
    return largest < 0x7f800000;
}

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
template <int count, bool isFresh, class Vector>
BRUME_INLINE void addBlock(float* sum, const float* const (&rows)[count], const float (&weights)[count],
                           int i) {
    auto term = [&](int k) { return *(const Vector*)(rows[k] + i) * weights[k]; };
    Vector x = term(0);
    if constexpr (!isFresh) x = *(const Vector*)(sum + i) + x;
    for (int k = 1; k < count; k++) x = x + term(k);
    *(Vector*)(sum + i) = x;
}
template <int count, bool isFresh>
BRUME_INLINE void addStretch(const BlockSum& s, const float* const* blockOf, int from, int end) {
    const float* rows[count];
    float weights[count];
    for (int k = 0; k < count; k++) rows[k] = blockOf[s.first + k], weights[k] = s.weights[s.first + k];
    float* sum = s.sum;
    int i = from;
    for (; i + 16 <= end; i += 16) addBlock<count, isFresh, Four>(sum, rows, weights, i);
    for (; i < end; i += 4) addBlock<count, isFresh, One>(sum, rows, weights, i);
}
template <int count>
BRUME_INLINE void addAsMany(const BlockSum& s, const float* const* rows, int from, int end) {
    if (s.isFresh)
        addStretch<count, true>(s, rows, from, end);
    else
        addStretch<count, false>(s, rows, from, end);
}
// `ahead`: rows to be asked for meanwhile, a stretch of each with every stretch.
struct RowsAhead {
    const float* rows[blockRows];
    int count = 0;
};
BRUME_VECTORISE static void addBlocks(const BlockSum* sums, int sumCount, const float* const* blockOf,
                                      int floats, const RowsAhead& ahead) {
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
                    addAsMany<1>(sums[s], rows, from, end);
                    break;
                case 2:
                    addAsMany<2>(sums[s], rows, from, end);
                    break;
                case 3:
                    addAsMany<3>(sums[s], rows, from, end);
                    break;
                case 4:
                    addAsMany<4>(sums[s], rows, from, end);
                    break;
                case 5:
                    addAsMany<5>(sums[s], rows, from, end);
                    break;
                case 6:
                    addAsMany<6>(sums[s], rows, from, end);
                    break;
                case 7:
                    addAsMany<7>(sums[s], rows, from, end);
                    break;
                default:
                    addAsMany<8>(sums[s], rows, from, end);
            }
        }
    }
}

// Four vectors of four pixels each, summed up: one vector of the four sums.
BRUME_INLINE Four sumsOf(const Four (&a)[4]) {
    Four b[2];
    for (int k = 0; k < 2; k++)
        b[k] = __builtin_shufflevector(a[2 * k], a[2 * k + 1], 0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21,
                                       22, 23) +
               __builtin_shufflevector(a[2 * k], a[2 * k + 1], 8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27,
                                       28, 29, 30, 31);
    return __builtin_shufflevector(b[0], b[1], 0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19, 24, 25, 26, 27) +
           __builtin_shufflevector(b[0], b[1], 4, 5, 6, 7, 12, 13, 14, 15, 20, 21, 22, 23, 28, 29, 30, 31);
}

// Every `step`-th pixel of a filtered line: out[j] = Σ quads[u]·line[j·step + 4u .. + 3], four taps at a
// time. `line` begins at the first tap of output 0; quads[u] holds taps 4u to 4u + 3, four times each.
// Writes, and reads for, up to three pixels beyond `count`.
BRUME_VECTORISE static void decimateLine(float* out, const float* line, const float* quads, int quadCount,
                                         int step, int count) {
    for (int j = 0; j < count; j += 4) {
        const float* at = line + 4 * j * step;
        Four a[4] = {};
        for (int u = 0; u < quadCount; u++) {
            Four w = *(const Four*)(quads + 16 * u);
            for (int k = 0; k < 4; k++) a[k] += w * *(const Four*)(at + 4 * k * step + 16 * u);
        }
        *(Four*)(out + 4 * j) = sumsOf(a);
    }
}

template <class Vector>
BRUME_INLINE Vector weighted(const Vector (&s)[6], const Vector* w) {
    return ((s[0] * w[0] + s[1] * w[1]) + (s[2] * w[2] + s[3] * w[3])) + (s[4] * w[4] + s[5] * w[5]);
}
template <class Vector>
BRUME_INLINE Vector weighted(const Vector (&s)[4], const Vector* w) {
    return (s[0] * w[0] + s[1] * w[1]) + (s[2] * w[2] + s[3] * w[3]);
}

// Six or four rows' weighted sum, four pixels from float i on.
template <int taps>
BRUME_INLINE Four columnSum(const float* const (&rows)[taps], const Four (&w)[taps], int i) {
    Four s[taps];
    for (int m = 0; m < taps; m++) s[m] = *(const Four*)(rows[m] + i);
    return weighted(s, w);
}
// One pixel of four, four times.
template <int pixel>
BRUME_INLINE Four fourTimes(Four a) {
    constexpr int k = 4 * pixel;
    return __builtin_shufflevector(a, a, k, k + 1, k + 2, k + 3, k, k + 1, k + 2, k + 3, k, k + 1, k + 2,
                                   k + 3, k, k + 1, k + 2, k + 3);
}
// Four pixels from `pixel` on of eight.
template <int pixel>
BRUME_INLINE Four fourFrom(Four a, Four b) {
    constexpr int k = 4 * pixel;
    return __builtin_shufflevector(a, b, k, k + 1, k + 2, k + 3, k + 4, k + 5, k + 6, k + 7, k + 8, k + 9,
                                   k + 10, k + 11, k + 12, k + 13, k + 14, k + 15);
}

// Twice as many pixels: those in the place of a small one from five, those between from `near` on each side.
template <int near>
BRUME_INLINE void doubleRows(float* out, const float* const (&rows)[6], const Four (&w)[6],
                             const float* phases, int width) {
    Four even[6], odd[6];
    for (int m = 0; m < 6; m++) {
        const Four both = *(const Four*)(phases + 16 * m);
        even[m] = fourTimes<0>(both);
        odd[m] = fourTimes<1>(both);
    }
    Four v[3] = {columnSum(rows, w, 0), columnSum(rows, w, 16), {}};
    for (int j = 0; 2 * j < width; j += 4, v[0] = v[1], v[1] = v[2]) {
        v[2] = columnSum(rows, w, 4 * (j + 8));
        const Four s[6] = {v[0], fourFrom<1>(v[0], v[1]), fourFrom<2>(v[0], v[1]), fourFrom<3>(v[0], v[1]),
                           v[1], fourFrom<1>(v[1], v[2])};
        Four a = ((s[0] * even[0] + s[1] * even[1]) + (s[2] * even[2] + s[3] * even[3])) + s[4] * even[4];
        Four b = (s[1] * odd[1] + s[2] * odd[2]) + (s[3] * odd[3] + s[4] * odd[4]);
        if constexpr (near == 3) b = b + (s[0] * odd[0] + s[5] * odd[5]);
        *(Four*)(out + 8 * j) =
            __builtin_shufflevector(a, b, 0, 1, 2, 3, 16, 17, 18, 19, 4, 5, 6, 7, 20, 21, 22, 23);
        *(Four*)(out + 8 * j + 16) =
            __builtin_shufflevector(a, b, 8, 9, 10, 11, 24, 25, 26, 27, 12, 13, 14, 15, 28, 29, 30, 31);
    }
}

// The same from one small pixel on each side: a cubic B-spline.
BRUME_INLINE void doubleRows(float* out, const float* const (&rows)[4], const Four (&w)[4],
                             const float* phases, int width) {
    Four even[3], odd[2];
    for (int m = 0; m < 3; m++) even[m] = fourTimes<0>(*(const Four*)(phases + 16 * m));
    for (int m = 0; m < 2; m++) odd[m] = fourTimes<1>(*(const Four*)(phases + 16 * (m + 1)));
    Four v = columnSum(rows, w, 0), next = {};
    for (int j = 0; 2 * j < width; j += 4, v = next) {
        next = columnSum(rows, w, 4 * (j + 4));
        const Four s[3] = {v, fourFrom<1>(v, next), fourFrom<2>(v, next)};
        Four a = (s[0] * even[0] + s[1] * even[1]) + s[2] * even[2], b = s[1] * odd[0] + s[2] * odd[1];
        *(Four*)(out + 8 * j) =
            __builtin_shufflevector(a, b, 0, 1, 2, 3, 16, 17, 18, 19, 4, 5, 6, 7, 20, 21, 22, 23);
        *(Four*)(out + 8 * j + 16) =
            __builtin_shufflevector(a, b, 8, 9, 10, 11, 24, 25, 26, 27, 12, 13, 14, 15, 28, 29, 30, 31);
    }
}

// `groups` of four phases a small pixel; six taps or four.
template <int groups, int taps>
BRUME_INLINE void multiplyRows(float* out, const float* const (&rows)[taps], const Four (&w)[taps],
                               const float* phases, int factor, int width) {
    constexpr int last = taps - 1;
    Four v = columnSum(rows, w, 0), s[taps] = {};
    s[1] = fourTimes<0>(v), s[2] = fourTimes<1>(v), s[3] = fourTimes<2>(v);
    if constexpr (taps == 6) {
        s[4] = fourTimes<3>(v);
        v = columnSum(rows, w, 16);
        s[5] = fourTimes<0>(v);
    }
    auto putNext = [&](Four next, int j) __attribute__((always_inline)) {
        for (int m = 0; m < last; m++) s[m] = s[m + 1];
        s[last] = next;
        for (int g = 0; g < groups; g++)
            *(Four*)(out + 4 * (j * factor + 4 * g)) = weighted(s, (const Four*)phases + taps * g);
    };
    // Four small pixels at a time, v holding what they come to need but for its first `held`.
    constexpr int held = taps == 6 ? 1 : 3;
    for (int j = 0; j * factor < width; j += 4) {
        auto put = [&](auto k) __attribute__((always_inline)) {
            if ((j + k) * factor >= width) return false;
            if constexpr (held + k == 4) v = columnSum(rows, w, 4 * (j + (taps == 6 ? 8 : 4)));
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
template <int taps>
BRUME_INLINE void enlargeRowsBy(float* out, const float* const* from, const float* weights,
                                const float* phases, int factor, int width) {
    const float* rows[taps];
    Four w[taps];
    for (int m = 0; m < taps; m++) rows[m] = from[m], w[m] = Four{} + weights[m];
    if (factor == 2) {
        if constexpr (taps == 4)
            return doubleRows(out, rows, w, phases, width);
        else
            return phases[4] == 0.0f ? doubleRows<2>(out, rows, w, phases, width)
                                     : doubleRows<3>(out, rows, w, phases, width);
    }
    switch ((factor + 3) / 4) {
        case 1:
            return multiplyRows<1>(out, rows, w, phases, factor, width);
        case 2:
            return multiplyRows<2>(out, rows, w, phases, factor, width);
        case 3:
            return multiplyRows<3>(out, rows, w, phases, factor, width);
        default:
            return multiplyRows<4>(out, rows, w, phases, factor, width);
    }
}
BRUME_VECTORISE static void enlargeRows(float* out, const float* const* from, const float* weights,
                                        const float* phases, int factor, int width) {
    enlargeRowsBy<6>(out, from, weights, phases, factor, width);
}
BRUME_VECTORISE static void enlargeRowsByFour(float* out, const float* const* from, const float* weights,
                                              const float* phases, int factor, int width) {
    enlargeRowsBy<4>(out, from, weights, phases, factor, width);
}

}  // namespace blur
