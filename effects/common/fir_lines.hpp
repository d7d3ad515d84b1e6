// The inner loops of every symmetric FIR here, over lines of RGBA floats. Each output sums its taps in pairs
// in one fixed order, an addition and a fused multiply-add for two of them, so the same pixel gets the same
// bits whatever thread, tile or vector width computed it. `half` holds the centre tap and one side's.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/four.hpp"
#include "common/stream.hpp"

namespace blur {

/// Pairs of taps that one fp32 sum takes; longer filters add up such sums. Thousands of terms of about one
/// size in one sum are each rounded the same way: a constant came out 3e-5 too small.
constexpr int longestSum = 128;

/// Reaches there is code for, unrolled: what it loads for one tap stays in registers for the next, which
/// takes half the time. (More of it takes long to compile.)
constexpr int longestUnrolled = 12;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int mostUnrolled = 1;  // what sanitizers make of more takes ten minutes to compile
#else
constexpr int mostUnrolled = 99;
#endif

// The taps that a sum takes: half[first] to half[last].
struct Stretch {
    const float* half;
    int first, last;
};
// The same of a FIR whose reach the compiler knows.
template <int reach>
struct Unrolled {
    const float* half;
    static constexpr int first = 0, last = reach;
};
// `run` with taps of known reach where there are such.
template <class Run, int... reaches>
BRUME_INLINE bool withKnown(const Stretch& taps, Run run, std::integer_sequence<int, reaches...>) {
    return taps.first == 0 && ((taps.last == reaches && (run(Unrolled<reaches>{taps.half}), true)) || ...);
}
template <class Wide, int longest = longestUnrolled, class Run>
BRUME_INLINE void withTaps(const Stretch& taps, Run run) {
    if constexpr (Wide::isInOne)
        if (withKnown(taps, run, std::make_integer_sequence<int, std::min(longest, mostUnrolled) + 1>()))
            return;
    run(taps);
}

// a[k] = Σ half[t]·(load(k, -t) + load(k, t)), and half[0]·load(k, 0): t in `phases` rounds, each of every
// phases-th.
template <class Wide, int phases, class Vector, int count, class Taps, class Load>
BRUME_INLINE void sumPairs(Vector (&a)[count], const Taps& taps, Load load) {
    const float* const half = taps.half;
#pragma GCC unroll 8
    for (int k = 0; k < count; k++)
        a[k] = taps.first == 0 ? load(k, 0) * Wide::template spreadOne<Vector>(half[0]) : Vector{};
#pragma GCC unroll 4
    for (int phase = 0; phase < phases; phase++)
#pragma GCC unroll 32
        for (int t = taps.first + (phase > 0 || taps.first > 0 ? phase : phases); t <= taps.last;
             t += phases) {
            const Vector tap = Wide::template spreadOne<Vector>(half[t]);
#pragma GCC unroll 8
            for (int k = 0; k < count; k++) a[k] = Wide::fused(load(k, -t) + load(k, t), tap, a[k]);
        }
}

// out[i] = Σ half[|t|]·line[i + t], in pixels; past the caches where it `streams`, and then `out` begins
// where a line of the cache does. Meanwhile as many pixels are asked for from `soon` on, if any: writing
// alone leaves time to read. How many pixels are done.
template <class Wide, class Taps>
BRUME_INLINE int alongOf(float* out, const float* line, const Taps& taps, int pixels, bool streams,
                         const float* soon) {
    typedef typename Wide::Register Vector;
    constexpr int floats = sizeof(Vector) / 4, each = Wide::sums * floats / 4;
    int i = 0;
    for (; i + each <= pixels; i += each) {
        Vector a[Wide::sums];
        sumPairs<Wide, 4>(
            a, taps, [&](int k, int t) __attribute__((always_inline)) {
                return loaded<Vector>(line + 4 * (i + t) + floats * k);
            });
        for (int k = 0; k < 4 * each && soon; k += 16) __builtin_prefetch(soon + 4 * i + k, 0, 2);
        float* const to = out + 4 * i;
#pragma GCC unroll 8
        for (int k = 0; k < Wide::sums; k++)
            streams ? Wide::stream(to + floats * k, a[k]) : put(to + floats * k, a[k]);
    }
    return i;
}
template <class Wide>
BRUME_INLINE void firAlongShortBy(float* out, const float* line, const Stretch& taps, int pixels,
                                  bool streams, const float* soon) {
    int i = 0;
    withTaps<Wide>(
        taps, [&](const auto& known) __attribute__((always_inline)) {
            i = alongOf<Wide>(out, line, known, pixels, streams, soon);
        });
    for (; i < pixels; i++) {
        One a[1];
        sumPairs<Wide, 4>(
            a,
            taps, [&](int, int t) __attribute__((always_inline)) { return loaded<One>(line + 4 * (i + t)); });
        put(out + 4 * i, a[0]);
    }
}
BRUME_WIDE(void, firAlongShort,
           (float* out, const float* line, const Stretch& taps, int pixels, bool streams, const float* soon),
           (out, line, taps, pixels, streams, soon))

// `line` at output 0; reads `reach` pixels before it and behind the last.
static inline void firAlong(float* out, const float* line, const float* half, int reach, int pixels) {
    firAlongShort(out, line, {half, 0, std::min(reach, longestSum)}, pixels, false, nullptr);
    constexpr int stretch = 64;
    float sum[4 * stretch];
    for (int t = longestSum + 1; t <= reach; t += longestSum)
        for (int i = 0; i < pixels; i += stretch) {
            const int count = std::min(stretch, pixels - i);
            firAlongShort(sum, line + 4 * i, {half, t, std::min(reach, t + longestSum - 1)}, count, false,
                          nullptr);
            for (int k = 0; k < 4 * count; k++) out[4 * i + k] += sum[k];
        }
}

/// Rows that one call of firAcross may give.
constexpr int acrossRows = 8;

struct Unwatched {
    template <class Vector>
    BRUME_INLINE void look(const Vector&) {}
    BRUME_INLINE bool areFinite() const { return true; }
};

// out[k] = Σ half[|t|]·rows[k + t], these from float `from` on: each row, while it is in a register, serves
// all outputs.
template <class Wide, class Watch, int outputs, class Taps>
BRUME_INLINE bool acrossGroup(float* const* out, const float* const* rows, int from, const Taps& taps,
                              int floats) {
    auto sum = [&](auto& a, const auto& taps, int at) __attribute__((always_inline)) {
        typedef std::remove_reference_t<decltype(a[0])> Vector;
        sumPairs<Wide, 1>(
            a, taps, [&](int k, int t) __attribute__((always_inline)) {
                return loaded<Vector>(rows[k + t] + from + at);
            });
#pragma GCC unroll 8
        for (int k = 0; k < outputs; k++) put(out[k] + at, a[k]);
    };
    typedef typename Wide::Register Vector;
    constexpr int one = sizeof(Vector) / 4;
    Watch watch;
    int at = 0;
    for (; at + one <= floats; at += one) {
        Vector a[outputs];
        sum(a, taps, at);
#pragma GCC unroll 8
        for (int k = 0; k < outputs; k++) watch.look(a[k]);
    }
    bool areFinite = watch.areFinite();
    for (; at < floats; at += 4) {
        One a[outputs];
        sum(a, Stretch{taps.half, taps.first, taps.last}, at);
        for (int k = 0; k < outputs; k++)
            for (int c = 0; c < 4; c++)
                areFinite = areFinite && std::bit_cast<int>(std::abs(a[k][c])) <= mostAdded;
    }
    return areFinite;
}
template <class Wide, class Watch, int longest = longestUnrolled>
BRUME_INLINE bool acrossBy(float* const* out, int count, const float* const* rows, int from,
                           const Stretch& taps, int floats) {
    constexpr int most = Wide::sums;
    bool areFinite = true;
    int k = 0;
    for (; k + most <= count; k += most)
        withTaps<Wide, longest>(
            taps, [&](const auto& known) __attribute__((always_inline)) {
                areFinite &= acrossGroup<Wide, Watch, most>(out + k, rows + k, from, known, floats);
            });
    for (; k < count; k++) areFinite &= acrossGroup<Wide, Watch, 1>(out + k, rows + k, from, taps, floats);
    return areFinite;
}
template <class Wide>
BRUME_INLINE bool firAcrossShortBy(float* const* out, int count, const float* const* rows, int from,
                                   const Stretch& taps, int floats) {
    return acrossBy<Wide, typename Wide::Watch>(out, count, rows, from, taps, floats);
}
BRUME_WIDE(bool, firAcrossShort,
           (float* const* out, int count, const float* const* rows, int from, const Stretch& taps,
            int floats),
           (out, count, rows, from, taps, floats))

// For `count` <= acrossRows outputs, rows[0] at the first of them. Whether all that was summed up is finite.
static inline bool firAcross(float* const* out, int count, const float* const* rows, const float* half,
                             int reach, int floats) {
    bool areFinite = firAcrossShort(out, count, rows, 0, {half, 0, std::min(reach, longestSum)}, floats);
    constexpr int stretch = 256;
    float sums[acrossRows][stretch], *to[acrossRows];
    for (int k = 0; k < count; k++) to[k] = sums[k];
    for (int t = longestSum + 1; t <= reach; t += longestSum)
        for (int i = 0; i < floats; i += stretch) {
            const int width = std::min(stretch, floats - i);
            areFinite &=
                firAcrossShort(to, count, rows, i, {half, t, std::min(reach, t + longestSum - 1)}, width);
            for (int k = 0; k < count; k++)
                for (int x = 0; x < width; x++) out[k][i + x] += sums[k][x];
        }
    return areFinite;
}

}  // namespace blur
