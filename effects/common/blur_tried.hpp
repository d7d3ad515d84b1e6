// Short kernels tried on the captured picture, where bounds cannot say that their error does not show.
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "common/blur_design.hpp"
#include "effect/plan.hpp"

namespace blur {

/// Weights of the pixels from so many px before one to as many after it, along either axis: what a blur has,
/// a row for each pixel of a small one where it is decimated, and what is wanted.
struct ShortKernel {
    std::vector<std::vector<double>> rows;
    std::vector<double> wanted;

    int reach() const { return int(wanted.size()) / 2; }
    static std::vector<double> whole(const Half& half, int reach) {
        std::vector<double> weights(2 * size_t(reach) + 1, 0.);
        for (int t = -reach; t <= reach; t++)
            if (size_t(std::abs(t)) < half.size()) weights[size_t(t + reach)] = half[size_t(std::abs(t))];
        return weights;
    }
};

/// The rows of a decimated blur, out to `reach`: of pixels 0 to factor - 1 to the right of a small pixel.
inline std::vector<std::vector<double>> decimatedRows(const Decimation& d, const Half& small, int reach) {
    auto at = [](const Half& half, int t) {
        const auto k = size_t(std::abs(t));
        return k < half.size() ? half[k] : 0.;
    };
    const int smallReach = int(small.size()) - 1, before = int(d.prefilter.size()) - 1;
    std::vector<std::vector<double>> rows;
    for (int phase = 0; phase < d.factor; phase++) {
        std::vector<double> row(2 * size_t(reach) + 1, 0.);
        for (int m = -2; m <= 3; m++)
            for (int s = -smallReach; s <= smallReach; s++) {
                const double weight = at(d.enlarging, phase - m * d.factor) * at(small, s);
                const int center = (m + s) * d.factor - phase;
                for (int t = -before; t <= before; t++)
                    if (std::abs(center + t) <= reach)
                        row[size_t(center + t + reach)] += weight * at(d.prefilter, t);
            }
        rows.push_back(row);
    }
    return rows;
}

/// How far from what is wanted a kernel's blur looks at most within `area` of the picture, see
/// PlanInput::visible; in fp64.
inline double showsWithin(const brume::PlanInput& in, const ShortKernel& kernel, const cv::Rect& area) {
    const int reach = kernel.reach(), period = int(kernel.rows.size()), width = area.width + 2 * reach;
    const cv::Mat& image = in.color;
    cv::Mat source(area.height + 2 * reach, width, CV_64FC3);
    for (int j = 0; j < source.rows; j++)
        for (int i = 0; i < width; i++) {
            const auto& pixel = image.at<cv::Vec4f>(std::clamp(area.y + j - reach, 0, image.rows - 1),
                                                    std::clamp(area.x + i - reach, 0, image.cols - 1));
            for (int n = 0; n < 3; n++)
                source.at<cv::Vec3d>(j, i)[n] =
                    std::isnan(pixel[n]) ? 0. : std::clamp(double(pixel[n]), -65504., 65504.);
        }
    // Of each column's pixel and each tap: made by the rows, and wanted.
    const int floats = 3 * area.width, taps = 2 * reach + 1;
    std::vector<double> along[2], columns(3 * size_t(width)), sums[2];
    for (int k = 0; k < 2; k++)
        for (int t = 0; t < taps; t++)
            for (int i = 0; i < floats; i++)
                along[k].push_back(
                    (k ? kernel.wanted : kernel.rows[size_t((area.x + i / 3) % period)])[size_t(t)]);
    // Errors show most beside black: below this they show less than another does.
    double most = 0, least = 0;
    const double unseen = in.largestUnseen(0);
    auto add = [](double* to, const double* from, auto weight, int count) {
        for (int i = 0; i < count; i++) to[i] += from[i] * weight(i);
    };
    for (int y = 0; y < area.height; y++) {
        for (int k = 0; k < 2; k++) {
            const auto& down = k ? kernel.wanted : kernel.rows[size_t((area.y + y) % period)];
            columns.assign(columns.size(), 0.), sums[k].assign(size_t(floats), 0.);
            for (int t = 0; t < taps; t++)
                if (const double weight = down[size_t(t)]; weight != 0)
                    add(
                        columns.data(), source.ptr<double>(y + t), [=](int) { return weight; }, 3 * width);
            for (int t = 0; t < taps; t++) {
                const double* weights = along[k].data() + size_t(t) * size_t(floats);
                add(
                    sums[k].data(), columns.data() + 3 * t, [=](int i) { return weights[i]; }, floats);
            }
        }
        for (int i = 0; i < floats; i++) {
            const double made = sums[0][size_t(i)], wanted = sums[1][size_t(i)];
            if (std::abs(made - wanted) <= least) continue;
            most = std::max(most, in.visible(made, wanted));
            least = most / in.tolerance * unseen;
        }
    }
    return most;
}

}  // namespace blur
