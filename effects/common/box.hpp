// Extended boxes by running sums, on the CPU; edges replicate. Twin of box() in gaussian_blur.fs.
#pragma once

#include <algorithm>
#include <array>
#include <utility>

#include "common/filter_lines.hpp"

namespace blur {

/// 2·reach + 1 px of weight `inner` and one more on each side of weight `outer`.
struct Box {
    int reach = 0;
    float inner = 1, outer = 0;
};

// The sum is kept in fp64, so that a bright pixel leaves nothing behind when it leaves the box.
BRUME_VECTORISE static void boxLanes(float* out, const float* x, int count, Box box) {
    auto at = [&](int n) { return x + laneCount * std::clamp(n, 0, count - 1); };
    double sum[laneCount] = {};
    for (int t = -box.reach; t <= box.reach; t++) {
        const float* from = at(t);
        for (int k = 0; k < laneCount; k++) sum[k] += double(from[k]);
    }
    const double inner = double(box.inner), outer = double(box.outer);
    for (int n = 0; n < count; n++) {
        const float *next = at(n + box.reach + 1), *before = at(n - box.reach - 1),
                    *leaving = at(n - box.reach);
        for (int k = 0; k < laneCount; k++) {
            out[laneCount * n + k] = float(inner * sum[k] + outer * (double(before[k]) + double(next[k])));
            sum[k] += double(next[k]) - double(leaving[k]);
        }
    }
}

/// Three boxes along rows, then along columns. `in` and `out` are CV_32FC4 of one size and do not overlap.
inline void boxBlur(const cv::Mat& in, cv::Mat& out, Box box) {
    filterLines(in, out, [&](float* y, const float* x, int count) {
        Scratch between(size_t(laneCount) * count);
        boxLanes(y, x, count, box);
        boxLanes(between.data(), y, count, box);
        boxLanes(y, between.data(), count, box);
    });
}

}  // namespace blur
