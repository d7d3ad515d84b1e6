// The inner loops of the separable blurs, over lines of RGBA floats. Every sum has one fixed order, so the
// same pixel gets the same bits whatever thread, tile or vector width computed it.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "common/fir_lines.hpp"

namespace blur {

// NaN as 0 and ±inf as ±65504, so that one bad pixel cannot spread over a whole blur.
BRUME_VECTORISE static void copyFinite(float* out, const float* in, int floats) {
    for (int i = 0; i < floats; i++) {
        float x = in[i];
        float bounded = std::fabs(x) > 3.4028235e38f ? std::copysign(65504.0f, x) : x;
        out[i] = x == x ? bounded : 0.0f;
    }
}

BRUME_VECTORISE static bool allFinite(const float* in, int floats) {
    int largest = 0;
    for (int i = 0; i < floats; i++) largest = std::max(largest, std::bit_cast<int>(in[i]) & 0x7fffffff);
    return largest < 0x7f800000;
}

// The line `count` pixels long from column `first` on of a row `width` pixels long whose edges replicate.
template <class Copy>
static inline void copyReplicated(float* out, const float* row, int width, int first, int count, Copy copy) {
    int inside0 = std::clamp(first, 0, width), inside1 = std::clamp(first + count, inside0, width);
    copy(out + 4 * (inside0 - first), row + 4 * inside0, 4 * (inside1 - inside0));
    float left[4], right[4];
    copy(left, row, 4);
    copy(right, row + 4 * (width - 1), 4);
    for (int i = 0; i < std::min(count, -first); i++) std::memcpy(out + 4 * i, left, sizeof left);
    for (int i = std::max(0, width - first); i < count; i++) std::memcpy(out + 4 * i, right, sizeof right);
}

// Runs `filter` on that line, of values as they are; and again, with its bad values replaced, if any got into
// the `floats` floats of its result: looking there is cheaper than looking at every input.
template <class Filter>
static inline void filterReplicated(float* result, int floats, float* padded, const float* row, int width,
                                    int first, int count, Filter filter) {
    if (first >= 0 && first + count <= width) {
        filter(row + 4 * first);
    } else {
        copyReplicated(padded, row, width, first, count,
                       [](float* out, const float* in, int n) { std::memcpy(out, in, n * sizeof(float)); });
        filter(padded);
    }
    if (allFinite(result, floats)) return;
    copyReplicated(padded, row, width, first, count, copyFinite);
    filter(padded);
}

BRUME_INLINE One halves(const Two& a) {
    return __builtin_shufflevector(a, a, 0, 1, 2, 3) + __builtin_shufflevector(a, a, 4, 5, 6, 7);
}
BRUME_INLINE Two twice(const One& a) { return __builtin_shufflevector(a, a, 0, 1, 2, 3, 0, 1, 2, 3); }

// Every `step`-th pixel of a filtered line: out[j] = Σ pairs[u]·line[j·step + 2u .. + 1], two taps at a time.
// `line` begins at the first tap of output 0; pairs[u] holds tap 2u four times, then tap 2u + 1 four times.
BRUME_VECTORISE static void decimateLine(float* out, const float* line, const float* pairs, int pairCount,
                                         int step, int count) {
    int j = 0;
    for (; j + 4 <= count; j += 4) {
        const float* at = line + 4 * j * step;
        Two a[4] = {};
        for (int u = 0; u < pairCount; u++) {
            Two w = *(const Two*)(pairs + 8 * u);
            for (int k = 0; k < 4; k++) a[k] += w * *(const Two*)(at + 4 * k * step + 8 * u);
        }
        for (int k = 0; k < 4; k++) *(One*)(out + 4 * (j + k)) = halves(a[k]);
    }
    for (; j < count; j++) {
        const float* at = line + 4 * j * step;
        Two a = {};
        for (int u = 0; u < pairCount; u++) a += *(const Two*)(pairs + 8 * u) * *(const Two*)(at + 8 * u);
        *(One*)(out + 4 * j) = halves(a);
    }
}

// out = Σ w[m]·rows[m], m = 0..3
BRUME_VECTORISE static void fourSum(float* out, const float* const rows[4], const float w[4], int floats) {
    for (int i = 0; i < floats; i++)
        out[i] = (w[0] * rows[0][i] + w[1] * rows[1][i]) + (w[2] * rows[2][i] + w[3] * rows[3][i]);
}

// `factor` pixels for each of the small line's: out[j·factor + phase] = Σ w[phase][m]·line[j - 1 + m].
// `line` points at small pixel 0 and can be read one before and two after. pairs[phase/2][m] holds two
// phases' weights, four times each.
BRUME_VECTORISE static void enlargeLine(float* out, const float* line, const float* pairs, int factor,
                                        int width) {
    for (int j = 0; j * factor < width; j++) {
        const float* s = line + 4 * j;
        Two s0 = twice(*(const One*)(s - 4)), s1 = twice(*(const One*)s), s2 = twice(*(const One*)(s + 4)),
            s3 = twice(*(const One*)(s + 8));
        float* to = out + 4 * j * factor;
        int phases = std::min(factor, width - j * factor), phase = 0;
        const Two* w = (const Two*)pairs;
        for (; phase + 2 <= phases; phase += 2, w += 4)
            *(Two*)(to + 4 * phase) = (w[0] * s0 + w[1] * s1) + (w[2] * s2 + w[3] * s3);
        if (phase < phases) {
            Two last = (w[0] * s0 + w[1] * s1) + (w[2] * s2 + w[3] * s3);
            *(One*)(to + 4 * phase) = __builtin_shufflevector(last, last, 0, 1, 2, 3);
        }
    }
}

}  // namespace blur
