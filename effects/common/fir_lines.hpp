// The inner loops of every FIR here, over lines of RGBA floats. Each loaded pixel serves several outputs
// while it is in a register; every output sums its taps in one fixed order, so the same pixel gets the same
// bits whatever thread, tile or vector width computed it.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/four.hpp"
#include "common/stream.hpp"

namespace blur {

/// Taps that one fp32 sum takes; longer filters add up such sums. Thousands of terms of about one size in one
/// sum are each rounded the same way: a constant came out 3e-5 too small.
constexpr int longestSum = 256;

// out[i] = Σ taps[t]·line[i + t], in pixels: taps 0, 4, 8, ..., then 1, 5, 9, ..., and so on. Vectors four
// pixels apart take turns being multiplied by the taps four apart.
template <int vectors, class Wide, class Put>
BRUME_INLINE void alongBlock(float* out, const float* line, const float* taps, int tapCount, Put put) {
    typedef typename Wide::Four Vector;
    Vector a[vectors] = {};
    for (int phase = 0; phase < 4; phase++) {
        const float* from = line + 4 * phase;
        // Step s of a round finds the k-th vector at (s + k) % vectors, so that none is moved.
        Vector x[vectors];
#pragma GCC unroll 8
        for (int k = 0; k + 1 < vectors; k++) x[k] = Wide::load(from + 16 * k);
        for (int t = phase; t < tapCount;) {
#pragma GCC unroll 8
            for (int s = 0; s < vectors; s++) {
                x[(s + vectors - 1) % vectors] = Wide::load(from + 16 * (vectors - 1));
#pragma GCC unroll 8
                for (int k = 0; k < vectors; k++) a[k] += taps[t] * x[(s + k) % vectors];
                from += 16, t += 4;
                if (t >= tapCount) break;
            }
        }
    }
    for (int k = 0; k < vectors; k++) put(out + 16 * k, a[k]);
}
// The same of one pixel.
BRUME_INLINE void alongOne(float* out, const float* line, const float* taps, int tapCount) {
    One a = {};
    for (int phase = 0; phase < 4; phase++)
        for (int t = phase; t < tapCount; t += 4) a += taps[t] * *(const One*)(line + 4 * t);
    *(One*)out = a;
}
template <class Wide, class Put>
BRUME_INLINE void firAlongShortTo(float* out, const float* line, const float* taps, int tapCount, int pixels,
                                  Put put) {
    constexpr int many = Wide::alongSums, some = many / 2;
    int i = 0;
    for (; i + 4 * many <= pixels; i += 4 * many)
        alongBlock<many, Wide>(out + 4 * i, line + 4 * i, taps, tapCount, put);
    for (; i + 4 * some <= pixels; i += 4 * some)
        alongBlock<some, Wide>(out + 4 * i, line + 4 * i, taps, tapCount, put);
    for (; i + 4 <= pixels; i += 4) alongBlock<1, Wide>(out + 4 * i, line + 4 * i, taps, tapCount, put);
    for (; i < pixels; i++) alongOne(out + 4 * i, line + 4 * i, taps, tapCount);
}
template <class Wide>
BRUME_INLINE void firAlongShortBy(float* out, const float* line, const float* taps, int tapCount,
                                  int pixels) {
    firAlongShortTo<Wide>(
        out, line, taps, tapCount, pixels,
        [](float* to, auto x) __attribute__((always_inline)) { Wide::store(to, x); });
}
BRUME_WIDE(void, firAlongShort, (float* out, const float* line, const float* taps, int tapCount, int pixels),
           (out, line, taps, tapCount, pixels))
#ifdef BRUME_STREAMS_LINES
// The same past the caches; `out` begins where a line of the cache does.
[[maybe_unused]] BRUME_STREAMS_LINES static void firAlongStreamed(float* out, const float* line,
                                                                  const float* taps, int tapCount,
                                                                  int pixels) {
    firAlongShortTo<Whole>(
        out, line, taps, tapCount, pixels,
        [](float* to, Four x) __attribute__((always_inline)) { brume::streamLine(to, x); });
}
[[maybe_unused]] BRUME_STREAMS_HALVES static void firAlongHalved(float* out, const float* line,
                                                                 const float* taps, int tapCount,
                                                                 int pixels) {
    firAlongShortTo<Halves>(
        out, line, taps, tapCount, pixels, [](float* to, Pair x) __attribute__((always_inline)) {
            brume::streamHalf(to, x.low), brume::streamHalf(to + 8, x.high);
        });
}
#endif

static inline void firAlong(float* out, const float* line, const float* taps, int tapCount, int pixels) {
    firAlongShort(out, line, taps, std::min(tapCount, longestSum), pixels);
    constexpr int stretch = 64;
    float sum[4 * stretch];
    for (int t = longestSum; t < tapCount; t += longestSum)
        for (int i = 0; i < pixels; i += stretch) {
            const int count = std::min(stretch, pixels - i);
            firAlongShort(sum, line + 4 * (i + t), taps + t, std::min(tapCount - t, longestSum), count);
            for (int k = 0; k < 4 * count; k++) out[4 * i + k] += sum[k];
        }
}

/// Rows that one call of firAcross may give.
constexpr int acrossRows = 8;

// Adds row u to outputs first to last - 1 that have a tap for it. (A compiler that saw which taps the next
// row takes again would keep more of them in registers than there are.)
template <class Wide, int outputs, int vectors>
BRUME_INLINE void acrossRow(typename Wide::Register (&a)[outputs][vectors], const float* row,
                            const float* tapOfFirst, int first, int last) {
    typedef typename Wide::Register Vector;
#if defined(__GNUC__)
    asm("" : "+r"(tapOfFirst));
#endif
    Vector x[vectors];
    for (int c = 0; c < vectors; c++) x[c] = *(const Vector*)(row + sizeof(Vector) / 4 * c);
#pragma GCC unroll 8
    for (int k = first; k < last; k++)
        for (int c = 0; c < vectors; c++) a[k][c] += tapOfFirst[first - k] * x[c];
}
// out[k] = Σ taps[t]·rows[k + t]: each row, while it is in a register, serves all outputs. tapCount >=
// outputs.
template <class Wide, int outputs, int vectors>
BRUME_INLINE void acrossBlock(float* const* out, const float* const* rows, const float* taps, int tapCount,
                              int at, typename Wide::Watch& watch) {
    typedef typename Wide::Register Vector;
    Vector a[outputs][vectors] = {};
#pragma GCC unroll 8
    for (int u = 0; u < outputs - 1; u++) acrossRow<Wide>(a, rows[u] + at, taps + u, 0, u + 1);
    for (int u = outputs - 1; u < tapCount; u++) acrossRow<Wide>(a, rows[u] + at, taps + u, 0, outputs);
#pragma GCC unroll 8
    for (int k = 1; k < outputs; k++)
        acrossRow<Wide>(a, rows[tapCount - 1 + k] + at, taps + tapCount - 1, k, outputs);
    for (int k = 0; k < outputs; k++)
        for (int c = 0; c < vectors; c++) {
            watch.look(a[k][c]);
            *(Vector*)(out[k] + at + sizeof(Vector) / 4 * c) = a[k][c];
        }
}
BRUME_INLINE void acrossOne(float* out, const float* const* rows, const float* taps, int tapCount, int at) {
    One a = {};
    for (int t = 0; t < tapCount; t++) a += taps[t] * *(const One*)(rows[t] + at);
    *(One*)(out + at) = a;
}

template <class Wide, int outputs>
BRUME_INLINE bool acrossGroup(float* const* out, const float* const* rows, const float* taps, int tapCount,
                              int floats) {
    constexpr int vectors = Wide::sums / outputs > 2 ? 2 : Wide::sums / outputs,
                  one = sizeof(typename Wide::Register) / 4;
    typename Wide::Watch watch;
    int at = 0;
    for (; at + vectors * one <= floats; at += vectors * one)
        acrossBlock<Wide, outputs, vectors>(out, rows, taps, tapCount, at, watch);
    for (; at + one <= floats; at += one) acrossBlock<Wide, outputs, 1>(out, rows, taps, tapCount, at, watch);
    bool areFinite = watch.areFinite();
    for (int k = 0; k < outputs; k++)
        for (int i = at; i < floats; i += 4) {
            acrossOne(out[k], rows + k, taps, tapCount, i);
            for (int c = 0; c < 4; c++) areFinite = areFinite && std::abs(out[k][i + c]) < HUGE_VALF;
        }
    return areFinite;
}

template <class Wide>
BRUME_INLINE bool firAcrossShortBy(float* const* out, int count, const float* const* rows, const float* taps,
                                   int tapCount, int floats) {
    constexpr int most = Wide::acrossSums;
    bool areFinite = true;
    int k = 0;
    for (; k + most <= count && tapCount >= most; k += most)
        areFinite &= acrossGroup<Wide, most>(out + k, rows + k, taps, tapCount, floats);
    if constexpr (most > 4)
        for (; k + 4 <= count && tapCount >= 4; k += 4)
            areFinite &= acrossGroup<Wide, 4>(out + k, rows + k, taps, tapCount, floats);
    for (; k < count; k++) areFinite &= acrossGroup<Wide, 1>(out + k, rows + k, taps, tapCount, floats);
    return areFinite;
}
BRUME_WIDE(bool, firAcrossShort,
           (float* const* out, int count, const float* const* rows, const float* taps, int tapCount,
            int floats),
           (out, count, rows, taps, tapCount, floats))

// out[k] = Σ taps[t]·rows[k + t] for `count` <= acrossRows outputs, taps in rising order. Whether all that
// was summed up is finite.
static inline bool firAcross(float* const* out, int count, const float* const* rows, const float* taps,
                             int tapCount, int floats) {
    bool areFinite = firAcrossShort(out, count, rows, taps, std::min(tapCount, longestSum), floats);
    constexpr int stretch = 256;
    float sums[acrossRows][stretch], *to[acrossRows];
    const float* from[acrossRows + longestSum];
    for (int k = 0; k < count; k++) to[k] = sums[k];
    for (int t = longestSum; t < tapCount; t += longestSum)
        for (int i = 0; i < floats; i += stretch) {
            const int width = std::min(stretch, floats - i), taken = std::min(tapCount - t, longestSum);
            for (int k = 0; k < count - 1 + taken; k++) from[k] = rows[t + k] + i;
            areFinite &= firAcrossShort(to, count, from, taps + t, taken, width);
            for (int k = 0; k < count; k++)
                for (int x = 0; x < width; x++) out[k][i + x] += sums[k][x];
        }
    return areFinite;
}

}  // namespace blur
