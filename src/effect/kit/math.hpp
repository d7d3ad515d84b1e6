// fp32 elementary functions as plain branch-free code, which the compiler vectorises in a loop over pixels,
// and which gives the same bits on every machine. All are pure.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

/// Put before a function holding a hot loop: compiled for AVX-512, AVX2 and the baseline, chosen at load. The
/// helpers it calls must be inlined into it (BRUME_INLINE). Sanitizers cannot run the choosing code, so they
/// get one version.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && \
    defined(__OPTIMIZE__)
#define BRUME_VECTORISE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define BRUME_VECTORISE
#endif
#define BRUME_INLINE inline __attribute__((always_inline))

namespace brume {

/// Classes by bits: a compiler may assume that arithmetic never meets a NaN.
BRUME_INLINE bool isNan(float x) { return (std::bit_cast<uint32_t>(x) & 0x7fffffffu) > 0x7f800000u; }
BRUME_INLINE bool isInf(float x) { return (std::bit_cast<uint32_t>(x) & 0x7fffffffu) == 0x7f800000u; }

/// 2^n for whole n from -126 to 127.
BRUME_INLINE float powerOfTwo(int n) { return std::bit_cast<float>((n + 127) << 23); }

/// e^x - 1 for |x| ≤ .35, relative error 1e-7 (the minimax polynomial of Cephes' expf).
BRUME_INLINE float expm1Small(float x) {
    float p = 1.9875691500e-4f;
    p = p * x + 1.3981999507e-3f;
    p = p * x + 8.3334519073e-3f;
    p = p * x + 4.1665795894e-2f;
    p = p * x + 1.6666665459e-1f;
    p = p * x + 5.0000001201e-1f;
    return p * (x * x) + x;
}

/// √x for x of 0 to 1e38, relative error below 8e-7 for normal x and 0 for 0: a guess at 1/√x from the bits
/// and two steps of Newton's, their constants tuned so that errors lie on both sides. Beside a division it
/// costs little, where a square root waits for the same unit.
BRUME_INLINE float sqrtFast(float x) {
    const float half = 0.5f * x;
    float y = std::bit_cast<float>(0x5f3772ab - (std::bit_cast<int32_t>(x) >> 1));
    y = y * (1.50089753f - half * y * y);
    y = y * (1.5000006f - half * y * y);
    return x * y;
}

/// x = n·ln 2 + r, |r| ≤ .35: gives n and e^r - 1.
struct ReducedExp {
    int n;
    float expm1;
};
BRUME_INLINE ReducedExp reduceExp(float x) {
    const float shift = 12582912.0f;  // 1.5·2^23: adding it rounds to a whole number
    float shifted = x * 1.44269504f + shift;
    float n = shifted - shift;
    float r = x - n * 0.693359375f;  // ln 2 in two parts, the first exact in few bits
    r = r + n * 2.12194440e-4f;
    return {std::bit_cast<int>(shifted) - std::bit_cast<int>(shift), expm1Small(r)};
}

/// e^x, relative error below 2e-7, for x from -87 to 88; below that 0, above inf.
BRUME_INLINE float expFast(float x) {
    float inside = x < -87.0f ? -87.0f : (x > 88.0f ? 88.0f : x);
    ReducedExp e = reduceExp(inside);
    float scale = powerOfTwo(e.n);
    float value = scale + scale * e.expm1;
    value = x < -87.0f ? 0.0f : value;
    return x > 88.0f ? HUGE_VALF : value;
}

/// Transmittance e^-τ and opacity 1 - e^-τ, both to fp32's relative accuracy, for τ ≥ 0 (inf gives 0 and 1).
/// Opacity comes from the same polynomial: (1 - 2^n) - 2^n·(e^r - 1) does not cancel at small τ, where n = 0.
struct Extinction {
    float transmittance, opacity;
};
BRUME_INLINE Extinction extinctionOf(float opticalDepth) {
    float inside = opticalDepth < 87.0f ? opticalDepth : 87.0f;
    ReducedExp e = reduceExp(-inside);
    float scale = powerOfTwo(e.n);
    float transmittance = scale + scale * e.expm1;
    float opacity = (1.0f - scale) - scale * e.expm1;
    return {opticalDepth < 87.0f ? transmittance : 0.0f, opticalDepth < 87.0f ? opacity : 1.0f};
}

/// log2 x in two parts, n + fraction, |fraction| ≤ ½, for normal x > 0.
struct SplitLog2 {
    float n, fraction;
};
BRUME_INLINE SplitLog2 splitLog2(float x) {
    int bits = std::bit_cast<int>(x);
    int n = (bits - 0x3f3504f3) >> 23;  // mantissa in [√½, √2)
    float m = std::bit_cast<float>(bits - (n << 23)) - 1.0f;
    float p = 7.0376836292e-2f;  // Cephes' logf
    p = p * m - 1.1514610310e-1f;
    p = p * m + 1.1676998740e-1f;
    p = p * m - 1.2420140846e-1f;
    p = p * m + 1.4249322787e-1f;
    p = p * m - 1.6668057665e-1f;
    p = p * m + 2.0000714765e-1f;
    p = p * m - 2.4999993993e-1f;
    p = p * m + 3.3333331174e-1f;
    float square = m * m;
    float log = m + (p * m * square - 0.5f * square);
    return {float(n), log * 1.44269504f};
}
BRUME_INLINE float log2Fast(float x) {
    SplitLog2 log = splitLog2(x);
    return log.n + log.fraction;
}

/// 2^(n + r) for whole n and |r| ≤ ½, relative error 1e-7; 0 below 2^-126, inf from 2^127.5 on.
BRUME_INLINE float exp2Split(float n, float r) {
    float inside = n < -126.0f ? -126.0f : (n > 127.0f ? 127.0f : n);
    float scale = powerOfTwo(int(inside));
    float value = scale + scale * expm1Small(r * 0.693147181f);
    value = n < -126.0f ? 0.0f : value;
    return n > 127.0f ? HUGE_VALF : value;
}
/// The nearest whole number, for |x| < 2^22.
BRUME_INLINE float roundFast(float x) {
    const float shift = 12582912.0f;
    return (x + shift) - shift;
}
BRUME_INLINE float exp2Fast(float x) {
    float inside = x < -1000.0f ? -1000.0f : (x > 1000.0f ? 1000.0f : x);
    float n = roundFast(inside);
    return exp2Split(n, inside - n);
}

/// x^y for x ≥ 0, y > 0, relative error below 3e-7 for y up to 4 (then growing as y·1e-7): 0 at 0 (and below
/// fp32's normal numbers), inf at inf, NaN at NaN. The product y·log2 x is kept in a whole and a small part,
/// or its rounding would cost a bit for every doubling of the exponent.
BRUME_INLINE float powFast(float x, float y) {
    float inside = x < 1.17549435e-38f ? 1.17549435e-38f : (x > 3.4e38f ? 3.4e38f : x);
    SplitLog2 log = splitLog2(inside);
    float high = std::bit_cast<float>(std::bit_cast<uint32_t>(y) & 0xfffff000u);  // high·n is exact
    float whole = high * log.n;
    float n = roundFast(whole);
    float r = (whole - n) + ((y - high) * log.n + y * log.fraction);
    float more = roundFast(r);
    float value = exp2Split(n + more, r - more);
    value = x < 1.17549435e-38f ? 0.0f : value;
    value = x > 3.4e38f ? HUGE_VALF : value;
    return isNan(x) ? x : value;
}

/// sRGB's curve, odd and unclipped, for HDR and negative values alike.
BRUME_INLINE float encodeSrgb(float linear) {
    float x = std::fabs(linear);
    float curve = 1.055f * powFast(x, 1.0f / 2.4f) - 0.055f;
    return std::copysign(x <= 0.0031308f ? 12.92f * x : curve, linear);
}
BRUME_INLINE float decodeSrgb(float encoded) {
    float x = std::fabs(encoded);
    float curve = powFast((x + 0.055f) * (1.0f / 1.055f), 2.4f);
    return std::copysign(x <= 0.04045f ? x * (1.0f / 12.92f) : curve, encoded);
}

/// What fog leaves of scene colour: C·T, and 0 where T = 0 even for C = inf (or NaN).
BRUME_INLINE float attenuated(float color, float transmittance) {
    return (transmittance > 0.0f ? color : 0.0f) * transmittance;
}

}  // namespace brume
