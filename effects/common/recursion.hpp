// Recursive blurs of RGBA images on the CPU: two-sided sums of exponentials, each a complex first-order
// recursion in delta form. Edges replicate exactly: on a constant the state is x/(1 - pole). Twin of
// recursion.glsl.
#pragma once

#include <span>

#include "common/filter_lines.hpp"

namespace blur {

/// Numbers of Exponentials::packed, and the centre tap.
struct Recursion {
    std::span<const float> poles;
    float center = 1;
};

// out[n] += Re(amplitude·state), state = Σ pole^(m - 1)·x[n ∓ m] over m ≥ 1; `step` is +1 or -1.
BRUME_VECTORISE static void addExponential(float* out, const float* x, int count, int step,
                                           const float pole[4]) {
    const float dr = pole[0], di = pole[1], ar = pole[2], ai = pole[3];
    const int first = step > 0 ? 0 : count - 1;
    // Before the edge all values are the edge's: state = -x/(pole - 1).
    const float scale = -1.0f / (dr * dr + di * di);
    Two sr[4], si[4];
    for (int k = 0; k < 4; k++) {
        Two edge = *(const Two*)(x + laneCount * first + 8 * k);
        sr[k] = edge * (dr * scale);
        si[k] = edge * (-di * scale);
    }
    for (int n = 0; n < count; n++) {
        const float* from = x + laneCount * (first + step * n);
        float* to = out + laneCount * (first + step * n);
        for (int k = 0; k < 4; k++) {
            *(Two*)(to + 8 * k) += ar * sr[k] - ai * si[k];
            Two r = (dr * sr[k] - di * si[k]) + *(const Two*)(from + 8 * k);
            Two i = dr * si[k] + di * sr[k];
            sr[k] += r;
            si[k] += i;
        }
    }
}

BRUME_VECTORISE static void scaleLanes(float* out, const float* x, float center, int floats) {
    for (int i = 0; i < floats; i++) out[i] = center * x[i];
}

inline void runLanes(float* out, const float* x, int count, const Recursion& recursion) {
    scaleLanes(out, x, recursion.center, laneCount * count);
    for (size_t k = 0; k + 4 <= recursion.poles.size(); k += 4)
        for (int step : {1, -1}) addExponential(out, x, count, step, &recursion.poles[k]);
}

/// `in` and `out` are CV_32FC4 of one size and do not overlap.
inline void recursiveBlur(const cv::Mat& in, cv::Mat& out, const Recursion& recursion) {
    filterLines(in, out, [&](float* y, const float* x, int count) { runLanes(y, x, count, recursion); });
}

}  // namespace blur
