// The inner loops of every FIR here, over lines of RGBA floats. Each loaded pixel serves several outputs
// while it is in a register; every output sums its taps in one fixed order, so the same pixel gets the same
// bits whatever thread, tile or vector width computed it.
#pragma once

#include <algorithm>

#include "common/four.hpp"

namespace blur {

/// Taps that one fp32 sum takes; longer filters add up such sums. Thousands of terms of about one size in one
/// sum are each rounded the same way: a constant came out 3e-5 too small.
constexpr int longestSum = 256;

// out[i] = Σ taps[t]·line[i + t], in pixels: taps 0, 4, 8, ..., then 1, 5, 9, ..., and so on. Vectors four
// pixels apart take turns being multiplied by the taps four apart.
template <int vectors, class Wide>
BRUME_INLINE void alongBlock(float* out, const float* line, const float* taps, int tapCount) {
    typedef typename Wide::Four Vector;
    Vector a[vectors] = {};
    for (int phase = 0; phase < 4; phase++) {
        const float* from = line + 4 * phase;
        Vector x[vectors];
        for (int k = 0; k + 1 < vectors; k++) x[k] = Wide::load(from + 16 * k);
        for (int t = phase; t < tapCount; t += 4, from += 16) {
            x[vectors - 1] = Wide::load(from + 16 * (vectors - 1));
            for (int k = 0; k < vectors; k++) a[k] += taps[t] * x[k];
            for (int k = 0; k + 1 < vectors; k++) x[k] = x[k + 1];
        }
    }
    for (int k = 0; k < vectors; k++) Wide::store(out + 16 * k, a[k]);
}
// The same of one pixel.
BRUME_INLINE void alongOne(float* out, const float* line, const float* taps, int tapCount) {
    One a = {};
    for (int phase = 0; phase < 4; phase++)
        for (int t = phase; t < tapCount; t += 4) a += taps[t] * *(const One*)(line + 4 * t);
    *(One*)out = a;
}
template <class Wide>
BRUME_INLINE void firAlongShortBy(float* out, const float* line, const float* taps, int tapCount, int pixels,
                                  const float* next) {
    constexpr int many = Wide::alongSums, some = many / 2;
    int i = 0;
    for (; i + 4 * many <= pixels; i += 4 * many) {
        for (int k = 0; k < many; k++) __builtin_prefetch(next + 4 * i + 16 * k);
        alongBlock<many, Wide>(out + 4 * i, line + 4 * i, taps, tapCount);
    }
    for (; i + 4 * some <= pixels; i += 4 * some)
        alongBlock<some, Wide>(out + 4 * i, line + 4 * i, taps, tapCount);
    for (; i + 4 <= pixels; i += 4) alongBlock<1, Wide>(out + 4 * i, line + 4 * i, taps, tapCount);
    for (; i < pixels; i++) alongOne(out + 4 * i, line + 4 * i, taps, tapCount);
}
BRUME_WIDE(void, firAlongShort,
           (float* out, const float* line, const float* taps, int tapCount, int pixels, const float* next),
           (out, line, taps, tapCount, pixels, next))

static inline void firAlong(float* out, const float* line, const float* taps, int tapCount, int pixels,
                            const float* next) {
    firAlongShort(out, line, taps, std::min(tapCount, longestSum), pixels, next);
    constexpr int stretch = 64;
    float sum[4 * stretch];
    for (int t = longestSum; t < tapCount; t += longestSum)
        for (int i = 0; i < pixels; i += stretch) {
            const int count = std::min(stretch, pixels - i);
            firAlongShort(sum, line + 4 * (i + t), taps + t, std::min(tapCount - t, longestSum), count, line);
            for (int k = 0; k < 4 * count; k++) out[4 * i + k] += sum[k];
        }
}

/// Rows that one call of firAcross may give.
constexpr int acrossRows = 8;

// Adds row u to outputs first to last - 1 that have a tap for it.
template <class Wide, int outputs, int vectors>
BRUME_INLINE void acrossRow(typename Wide::Register (&a)[outputs][vectors], const float* row,
                            const float* taps, int u, int first, int last) {
    typedef typename Wide::Register Vector;
    for (int c = 0; c < vectors; c++) {
        Vector x = *(const Vector*)(row + sizeof(Vector) / 4 * c);
#pragma GCC unroll 8
        for (int k = first; k < last; k++) a[k][c] += taps[u - k] * x;
    }
}
// out[k] = Σ taps[t]·rows[k + t]: each row, while it is in a register, serves all outputs. tapCount >=
// outputs.
template <class Wide, int outputs, int vectors>
BRUME_INLINE void acrossBlock(float* const* out, const float* const* rows, const float* taps, int tapCount,
                              int at) {
    typedef typename Wide::Register Vector;
    Vector a[outputs][vectors] = {};
#pragma GCC unroll 8
    for (int u = 0; u < outputs - 1; u++) acrossRow<Wide>(a, rows[u] + at, taps, u, 0, u + 1);
    for (int u = outputs - 1; u < tapCount; u++) acrossRow<Wide>(a, rows[u] + at, taps, u, 0, outputs);
#pragma GCC unroll 8
    for (int k = 1; k < outputs; k++)
        acrossRow<Wide>(a, rows[tapCount - 1 + k] + at, taps, tapCount - 1 + k, k, outputs);
    for (int k = 0; k < outputs; k++)
        for (int c = 0; c < vectors; c++) *(Vector*)(out[k] + at + sizeof(Vector) / 4 * c) = a[k][c];
}
BRUME_INLINE void acrossOne(float* out, const float* const* rows, const float* taps, int tapCount, int at) {
    One a = {};
    for (int t = 0; t < tapCount; t++) a += taps[t] * *(const One*)(rows[t] + at);
    *(One*)(out + at) = a;
}

template <class Wide, int outputs>
BRUME_INLINE void acrossGroup(float* const* out, const float* const* rows, const float* taps, int tapCount,
                              int floats) {
    constexpr int vectors = std::min(2, Wide::sums / outputs), one = sizeof(typename Wide::Register) / 4;
    int at = 0;
    for (; at + vectors * one <= floats; at += vectors * one)
        acrossBlock<Wide, outputs, vectors>(out, rows, taps, tapCount, at);
    for (; at + one <= floats; at += one) acrossBlock<Wide, outputs, 1>(out, rows, taps, tapCount, at);
    for (int k = 0; k < outputs; k++)
        for (int i = at; i < floats; i += 4) acrossOne(out[k], rows + k, taps, tapCount, i);
}

template <class Wide>
BRUME_INLINE void firAcrossShortBy(float* const* out, int count, const float* const* rows, const float* taps,
                                   int tapCount, int floats) {
    int k = 0;
    for (; k + 8 <= count && tapCount >= 8; k += 8)
        acrossGroup<Wide, 8>(out + k, rows + k, taps, tapCount, floats);
    for (; k + 4 <= count && tapCount >= 4; k += 4)
        acrossGroup<Wide, 4>(out + k, rows + k, taps, tapCount, floats);
    for (; k < count; k++) acrossGroup<Wide, 1>(out + k, rows + k, taps, tapCount, floats);
}
BRUME_WIDE(void, firAcrossShort,
           (float* const* out, int count, const float* const* rows, const float* taps, int tapCount,
            int floats),
           (out, count, rows, taps, tapCount, floats))

// out[k] = Σ taps[t]·rows[k + t] for `count` <= acrossRows outputs, taps in rising order.
static inline void firAcross(float* const* out, int count, const float* const* rows, const float* taps,
                             int tapCount, int floats) {
    firAcrossShort(out, count, rows, taps, std::min(tapCount, longestSum), floats);
    constexpr int stretch = 256;
    float sums[acrossRows][stretch], *to[acrossRows];
    const float* from[acrossRows + longestSum];
    for (int k = 0; k < count; k++) to[k] = sums[k];
    for (int t = longestSum; t < tapCount; t += longestSum)
        for (int i = 0; i < floats; i += stretch) {
            const int width = std::min(stretch, floats - i), taken = std::min(tapCount - t, longestSum);
            for (int k = 0; k < count - 1 + taken; k++) from[k] = rows[t + k] + i;
            firAcrossShort(to, count, from, taps + t, taken, width);
            for (int k = 0; k < count; k++)
                for (int x = 0; x < width; x++) out[k][i + x] += sums[k][x];
        }
}

}  // namespace blur
