// Filters that run along whole rows, then whole columns, of RGBA images on the CPU: eight neighbouring lines
// side by side, each a vector lane a channel.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "common/blur_lines.hpp"
#include "common/scratch.hpp"

namespace blur {

constexpr int laneCount = 32;  // floats that run side by side: eight pixels

// Exchanges rows and columns of a 4×4 square of pixels.
BRUME_INLINE void transpose(Four (&a)[4]) {
    Four b[4];
    for (int k = 0; k < 2; k++) {
        b[k] = __builtin_shufflevector(a[2 * k], a[2 * k + 1], 0, 1, 2, 3, 16, 17, 18, 19, 4, 5, 6, 7, 20, 21,
                                       22, 23);
        b[2 + k] = __builtin_shufflevector(a[2 * k], a[2 * k + 1], 8, 9, 10, 11, 24, 25, 26, 27, 12, 13, 14,
                                           15, 28, 29, 30, 31);
    }
    for (int k = 0; k < 4; k += 2) {
        a[k] =
            __builtin_shufflevector(b[k], b[k + 1], 0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23);
        a[k + 1] = __builtin_shufflevector(b[k], b[k + 1], 8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28,
                                           29, 30, 31);
    }
}

// Eight rows of `count` pixels side by side. Whether all their values were finite.
BRUME_VECTORISE static bool interleave(float* lanes, const float* const rows[8], int count) {
    typedef int Bits __attribute__((vector_size(64), may_alias));
    Bits largest = {};
    int i = 0, most = 0;
    for (; i + 4 <= count; i += 4)
        for (int half = 0; half < 2; half++) {
            Four a[4];
            for (int k = 0; k < 4; k++) {
                __builtin_prefetch(rows[4 * half + k] + 4 * i + 64 * 4);
                a[k] = *(const Four*)(rows[4 * half + k] + 4 * i);
                Bits bits = (Bits)a[k] & 0x7fffffff;
                largest = bits > largest ? bits : largest;
            }
            transpose(a);
            for (int k = 0; k < 4; k++) *(Four*)(lanes + laneCount * (i + k) + 16 * half) = a[k];
        }
    for (int k = 0; k < 16; k++) most = std::max(most, largest[k]);
    for (; i < count; i++)
        for (int k = 0; k < 8; k++)
            for (int n = 0; n < 4; n++) {
                float x = lanes[laneCount * i + 4 * k + n] = rows[k][4 * i + n];
                most = std::max(most, std::bit_cast<int>(x) & 0x7fffffff);
            }
    return most < 0x7f800000;
}
// The other way, for the first `rowCount` rows.
BRUME_VECTORISE static void separate(float* const* rows, int rowCount, const float* lanes, int count) {
    int i = 0;
    for (; i + 4 <= count; i += 4)
        for (int half = 0; half < 2; half++) {
            Four a[4];
            for (int k = 0; k < 4; k++) a[k] = *(const Four*)(lanes + laneCount * (i + k) + 16 * half);
            transpose(a);
            for (int k = 0; k < 4 && 4 * half + k < rowCount; k++)
                *(Four*)(rows[4 * half + k] + 4 * i) = a[k];
        }
    for (; i < count; i++)
        for (int k = 0; k < rowCount; k++)
            *(One*)(rows[k] + 4 * i) = *(const One*)(lanes + laneCount * i + 4 * k);
}
BRUME_VECTORISE static void copyLanes(float* out, const float* in) {
    *(Two*)out = *(const Two*)in;
    *(Two*)(out + 8) = *(const Two*)(in + 8);
    *(Two*)(out + 16) = *(const Two*)(in + 16);
    *(Two*)(out + 24) = *(const Two*)(in + 24);
}

/// `filter(out, x, count)` is given `count` pixels of eight lines, interleaved: laneCount floats a step. `in`
/// and `out` are CV_32FC4 of one size and do not overlap.
template <class Filter>
void filterLines(const cv::Mat& in, cv::Mat& out, Filter filter) {
    const int width = in.cols, height = in.rows, group = laneCount / 4;
    const double stripes = 2 * cv::getNumThreads();  // few: each takes fresh memory
    cv::parallel_for_(
        cv::Range(0, (height + group - 1) / group),
        [&](const cv::Range& range) {
            const size_t floats = size_t(laneCount) * width;
            Scratch x(floats), y(floats);
            for (int g = range.start; g < range.end; g++) {
                const int count = std::min(group, height - g * group);
                const float* from[8];
                float* to[8];
                for (int k = 0; k < 8; k++) from[k] = in.ptr<float>(g * group + std::min(k, count - 1));
                for (int k = 0; k < count; k++) to[k] = out.ptr<float>(g * group + k);
                if (!interleave(x.data(), from, width)) copyFinite(x.data(), x.data(), int(floats));
                filter(y.data(), x.data(), width);
                separate(to, count, y.data(), width);
            }
        },
        stripes);
    // Columns: several groups at a time, because a cache line or two of each row are too little to fetch. A
    // group's result goes where the group before it was.
    const int groups = 4, wide = groups * group;
    cv::parallel_for_(
        cv::Range(0, (width + wide - 1) / wide),
        [&](const cv::Range& range) {
            std::vector<Scratch> lanes;
            for (int g = 0; g <= groups; g++) lanes.emplace_back(size_t(laneCount) * height);
            for (int block = range.start; block < range.end; block++) {
                int first = block * wide, count = (std::min(wide, width - first) + group - 1) / group;
                auto bytes = [&](int g) { return 16 * size_t(std::min(group, width - first - g * group)); };
                auto copy = [&](float* to, const float* from, int g) {
                    if (bytes(g) == 4 * laneCount)
                        copyLanes(to, from);
                    else
                        std::memcpy(to, from, bytes(g));
                };
                for (int j = 0; j < height; j++) {
                    const float* soon = out.ptr<float>(std::min(j + 8, height - 1)) + 4 * first;
                    for (int g = 0; g < 2 * count; g++) __builtin_prefetch(soon + 16 * g);
                    for (int g = 0; g < count; g++)
                        copy(lanes[g].data() + laneCount * j, out.ptr<float>(j) + 4 * first + laneCount * g,
                             g);
                }
                for (int g = 0; g < count; g++)
                    filter(lanes[(g + groups) % (groups + 1)].data(), lanes[g].data(), height);
                for (int j = 0; j < height; j++)
                    for (int g = 0; g < count; g++)
                        copy(out.ptr<float>(j) + 4 * first + laneCount * g,
                             lanes[(g + groups) % (groups + 1)].data() + laneCount * j, g);
            }
        },
        stripes);
}

}  // namespace blur
