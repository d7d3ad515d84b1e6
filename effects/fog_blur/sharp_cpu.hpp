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

// Finite colour, and a weight of 1.
BRUME_INLINE Four sharpened(Four color) {
    typedef int Bits __attribute__((vector_size(64)));
    const Bits x = (Bits)color, magnitude = x & 0x7fffffff, zero = {};
    const Bits largest = (x & int(0x80000000)) | std::bit_cast<int>(65504.0f);
    Bits bounded = magnitude == 0x7f800000 ? largest : x;
    bounded = magnitude > 0x7f800000 ? zero : bounded;
    return __builtin_shufflevector((Four)bounded, Four{} + 1.0f, 0, 1, 2, 19, 4, 5, 6, 23, 8, 9, 10, 27, 12,
                                   13, 14, 31);
}
BRUME_INLINE blur::Two sharpened(blur::Two color) {
    typedef int Bits __attribute__((vector_size(32)));
    const Bits x = (Bits)color, magnitude = x & 0x7fffffff, zero = {};
    const Bits largest = (x & int(0x80000000)) | std::bit_cast<int>(65504.0f);
    Bits bounded = magnitude == 0x7f800000 ? largest : x;
    bounded = magnitude > 0x7f800000 ? zero : bounded;
    return __builtin_shufflevector((blur::Two)bounded, blur::Two{} + 1.0f, 0, 1, 2, 11, 4, 5, 6, 15);
}
BRUME_INLINE blur::Pair sharpened(blur::Pair color) { return {sharpened(color.low), sharpened(color.high)}; }

BRUME_INLINE One sharpened(One color) {
    const blur::Two twice = __builtin_shufflevector(color, color, 0, 1, 2, 3, 0, 1, 2, 3),
                    both = sharpened(twice);
    return __builtin_shufflevector(both, both, 0, 1, 2, 3);
}
// Of finite pixels.
BRUME_INLINE Four withWeight(Four color) {
    return __builtin_shufflevector(color, Four{} + 1.0f, 0, 1, 2, 19, 4, 5, 6, 23, 8, 9, 10, 27, 12, 13, 14,
                                   31);
}
BRUME_INLINE blur::Two withWeight(blur::Two color) {
    return __builtin_shufflevector(color, blur::Two{} + 1.0f, 0, 1, 2, 11, 4, 5, 6, 15);
}
BRUME_INLINE blur::Pair withWeight(const blur::Pair& color) {
    return {withWeight(color.low), withWeight(color.high)};
}

// As a rule all of a row is finite.
template <class Wide>
BRUME_INLINE void sharpenBy(float* out, const float* color, int count) {
    typename Wide::Watch watch;
    int i = 0;
    for (; i + 4 <= count; i += 4) {
        const auto pixels = Wide::load(color + 4 * i);
        watch.look(pixels);
        Wide::store(out + 4 * i, withWeight(pixels));
    }
    if (!watch.areFinite())
        for (int k = 0; k < i; k += 4) Wide::store(out + 4 * k, sharpened(Wide::load(color + 4 * k)));
    for (; i < count; i++) *(One*)(out + 4 * i) = sharpened(*(const One*)(color + 4 * i));
}
BRUME_WIDE(void, sharpen, (float* out, const float* color, int count), (out, color, count))

// Each pixel's four channels times a number of its own.
template <class Wide>
BRUME_INLINE void multiplyBy(float* out, const float* sharp, const float* weights, int count) {
    int i = 0;
    for (; i + 4 <= count; i += 4)
        Wide::store(out + 4 * i, Wide::load(sharp + 4 * i) * Wide::spread(weights + i));
    for (; i < count; i++) *(One*)(out + 4 * i) = *(const One*)(sharp + 4 * i) * weights[i];
}
BRUME_WIDE(void, multiply, (float* out, const float* sharp, const float* weights, int count),
           (out, sharp, weights, count))

// What a blur of `sigma` takes of sharp pixels: colour times weight, and the weight. count <= widestWeighed.
constexpr int widestWeighed = 256;
[[maybe_unused]] BRUME_VECTORISE static void weigh(float* out, const float* sharp, const float* sigmas,
                                                   float sigma, int count) {
    const float inverse = 1.0f / sigma;
    float weights[widestWeighed];
    for (int i = 0; i < count; i++) weights[i] = std::min(sigmas[i] * inverse, 1.0f);
    multiply(out, sharp, weights, count);
}

}  // namespace fog_blur
