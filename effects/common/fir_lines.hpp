// The inner loops of every FIR here, over lines of RGBA floats. Each loaded pixel serves several outputs
// while it is in a register; every output sums its taps in one fixed order, so the same pixel gets the same
// bits whatever thread, tile or vector width computed it.
#pragma once

#include <algorithm>

#include "effect/kit/math.hpp"

namespace blur {

// Four pixels, two, one; unaligned.
typedef float Four __attribute__((vector_size(64), aligned(4), may_alias));
typedef float Two __attribute__((vector_size(32), aligned(4), may_alias));
typedef float One __attribute__((vector_size(16), aligned(4), may_alias));
// For templates, whose arguments would lose the attributes.
struct Fours {
    typedef Four Vector;
};
struct Ones {
    typedef One Vector;
};

/// Taps that one fp32 sum takes; longer filters add up such sums. Thousands of terms of about one size in one
/// sum are each rounded the same way: a constant came out 3e-5 too small.
constexpr int longestSum = 256;

// out[i] = Σ taps[t]·line[i + t], in pixels: taps 0, 4, 8, ..., then 1, 5, 9, ..., and so on. Vectors four
// pixels apart take turns being multiplied by the taps four apart.
template <int vectors, class Pixels>
BRUME_INLINE void alongBlock(float* out, const float* line, const float* taps, int tapCount) {
    typedef typename Pixels::Vector Vector;
    constexpr int floats = sizeof(Vector) / 4;
    Vector a[vectors] = {};
    for (int phase = 0; phase < 4; phase++) {
        const float* from = line + 4 * phase;
        Vector x[vectors];
        for (int k = 0; k + 1 < vectors; k++) x[k] = *(const Vector*)(from + floats * k);
        for (int t = phase; t < tapCount; t += 4, from += 16) {
            x[vectors - 1] = *(const Vector*)(from + floats * (vectors - 1));
            for (int k = 0; k < vectors; k++) a[k] += taps[t] * x[k];
            for (int k = 0; k + 1 < vectors; k++) x[k] = x[k + 1];
        }
    }
    for (int k = 0; k < vectors; k++) *(Vector*)(out + floats * k) = a[k];
}
BRUME_VECTORISE static void firAlongShort(float* out, const float* line, const float* taps, int tapCount,
                                          int pixels, const float* next) {
    int i = 0;
    for (; i + 32 <= pixels; i += 32) {
        for (int k = 0; k < 8; k++) __builtin_prefetch(next + 4 * i + 16 * k);
        alongBlock<8, Fours>(out + 4 * i, line + 4 * i, taps, tapCount);
    }
    for (; i + 16 <= pixels; i += 16) alongBlock<4, Fours>(out + 4 * i, line + 4 * i, taps, tapCount);
    for (; i + 4 <= pixels; i += 4) alongBlock<1, Fours>(out + 4 * i, line + 4 * i, taps, tapCount);
    for (; i < pixels; i++) alongBlock<1, Ones>(out + 4 * i, line + 4 * i, taps, tapCount);
}

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
template <int outputs, int vectors>
BRUME_INLINE void acrossRow(Four (&a)[outputs][vectors], const float* row, const float* taps, int u,
                            int first, int last) {
    for (int c = 0; c < vectors; c++) {
        Four x = *(const Four*)(row + 16 * c);
#pragma GCC unroll 8
        for (int k = first; k < last; k++) a[k][c] += taps[u - k] * x;
    }
}
// out[k] = Σ taps[t]·rows[k + t]: each row, while it is in a register, serves all outputs. tapCount >=
// outputs.
template <int outputs, int vectors>
BRUME_INLINE void acrossBlock(float* const* out, const float* const* rows, const float* taps, int tapCount,
                              int at) {
    Four a[outputs][vectors] = {};
#pragma GCC unroll 8
    for (int u = 0; u < outputs - 1; u++) acrossRow(a, rows[u] + at, taps, u, 0, u + 1);
    for (int u = outputs - 1; u < tapCount; u++) acrossRow(a, rows[u] + at, taps, u, 0, outputs);
#pragma GCC unroll 8
    for (int k = 1; k < outputs; k++)
        acrossRow(a, rows[tapCount - 1 + k] + at, taps, tapCount - 1 + k, k, outputs);
    for (int k = 0; k < outputs; k++)
        for (int c = 0; c < vectors; c++) *(Four*)(out[k] + at + 16 * c) = a[k][c];
}
template <class Pixels>
BRUME_INLINE void acrossOne(float* out, const float* const* rows, const float* taps, int tapCount, int at) {
    typedef typename Pixels::Vector Vector;
    Vector a = {};
    for (int t = 0; t < tapCount; t++) a += taps[t] * *(const Vector*)(rows[t] + at);
    *(Vector*)(out + at) = a;
}

template <int outputs>
BRUME_INLINE void acrossGroup(float* const* out, const float* const* rows, const float* taps, int tapCount,
                              int floats) {
    int at = 0;
    for (; at + 32 <= floats; at += 32) acrossBlock<outputs, 2>(out, rows, taps, tapCount, at);
    for (; at + 16 <= floats; at += 16) acrossBlock<outputs, 1>(out, rows, taps, tapCount, at);
    for (int k = 0; k < outputs; k++)
        for (int i = at; i < floats; i += 4) acrossOne<Ones>(out[k], rows + k, taps, tapCount, i);
}

BRUME_VECTORISE static void firAcrossShort(float* const* out, int count, const float* const* rows,
                                           const float* taps, int tapCount, int floats) {
    int k = 0;
    for (; k + 8 <= count && tapCount >= 8; k += 8) acrossGroup<8>(out + k, rows + k, taps, tapCount, floats);
    for (; k + 4 <= count && tapCount >= 4; k += 4) acrossGroup<4>(out + k, rows + k, taps, tapCount, floats);
    for (; k < count; k++) acrossGroup<1>(out + k, rows + k, taps, tapCount, floats);
}

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
