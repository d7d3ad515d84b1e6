// Filters that run along whole rows, then whole columns, of RGBA images on the CPU: eight neighbouring lines
// side by side, each a vector lane a channel.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "common/blur_lines.hpp"

namespace blur {

constexpr int laneCount = 32;  // floats that run side by side: eight pixels

/// `filter(out, x, count)` is given `count` pixels of eight lines, interleaved: laneCount floats a step. `in`
/// and `out` are CV_32FC4 of one size and do not overlap.
template <class Filter>
void filterLines(const cv::Mat& in, cv::Mat& out, Filter filter) {
    const int width = in.cols, height = in.rows, group = laneCount / 4;
    const double stripes = 2 * cv::getNumThreads();  // few: each takes fresh memory
    cv::parallel_for_(
        cv::Range(0, (height + group - 1) / group),
        [&](const cv::Range& range) {
            std::vector<float> x(size_t(laneCount) * width), y(x.size()), finite(4 * size_t(width));
            for (int g = range.start; g < range.end; g++) {
                for (int k = 0; k < group; k++) {
                    const float* row = in.ptr<float>(std::min(g * group + k, height - 1));
                    if (!allFinite(row, 4 * width))
                        copyFinite(finite.data(), row, 4 * width), row = finite.data();
                    for (int i = 0; i < width; i++)
                        *(One*)(&x[laneCount * i + 4 * k]) = *(const One*)(row + 4 * i);
                }
                filter(y.data(), x.data(), width);
                for (int k = 0; k < group && g * group + k < height; k++) {
                    float* row = out.ptr<float>(g * group + k);
                    for (int i = 0; i < width; i++)
                        *(One*)(row + 4 * i) = *(const One*)(&y[laneCount * i + 4 * k]);
                }
            }
        },
        stripes);
    // Columns: several groups at a time, because a cache line or two of each row are too little to fetch. A
    // group's result goes where the group before it was.
    const int groups = 4, wide = groups * group;
    cv::parallel_for_(
        cv::Range(0, (width + wide - 1) / wide),
        [&](const cv::Range& range) {
            std::vector<float> lanes[groups + 1];
            for (auto& x : lanes) x.resize(size_t(laneCount) * height);
            for (int block = range.start; block < range.end; block++) {
                int first = block * wide, count = (std::min(wide, width - first) + group - 1) / group;
                auto bytes = [&](int g) { return 16 * size_t(std::min(group, width - first - g * group)); };
                for (int j = 0; j < height; j++)
                    for (int g = 0; g < count; g++)
                        std::memcpy(&lanes[g][laneCount * j], out.ptr<float>(j) + 4 * first + laneCount * g,
                                    bytes(g));
                for (int g = 0; g < count; g++)
                    filter(lanes[(g + groups) % (groups + 1)].data(), lanes[g].data(), height);
                for (int j = 0; j < height; j++)
                    for (int g = 0; g < count; g++)
                        std::memcpy(out.ptr<float>(j) + 4 * first + laneCount * g,
                                    &lanes[(g + groups) % (groups + 1)][laneCount * j], bytes(g));
            }
        },
        stripes);
}

}  // namespace blur
