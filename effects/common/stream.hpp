// Writing past the caches: an image too large to be in them when it is read again needs no reading before it
// is written.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <opencv2/core/mat.hpp>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace blur {

/// Whether an image is larger than what caches will have kept of it.
inline bool isStreamed(const cv::Mat& image) { return image.total() * image.elemSize() > (16u << 20); }

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

}  // namespace blur
