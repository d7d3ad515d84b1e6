// noise_fog's CPU methods that are not loops over a tile; numbered as in noise_fog.fs. In double for the
// tests of convergence.
#pragma once

#include <algorithm>

#include "common/noise_line.hpp"
#include "common/profiles.hpp"
#include "noise_fog/params.hpp"

namespace brume::noise_fog {

// 2. The mean of f over 0..reach at the middles of `steps` equal steps.
template <class Real, class F>
inline Real midpointMean(Real reach, int steps, const F& f) {
    Real sum = 0;
    for (int k = 0; k < steps; k++) sum += f(reach * ((Real(k) + Real(.5)) / Real(steps)));
    return sum / Real(steps);
}

// 3. Relative density of noise n at a surface dy above the eye.
template <int mode>
BRUME_INLINE float modulated(const NoiseFog& p, float n, float dy) {
    if (mode == modulate) return p.low + (p.high - p.low) * n;
    if (mode == ocean) return n * (0.5f * dy * dy) + 0.001f;
    if (mode == additive) return 1.0f + p.strength * n;
    const float left = 1.0f - p.strength * n;
    return left > 0.0f ? left : 0.0f;
}

// 4. P3's product. Points are (metres from the eye, density, density per metre to the next, unused),
// ascending.
inline float pointsMean(const float* points, int count, float way) {
    if (count == 0) return 0;
    const float a = std::min(way, 0.0f), b = std::max(way, 0.0f), length = b - a;
    if (length < 1e-30f) {
        float density = points[1];
        for (int k = 0; k + 1 < count; k++)
            density +=
                points[4 * k + 2] * (std::clamp(0.0f, points[4 * k], points[4 * k + 4]) - points[4 * k]);
        return density;
    }
    float sum = std::max(std::min(b, points[0]) - a, 0.0f) * points[1];
    for (int k = 0; k + 1 < count; k++) {
        const float* q = points + 4 * k;
        const float from = std::max(a, q[0]), to = std::min(b, q[4]);
        sum += std::max(to - from, 0.0f) * (q[1] + q[2] * (0.5f * (from + to) - q[0]));
    }
    const float* last = points + 4 * (count - 1);
    sum += std::max(b - std::max(a, last[0]), 0.0f) * last[1];
    return sum / length;
}

// The mean of an exponential density, at most e⁶⁰ itself: with only its dense end at most that, a product
// would thin out with distance.
inline float cappedExponentialMean(float logDensity, float k, float way) {
    const float beyond = logDensity - k * std::min(way, 0.0f) - 60.0f;
    const float mean = exponentialMean(logDensity, k, way);
    if (!(beyond > 0.0f)) return mean;
    return 1.1420073e26f * std::min(phi(k * std::abs(way)) * expFast(std::min(beyond, 80.0f)), 1.0f);
}

// fp32 constants of the product.
struct Product {
    Axis axis[3];
    float log[3], fraction[3], inverseSize, low, high;
    const float* points[3];
    int count[3];
    NoiseLattice lattice;
    int octaves;

    float axisMean(int a, float way) const {
        const int cell[3] = {lattice.cellX, lattice.cellY, lattice.cellZ};
        float mean = 1;
        if (axis[a].profile == exponentialAxis) {
            mean = cappedExponentialMean(log[a], std::abs(axis[a].falloff), axis[a].falloff < 0 ? -way : way);
        } else if (axis[a].profile == noiseAxis) {
            const float there = fraction[a] + way * inverseSize;
            const float n = lineOctavesMean(std::min(fraction[a], there), std::max(fraction[a], there),
                                            cell[a], uint32_t(a), lattice, octaves);
            mean = low + (high - low) * n;
        } else if (axis[a].profile != constantAxis) {
            mean = pointsMean(points[a], count[a], way);
        }
        return std::min(axis[a].density * mean, 1e12f);
    }
    float mean(float dx, float dy, float dz, float L) const {
        const float way = std::min(L, 1e30f);
        return axisMean(0, dx * way) * axisMean(1, dy * way) * axisMean(2, dz * way);
    }
};

}  // namespace brume::noise_fog
