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
template <class Vector>
BRUME_INLINE void transpose(Vector (&a)[4]) {
    Vector b[4];
    for (int k = 0; k < 2; k++) {
        b[k] = pixels<0, 4, 1, 5>(a[2 * k], a[2 * k + 1]);
        b[2 + k] = pixels<2, 6, 3, 7>(a[2 * k], a[2 * k + 1]);
    }
    for (int k = 0; k < 4; k += 2) {
        a[k] = pixels<0, 1, 4, 5>(b[k], b[k + 1]);
        a[k + 1] = pixels<2, 3, 6, 7>(b[k], b[k + 1]);
    }
}

// Eight rows of `count` pixels side by side. Whether all their values were finite.
template <class Wide>
BRUME_INLINE bool interleaveBy(float* lanes, const float* const* rows, int count) {
    typedef typename Wide::Four Four;
    typename Wide::Watch watch;
    int i = 0, most = 0;
    for (; i + 4 <= count; i += 4)
        for (int half = 0; half < 2; half++) {
            Four a[4];
            for (int k = 0; k < 4; k++) {
                __builtin_prefetch(rows[4 * half + k] + 4 * i + 64 * 4);
                a[k] = Wide::load(rows[4 * half + k] + 4 * i);
                watch.look(a[k]);
            }
            transpose(a);
            for (int k = 0; k < 4; k++) Wide::store(lanes + laneCount * (i + k) + 16 * half, a[k]);
        }
    for (; i < count; i++)
        for (int k = 0; k < 8; k++)
            for (int n = 0; n < 4; n++) {
                float x = lanes[laneCount * i + 4 * k + n] = rows[k][4 * i + n];
                most = std::max(most, std::bit_cast<int>(x) & 0x7fffffff);
            }
    return watch.areFinite() && most <= mostAdded;
}
BRUME_WIDE(bool, interleave, (float* lanes, const float* const* rows, int count), (lanes, rows, count))
// The other way, for the first `rowCount` rows.
template <class Wide>
BRUME_INLINE void separateBy(float* const* rows, int rowCount, const float* lanes, int count) {
    typedef typename Wide::Four Four;
    int i = 0;
    for (; i + 4 <= count; i += 4)
        for (int half = 0; half < 2; half++) {
            Four a[4];
            for (int k = 0; k < 4; k++) a[k] = Wide::load(lanes + laneCount * (i + k) + 16 * half);
            transpose(a);
            for (int k = 0; k < 4 && 4 * half + k < rowCount; k++)
                Wide::store(rows[4 * half + k] + 4 * i, a[k]);
        }
    for (; i < count; i++)
        for (int k = 0; k < rowCount; k++)
            *(One*)(rows[k] + 4 * i) = *(const One*)(lanes + laneCount * i + 4 * k);
}
BRUME_WIDE(void, separate, (float* const* rows, int rowCount, const float* lanes, int count),
           (rows, rowCount, lanes, count))
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
