// sRGB's curve of many values at once, and the vectors that the CPU half of light_detect works in.
#pragma once

#include <cmath>
#include <type_traits>

#include "common/four.hpp"
#include "effect/kit/math.hpp"

namespace light_detect {

// Vectors as long as registers are, what is looked up by their elements, and the way from planes to pixels.
struct Sixteen {
    typedef blur::Four Vector;
    typedef int Bits __attribute__((vector_size(64), aligned(4), may_alias));
    typedef unsigned Unsigned __attribute__((vector_size(64), aligned(4), may_alias));
    static constexpr int count = 16;
    // Of 32 numbers, the one that the last five bits say.
    static BRUME_INLINE Vector lookUp(const float* numbers, Bits which) {
        const auto* of = reinterpret_cast<const Vector*>(numbers);
        return __builtin_shuffle(of[0], of[1], which);
    }
    static BRUME_INLINE void toPixels(float* to, const float* planes, int stride) {
        const auto of = [&](int n) __attribute__((always_inline)) {
            return *reinterpret_cast<const Vector*>(planes + n * stride);
        };
        const Vector r = of(0), g = of(1), b = of(2), a = of(3);
        for (int half = 0; half < 2; half++) {
            const Bits two = {0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23};
            const Vector rg = __builtin_shuffle(r, g, two + 8 * half),
                         ba = __builtin_shuffle(b, a, two + 8 * half);
            const Bits four = {0, 1, 16, 17, 2, 3, 18, 19, 4, 5, 20, 21, 6, 7, 22, 23};
            *reinterpret_cast<Vector*>(to + 32 * half) = __builtin_shuffle(rg, ba, four);
            *reinterpret_cast<Vector*>(to + 32 * half + 16) = __builtin_shuffle(rg, ba, four + 8);
        }
    }
};
struct Eight {
    typedef blur::Two Vector;
    typedef int Bits __attribute__((vector_size(32), aligned(4), may_alias));
    typedef unsigned Unsigned __attribute__((vector_size(32), aligned(4), may_alias));
    static constexpr int count = 8;
    static BRUME_INLINE Vector lookUp(const float* numbers, Bits which) {
        const auto* of = reinterpret_cast<const Vector*>(numbers);
        const Bits isOdd = (which & 8) != 0, isHigh = (which & 16) != 0;
        const Vector low = isOdd ? __builtin_shuffle(of[1], which) : __builtin_shuffle(of[0], which),
                     high = isOdd ? __builtin_shuffle(of[3], which) : __builtin_shuffle(of[2], which);
        return isHigh ? high : low;
    }
    static BRUME_INLINE void toPixels(float* to, const float* planes, int stride) {
        typedef blur::One Pixel;
        for (int i = 0; i < count; i += 4) {
            const auto of = [&](int n) __attribute__((always_inline)) {
                return *reinterpret_cast<const Pixel*>(planes + n * stride + i);
            };
            const Pixel r = of(0), g = of(1), b = of(2), a = of(3);
            const Pixel rg = __builtin_shufflevector(r, g, 0, 4, 1, 5),
                        ba = __builtin_shufflevector(b, a, 0, 4, 1, 5),
                        rg2 = __builtin_shufflevector(r, g, 2, 6, 3, 7),
                        ba2 = __builtin_shufflevector(b, a, 2, 6, 3, 7);
            auto* pixel = reinterpret_cast<Pixel*>(to + 4 * i);
            pixel[0] = __builtin_shufflevector(rg, ba, 0, 1, 4, 5);
            pixel[1] = __builtin_shufflevector(rg, ba, 2, 3, 6, 7);
            pixel[2] = __builtin_shufflevector(rg2, ba2, 0, 1, 4, 5);
            pixel[3] = __builtin_shufflevector(rg2, ba2, 2, 3, 6, 7);
        }
    }
};
template <class Wide>
using Lanes = std::conditional_t<std::is_same_v<Wide, blur::Whole>, Sixteen, Eight>;

// sRGB's curve of values from 0 to 128, relative error 2e-7, for half the work of one of any value: of each
// half octave the reciprocal of its middle, and the middle's power, are looked up by the exponent's last four
// bits and the first of the mantissa; what is left is 1 + m, |m| ≤ .2, whose power is a polynomial (the least
// largest relative error).
struct Encoding {
    float reciprocal[32], power[32];
    Encoding() {
        for (int k = 0; k < 32; k++) {
            // Bits 22 to 26 of a float: an exponent of -9, from k = 12 on, to 6.
            const int exponent = (k / 2 + 10) % 16 - 9;
            reciprocal[k] = std::ldexp(k % 2 ? 4 / 7.f : 4 / 5.f, -exponent);
            power[k] = float(1.055 * std::pow(double(reciprocal[k]), -5 / 12.));
        }
    }
    template <class L>
    BRUME_INLINE typename L::Vector of(typename L::Vector x) const {
        typedef typename L::Vector Vector;
        const Vector least = Vector{} + 0.0031308f, a = x > least ? x : least;
        const typename L::Bits half = (typename L::Bits)a >> 22;
        const Vector m = a * L::lookUp(reciprocal, half) - 1.0f, m2 = m * m;
        const Vector even = (-0.0428257658f * m2 - 0.121506561f) * m2 + 0.99999995f,
                     odd = (0.0313980601f * m2 + 0.0640931701f) * m2 + 0.416667f;
        const Vector curve = (even + m * odd) * L::lookUp(power, half) - 0.055f;
        return x > least ? curve : 12.92f * x;
    }
};

}  // namespace light_detect
