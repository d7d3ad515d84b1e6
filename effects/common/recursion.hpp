// Recursive blurs of RGBA images on the CPU: two-sided sums of exponentials, each a complex first-order
// recursion in delta form. Edges replicate exactly: on a constant the state is x/(1 - pole). Twin of
// recursion.glsl.
#pragma once

#include <span>

#include "common/filter_lines.hpp"
#include "common/tiny_as_zero.hpp"

namespace blur {

/// Numbers of Exponentials::packed, and the centre tap.
struct Recursion {
    std::span<const float> poles;
    float center = 1;
};

// One direction of one exponential over the lanes: state = Σ pole^(m - 1)·x[n ∓ m] over m ≥ 1, in delta form.
struct State {
    Four re[laneCount / 16], im[laneCount / 16];
};
// Before the edge all values are the edge's: state = -x/(pole - 1).
BRUME_INLINE void beginAt(State& state, const float* edge, const float pole[4]) {
    const float scale = -1.0f / (pole[0] * pole[0] + pole[1] * pole[1]);
    for (int k = 0; k < laneCount / 16; k++) {
        Four x = *(const Four*)(edge + 16 * k);
        state.re[k] = x * (pole[0] * scale);
        state.im[k] = x * (-pole[1] * scale);
    }
}
// to = Re(amplitude·state) and, if it `adds`, what was there; else center·from.
template <bool adds>
BRUME_INLINE void advance(State& state, float* to, const float* from, const float pole[4], float center) {
    const float dr = pole[0], di = pole[1], ar = pole[2], ai = pole[3];
    for (int k = 0; k < laneCount / 16; k++) {
        Four re = state.re[k], im = state.im[k], x = *(const Four*)(from + 16 * k), base;
        if constexpr (adds) base = *(const Four*)(to + 16 * k);
        if constexpr (!adds) base = center * x;
        *(Four*)(to + 16 * k) = base + (ar * re - ai * im);
        state.re[k] = re + ((dr * re - di * im) + x);
        state.im[k] = im + (dr * im + di * re);
    }
}

// Both directions at once, one from each end: two chains of dependent sums hide each other's latency. Up to
// the middle each is the first at its place, behind it the second.
template <bool adds>
BRUME_INLINE void exponential(float* out, const float* x, int count, const float pole[4], float center) {
    State right, left;
    auto at = [](int n) { return ptrdiff_t(laneCount) * n; };
    beginAt(right, x, pole);
    beginAt(left, x + at(count - 1), pole);
    int n = 0, m = count - 1;
    for (; n < m; n++, m--) {
        advance<adds>(right, out + at(n), x + at(n), pole, center);
        advance<adds>(left, out + at(m), x + at(m), pole, center);
    }
    if (n == m) {
        advance<adds>(right, out + at(n), x + at(n), pole, center);
        advance<true>(left, out + at(m), x + at(m), pole, center);
        n++, m--;
    }
    for (; n < count; n++, m--) {
        advance<true>(right, out + at(n), x + at(n), pole, center);
        advance<true>(left, out + at(m), x + at(m), pole, center);
    }
}

BRUME_VECTORISE static void runLanes(float* out, const float* x, int count, const float* poles, int poleCount,
                                     float center) {
    exponential<false>(out, x, count, poles, center);
    for (int k = 1; k < poleCount; k++) exponential<true>(out, x, count, poles + 4 * k, center);
}

/// `in` and `out` are CV_32FC4 of one size and do not overlap.
inline void recursiveBlur(const cv::Mat& in, cv::Mat& out, const Recursion& recursion) {
    const int poleCount = int(recursion.poles.size() / 4);
    filterLines(in, out, [&](float* y, const float* x, int count) {
        const TinyAsZero tinyAsZero;
        runLanes(y, x, count, recursion.poles.data(), poleCount, recursion.center);
    });
}

}  // namespace blur
