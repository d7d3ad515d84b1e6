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
template <class Wide>
struct State {
    typedef typename Wide::Register Vector;
    static constexpr int floats = sizeof(Vector) / 4, count = laneCount / floats;
    Vector re[count], im[count];
};
// Before the edge all values are the edge's: state = -x/(pole - 1).
template <class Wide>
BRUME_INLINE void beginAt(State<Wide>& state, const float* edge, const float pole[4], float origin) {
    typedef typename Wide::Register Vector;
    const float re = pole[0] + (origin - 1), im = pole[1], scale = -1.0f / (re * re + im * im);
    for (int k = 0; k < state.count; k++) {
        Vector x = *(const Vector*)(edge + state.floats * k);
        state.re[k] = x * (re * scale);
        state.im[k] = x * (-im * scale);
    }
}
// to = Re(amplitude·state) and, if it `adds`, what was there; else center·from.
template <bool adds, class Wide>
BRUME_INLINE void advance(State<Wide>& state, float* to, const float* from, const float pole[4], float center,
                          float origin) {
    typedef typename Wide::Register Vector;
    const float dr = pole[0], di = pole[1], ar = pole[2], ai = pole[3];
    for (int k = 0; k < state.count; k++) {
        const int i = state.floats * k;
        Vector re = state.re[k], im = state.im[k], x = *(const Vector*)(from + i), base;
        if constexpr (adds) base = *(const Vector*)(to + i);
        if constexpr (!adds) base = center * x;
        *(Vector*)(to + i) = fused<Wide>(ar, re, fused<Wide>(-ai, im, base));
        state.re[k] = fused<Wide>(origin, re, fused<Wide>(dr, re, fused<Wide>(-di, im, x)));
        state.im[k] = fused<Wide>(origin, im, fused<Wide>(dr, im, di * re));
    }
}

// Both directions at once, one from each end: two chains of dependent sums hide each other's latency. Up to
// the middle each is the first at its place, behind it the second.
template <class Wide, bool adds>
BRUME_INLINE void exponential(float* out, const float* x, int count, const float pole[4], float center,
                              float origin) {
    State<Wide> right, left;
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

template <class Wide>
BRUME_INLINE void runLanesBy(float* out, const float* x, int count, const float* poles, int poleCount,
                             float center, float origin) {
    exponential<Wide, false>(out, x, count, poles, center, origin);
    for (int k = 1; k < poleCount; k++) exponential<Wide, true>(out, x, count, poles + 4 * k, center, origin);
}
BRUME_WIDE(void, runLanes,
           (float* out, const float* x, int count, const float* poles, int poleCount, float center,
            float origin),
           (out, x, count, poles, poleCount, center, origin))

/// `in` and `out` are CV_32FC4 of one size and do not overlap.
inline void recursiveBlur(const cv::Mat& in, cv::Mat& out, const Recursion& recursion) {
    const int poleCount = int(recursion.poles.size() / 4);
    filterLines(in, out, [&](float* y, const float* x, int count) {
        const TinyAsZero tinyAsZero;
        runLanes(y, x, count, recursion.poles.data(), poleCount, recursion.center, recursion.origin);
    });
}

}  // namespace blur
