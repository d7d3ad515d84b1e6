// What fog_blur blurs, on the CPU: finite colours, and what a blur of one standard deviation takes of them.
#pragma once

#include <bit>
#include <cstring>
#include <opencv2/core.hpp>

#include "common/blur_lines.hpp"

namespace fog_blur {

using blur::Four;
using blur::One;

/// The picture to blur, and each pixel's standard deviation, CV_32F px.
struct Source {
    cv::Mat color, sigma;
};

// One number a pixel, four times each; reads twelve more (GCC 12 takes a load of four through memory).
constexpr int spreadMargin = 12;
BRUME_INLINE Four spread(const float* numbers) {
    Four a = *(const Four*)numbers;
    return __builtin_shufflevector(a, a, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3);
}

// Finite colour, and a weight of 1.
BRUME_VECTORISE static void sharpen(float* out, const float* color, int count) {
    for (int i = 0; i < 4 * count; i++) {
        float x = color[i], bounded = std::fabs(x) > 3.4028235e38f ? std::copysign(65504.0f, x) : x;
        bounded = x == x ? bounded : 0.0f;
        out[i] = (i & 3) == 3 ? 1.0f : bounded;
    }
}

// Each pixel's four channels times a number of its own; reads spreadMargin numbers more.
BRUME_VECTORISE static void multiply(float* out, const float* sharp, const float* weights, int count) {
    int i = 0;
    for (; i + 4 <= count; i += 4)
        *(Four*)(out + 4 * i) = *(const Four*)(sharp + 4 * i) * spread(weights + i);
    for (; i < count; i++) *(One*)(out + 4 * i) = *(const One*)(sharp + 4 * i) * weights[i];
}

// What a blur of `sigma` takes of sharp pixels: colour times weight, and the weight. count <= widestWeighed.
constexpr int widestWeighed = 256;
BRUME_VECTORISE static void weigh(float* out, const float* sharp, const float* sigmas, float sigma,
                                  int count) {
    const float inverse = 1.0f / sigma;
    float weights[widestWeighed + spreadMargin];
    for (int i = 0; i < count; i++) weights[i] = std::min(sigmas[i] * inverse, 1.0f);
    multiply(out, sharp, weights, count);
}

// A row's sharp pixels and their standard deviations from column `first` on, beyond the edges replicated;
// meanwhile the deviations of row y + `ahead` are asked for.
inline void sharpReplicated(float* sharp, float* sigmas, const Source& source, int y, int first, int count,
                            int ahead) {
    const float *color = source.color.ptr<float>(y), *sigma = source.sigma.ptr<float>(y);
    const int width = source.color.cols, soon = std::min(y + ahead, source.color.rows - 1);
    int inside0 = std::clamp(first, 0, width), inside1 = std::clamp(first + count, inside0, width);
    const float* nextSigma = source.sigma.ptr<float>(soon);
    for (int x = inside0; x < inside1; x += 16) __builtin_prefetch(nextSigma + x);
    sharpen(sharp + 4 * (inside0 - first), color + 4 * inside0, inside1 - inside0);
    std::copy(sigma + inside0, sigma + inside1, sigmas + (inside0 - first));
    float left[4], right[4];
    sharpen(left, color, 1);
    sharpen(right, color + 4 * (width - 1), 1);
    for (int i = 0; i < std::min(count, -first); i++)
        std::memcpy(sharp + 4 * i, left, sizeof left), sigmas[i] = sigma[0];
    for (int i = std::max(0, width - first); i < count; i++)
        std::memcpy(sharp + 4 * i, right, sizeof right), sigmas[i] = sigma[width - 1];
}

}  // namespace fog_blur
