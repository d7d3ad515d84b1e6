// Recursive blurs of RGBA images on the CPU: two-sided sums of exponentials, each a complex first-order
// recursion. Edges replicate exactly: on a constant the state is x/(1 - pole). Twin of recursion.glsl.
#pragma once

#include <span>

#include "common/filter_lines.hpp"
#include "common/tiny_as_zero.hpp"

namespace blur {

/// Numbers of Exponentials: packed, the centre tap, and what poles are counted from.
struct Recursion {
    std::span<const float> poles;
    float center = 1, origin = 1;
};

// One direction of one exponential over the lanes: state = Σ pole^(m - 1)·x[n ∓ m] over m ≥ 1.
struct State {
    Four re[laneCount / 16], im[laneCount / 16];
};
// Before the edge all values are the edge's: state = -x/(pole - 1).
BRUME_INLINE void beginAt(State& state, const float* edge, const float pole[4], float origin) {
    const float re = pole[0] + (origin - 1), im = pole[1], scale = -1.0f / (re * re + im * im);
    for (int k = 0; k < laneCount / 16; k++) {
        Four x = *(const Four*)(edge + 16 * k);
        state.re[k] = x * (re * scale);
        state.im[k] = x * (-im * scale);
    }
}
// to = Re(amplitude·state) and, if it `adds`, what was there; else center·from.
template <bool adds>
BRUME_INLINE void advance(State& state, float* to, const float* from, const float pole[4], float center,
                          float origin) {
    const float dr = pole[0], di = pole[1], ar = pole[2], ai = pole[3];
    for (int k = 0; k < laneCount / 16; k++) {
        Four re = state.re[k], im = state.im[k], x = *(const Four*)(from + 16 * k), base;
        if constexpr (adds) base = *(const Four*)(to + 16 * k);
        if constexpr (!adds) base = center * x;
        *(Four*)(to + 16 * k) = base + (ar * re - ai * im);
        state.re[k] = origin * re + ((dr * re - di * im) + x);
        state.im[k] = origin * im + (dr * im + di * re);
    }
}

// Both directions at once, one from each end: two chains of dependent sums hide each other's latency. Up to
// the middle each is the first at its place, behind it the second.
template <bool adds>
BRUME_INLINE void exponential(float* out, const float* x, int count, const float pole[4], float center,
                              float origin) {
    State right, left;
    auto at = [](int n) { return ptrdiff_t(laneCount) * n; };
    beginAt(right, x, pole, origin);
    beginAt(left, x + at(count - 1), pole, origin);
    int n = 0, m = count - 1;
    for (; n < m; n++, m--) {
        advance<adds>(right, out + at(n), x + at(n), pole, center, origin);
        advance<adds>(left, out + at(m), x + at(m), pole, center, origin);
    }
    if (n == m) {
        advance<adds>(right, out + at(n), x + at(n), pole, center, origin);
        advance<true>(left, out + at(m), x + at(m), pole, center, origin);
        n++, m--;
    }
    for (; n < count; n++, m--) {
        advance<true>(right, out + at(n), x + at(n), pole, center, origin);
        advance<true>(left, out + at(m), x + at(m), pole, center, origin);
    }
}

BRUME_VECTORISE static void runLanes(float* out, const float* x, int count, const float* poles, int poleCount,
                                     float center, float origin) {
    exponential<false>(out, x, count, poles, center, origin);
    for (int k = 1; k < poleCount; k++) exponential<true>(out, x, count, poles + 4 * k, center, origin);
}

/// `in` and `out` are CV_32FC4 of one size and do not overlap.
inline void recursiveBlur(const cv::Mat& in, cv::Mat& out, const Recursion& recursion) {
    const int poleCount = int(recursion.poles.size() / 4);
    filterLines(in, out, [&](float* y, const float* x, int count) {
        const TinyAsZero tinyAsZero;
        runLanes(y, x, count, recursion.poles.data(), poleCount, recursion.center, recursion.origin);
    });
}

}  // namespace blur
