// Where P1's sun lobe looks (its eq 5); twin of sun_offset.glsl.
#pragma once

#include <cmath>

#include "effect/kit/math.hpp"

namespace brume {

/// Turns unit directions of ways of L metres by adding the scalar `offset`, in m, to their vectors. As shares
/// of L + offset, so that next to nothing neither vanishes nor divides by 0, nor do vectors that cancel. From
/// 1e15 m on the offset is nothing.
BRUME_INLINE void offsetDirections(float* dx, float* dy, float* dz, const float* L, float offset, int count) {
    if (!(offset > 1e-30f)) return;
    for (int i = 0; i < count; i++) {
        const float share = L[i] < 1e15f ? offset / (L[i] + offset) : 0.0f, rest = 1.0f - share;
        const float x = dx[i] * rest + share, y = dy[i] * rest + share, z = dz[i] * rest + share;
        const float square = x * x + y * y + z * z;
        const float unit = 1.0f / std::sqrt(square > 1e-30f ? square : 1e-30f);
        dx[i] = x * unit, dy[i] = y * unit, dz[i] = z * unit;
    }
}

}  // namespace brume
