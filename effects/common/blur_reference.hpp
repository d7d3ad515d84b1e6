// The fp64 reference of a separable blur: every weight of both axes, NaN as 0 and ±inf as ±65504.
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "effect/plugin.hpp"

namespace blur {

/// The weights of a symmetric kernel, from its middle on, which sum to `sum`: for each pixel of a line those
/// of all pixels; what lies beyond an edge is added to the edge's.
inline std::vector<std::vector<double>> blurMatrix(const std::vector<double>& weight, double sum,
                                                   int length) {
    const int far = int(weight.size()) - 1;
    std::vector<std::vector<double>> matrix(length, std::vector<double>(length, 0));
    for (int to = 0; to < length; to++)
        for (int d = -far; d <= far; d++)
            matrix[to][std::clamp(to + d, 0, length - 1)] += weight[std::abs(d)] / sum;
    return matrix;
}

/// `matrixOf(length)` blurs a line; `errorAt(pixel)` is how far the method may be off there, of the largest
/// input.
template <class MatrixOf, class ErrorAt>
void separableReference(const brume::ReferenceContext& c, std::span<const cv::Point> pixels,
                        std::span<brume::ReferencePixel> truth, MatrixOf matrixOf, ErrorAt errorAt) {
    const int width = c.input.cols, height = c.input.rows;
    const auto across = matrixOf(width), down = matrixOf(height);
    auto bounded = [](float x) {
        return std::isnan(x) ? 0. : std::isinf(x) ? std::copysign(65504., double(x)) : double(x);
    };
    double largest = 1;
    std::vector<cv::Vec4d> image(size_t(width) * height), rows(image.size());
    for (int j = 0; j < height; j++)
        for (int i = 0; i < width; i++)
            for (int n = 0; n < 4; n++) {
                double x = image[size_t(j) * width + i][n] = bounded(c.input.at<cv::Vec4f>(j, i)[n]);
                largest = std::max(largest, std::abs(x));
            }
    std::vector<bool> isAsked(width);  // columns
    for (const cv::Point& pixel : pixels) isAsked[pixel.x] = true;
    for (int i = 0; i < width; i++)
        for (int j = 0; isAsked[i] && j < height; j++)
            for (int k = 0; k < width; k++)
                if (across[i][k] != 0)
                    rows[size_t(j) * width + i] += across[i][k] * image[size_t(j) * width + k];
    for (size_t k = 0; k < pixels.size(); k++) {
        cv::Vec4d sum;
        for (int j = 0; j < height; j++) sum += down[pixels[k].y][j] * rows[size_t(j) * width + pixels[k].x];
        truth[k].color = sum;
        truth[k].scale = largest;
        truth[k].methodError = errorAt(pixels[k]) * largest;
    }
}

}  // namespace blur
