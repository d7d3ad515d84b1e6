// Writing past the caches: an image too large to be in them when it is read again needs no reading before it
// is written.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <opencv2/core/mat.hpp>

#include "common/four.hpp"
#include "effect/kit/math.hpp"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace brume {

// Whole pixels of 16 bytes, `to` aligned to them.
#if defined(__SSE2__)
inline void streamNarrow(float* to, const float* from, size_t floats) {
    for (size_t i = 0; i < floats; i += 4) _mm_stream_ps(to + i, _mm_loadu_ps(from + i));
}
__attribute__((target("avx512f"))) inline void streamWide(float* to, const float* from, size_t floats) {
    const size_t head = std::min(floats, (64 - reinterpret_cast<uintptr_t>(to) % 64) % 64 / 4);
    streamNarrow(to, from, head);
    size_t i = head;
    for (; i + 16 <= floats; i += 16) _mm512_stream_ps(to + i, _mm512_loadu_ps(from + i));
    streamNarrow(to + i, from + i, floats - i);
}
#endif

/// Whether streamPlanes writes past the caches here.
inline bool canStreamPlanes() {
#if defined(__SSE2__)
    return true;
#else
    return false;
#endif
}

/// Writes four planes, `stride` floats apart, as pixels of 16 bytes, `to` aligned to them, past the caches.
/// Only where canStreamPlanes(); the thread that did ends with streamEnd().
#if defined(__SSE2__)
__attribute__((noinline)) inline void streamPlanesNarrow(float* to, const float* plane, int stride,
                                                         int count) {
    int i = 0;
    for (; i + 4 <= count; i += 4) {
        const float* from = plane + i;
        __m128 r = _mm_loadu_ps(from), g = _mm_loadu_ps(from + stride), b = _mm_loadu_ps(from + 2 * stride),
               a = _mm_loadu_ps(from + 3 * stride);
        _MM_TRANSPOSE4_PS(r, g, b, a);
        _mm_stream_ps(to + 4 * i, r), _mm_stream_ps(to + 4 * i + 4, g);
        _mm_stream_ps(to + 4 * i + 8, b), _mm_stream_ps(to + 4 * i + 12, a);
    }
    for (; i < count; i++)
        for (int n = 0; n < 4; n++) to[4 * i + n] = plane[n * stride + i];
}
__attribute__((noinline, target("avx512f"))) inline void streamPlanesWide(float* to, const float* plane,
                                                                          int stride, int count) {
    // Lane 4k + n of a quarter is channel n of pixel k.
    const __m512i firstFour = _mm512_set_epi32(3, 3, 3, 3, 2, 2, 2, 2, 1, 1, 1, 1, 0, 0, 0, 0);
    auto putOne = [&](int i) {
        for (int n = 0; n < 4; n++) to[4 * i + n] = plane[n * stride + i];
    };
    int i = 0;
    for (; i < count && reinterpret_cast<uintptr_t>(to + 4 * i) % 64 != 0; i++) putOne(i);
    for (; i + 16 <= count; i += 16) {
        const float* from = plane + i;
        const __m512 r = _mm512_loadu_ps(from), g = _mm512_loadu_ps(from + stride),
                     b = _mm512_loadu_ps(from + 2 * stride), a = _mm512_loadu_ps(from + 3 * stride);
        for (int quarter = 0; quarter < 4; quarter++) {
            const __m512i pixel = _mm512_add_epi32(firstFour, _mm512_set1_epi32(4 * quarter));
            __m512 rgba = _mm512_maskz_permutexvar_ps(0xffff, pixel, r);
            rgba = _mm512_mask_permutexvar_ps(rgba, 0x2222, pixel, g);
            rgba = _mm512_mask_permutexvar_ps(rgba, 0x4444, pixel, b);
            rgba = _mm512_mask_permutexvar_ps(rgba, 0x8888, pixel, a);
            _mm512_stream_ps(to + 4 * i + 16 * quarter, rgba);
        }
    }
    for (; i < count; i++) putOne(i);
}
inline void streamPlanes(float* to, const float* plane, int stride, int count) {
    static const bool isWide = __builtin_cpu_supports("avx512f");
    (isWide ? streamPlanesWide : streamPlanesNarrow)(to, plane, stride, count);
}
#else
inline void streamPlanes(float*, const float*, int, int) {}
#endif

/// Two pixels or four straight from registers of any machine's, `to` aligned to 16 bytes: only where
/// canStreamPlanes().
#if defined(__SSE2__)
BRUME_INLINE void streamPixels(float* to, blur::Two x) {
    _mm_stream_ps(to, __builtin_shufflevector(x, x, 0, 1, 2, 3));
    _mm_stream_ps(to + 4, __builtin_shufflevector(x, x, 4, 5, 6, 7));
}
BRUME_INLINE void streamPixels(float* to, blur::Four x) {
    _mm_stream_ps(to, __builtin_shufflevector(x, x, 0, 1, 2, 3));
    _mm_stream_ps(to + 4, __builtin_shufflevector(x, x, 4, 5, 6, 7));
    _mm_stream_ps(to + 8, __builtin_shufflevector(x, x, 8, 9, 10, 11));
    _mm_stream_ps(to + 12, __builtin_shufflevector(x, x, 12, 13, 14, 15));
}
BRUME_INLINE void streamPixels(float* to, const blur::Pair& x) {
    streamPixels(to, x.low), streamPixels(to + 8, x.high);
}
#else
template <class Pixels>
BRUME_INLINE void streamPixels(float*, const Pixels&) {}
#endif

/// Whether kernels (four.hpp) may write this image past the caches by whole registers: its rows begin where a
/// line of the cache does. (Not where a sanitizer is to see what is written.)
inline bool canStreamLines([[maybe_unused]] const cv::Mat& out) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    return false;
#else
    return blur::hasHalves && reinterpret_cast<uintptr_t>(out.data) % 64 == 0 && out.step[0] % 64 == 0;
#endif
}

/// Copies whole pixels of 16 bytes, `to` aligned to them, past the caches if it `streams`. The thread that
/// did ends with streamEnd().
inline void putRow(float* to, const float* from, size_t floats, bool streams) {
#if defined(__SSE2__)
    static const bool isWide = __builtin_cpu_supports("avx512f");
    if (streams) return isWide ? streamWide(to, from, floats) : streamNarrow(to, from, floats);
#endif
    std::memcpy(to, from, floats * sizeof(float));
}
inline void streamEnd() {
#if defined(__SSE2__)
    _mm_sfence();
#endif
}

}  // namespace brume
