// The noise of noise.hpp in fp64, slow and obvious: the truth its twins are judged by. Only the hash is
// shared.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <opencv2/core/matx.hpp>

#include "common/noise.hpp"

namespace brume::reference {

/// The 16 gradients of Perlin, "Improving noise" (2002): the 12 edges of a cube, four of them twice.
inline cv::Vec3d gradient(uint32_t index) {
    static const std::array<cv::Vec3d, 16> gradients = {{{1, 1, 0},
                                                         {-1, 1, 0},
                                                         {1, -1, 0},
                                                         {-1, -1, 0},
                                                         {1, 0, 1},
                                                         {-1, 0, 1},
                                                         {1, 0, -1},
                                                         {-1, 0, -1},
                                                         {0, 1, 1},
                                                         {0, -1, 1},
                                                         {0, 1, -1},
                                                         {0, -1, -1},
                                                         {1, 1, 0},
                                                         {0, -1, 1},
                                                         {-1, 1, 0},
                                                         {0, -1, -1}}};
    return gradients[index & 15];
}

/// Unscaled gradient noise: Σ over a cell's corners of fade weights times slopes. `hash(x, y, z)` of lattice
/// points.
template <class Hash>
double perlin(const cv::Vec3d& p, Hash hash) {
    double sum = 0;
    const cv::Vec3d cell(std::floor(p[0]), std::floor(p[1]), std::floor(p[2]));
    for (int corner = 0; corner < 8; corner++) {
        const cv::Vec3d at = cell + cv::Vec3d(corner & 1, corner >> 1 & 1, corner >> 2);
        const cv::Vec3d d = p - at;
        double weight = 1;
        for (int axis = 0; axis < 3; axis++) {
            const double t = 1 - std::abs(d[axis]);
            weight *= t * t * t * (10 - 15 * t + 6 * t * t);
        }
        sum += weight * gradient(hash(int64_t(at[0]), int64_t(at[1]), int64_t(at[2]))).dot(d);
    }
    return sum;
}

/// Unscaled simplex noise: Σ over all points of a body-centred cubic lattice nearer than sqrt(1/2) of
/// (1/2 - r²)⁴·slope. `hash(x, y, z, half)`: half is 1 for the points at (x + 1/2, y + 1/2, z + 1/2).
template <class Hash>
double simplex(const cv::Vec3d& p, Hash hash) {
    double sum = 0;
    const int64_t x0 = int64_t(std::floor(p[0])), y0 = int64_t(std::floor(p[1])),
                  z0 = int64_t(std::floor(p[2]));
    for (int half = 0; half < 2; half++)  // farther points are out of reach
        for (int64_t z = z0 - half; z <= z0 + 1; z++)
            for (int64_t y = y0 - half; y <= y0 + 1; y++)
                for (int64_t x = x0 - half; x <= x0 + 1; x++) {
                    const cv::Vec3d d = p - cv::Vec3d(x + .5 * half, y + .5 * half, z + .5 * half);
                    if (d.dot(d) < .5)
                        sum += std::pow(.5 - d.dot(d), 4) * gradient(hash(x, y, z, half)).dot(d);
                }
    return sum;
}

/// The noise of `octaves` octaves, 0..1, at a place in cells of the first octave measured from the world's
/// origin, repeating after `period` cells.
inline double noise(NoiseKind kind, const cv::Vec3d& cells, int octaves, int64_t period, uint32_t seed) {
    double sum = 0, total = 0;
    for (int octave = 0; octave < octaves; octave++) {
        const int64_t wrap = period << octave;
        const uint32_t octaveSeed = seed + uint32_t(octave) * 0x9e3779b9u;
        auto wrapped = [&](int64_t c) { return uint32_t(((c % wrap) + wrap) % wrap); };
        const cv::Vec3d p = cells * std::pow(2., octave);
        double n = 0;
        if (kind == NoiseKind::Perlin)
            n = .9649214 * perlin(p, [&](int64_t x, int64_t y, int64_t z) {
                    return latticeHash(wrapped(x), wrapped(y), wrapped(z), octaveSeed);
                });
        else
            n = 76.88073 * simplex(p, [&](int64_t x, int64_t y, int64_t z, int half) {
                    return latticeHash(wrapped(x), wrapped(y), wrapped(z),
                                       half ? octaveSeed ^ 0x68e31da4u : octaveSeed);
                });
        sum += std::pow(.5, octave) * n;
        total += std::pow(.5, octave);
    }
    return .5 + .5 * sum / total;
}

/// One octave of noise along an axis, -1..1, at a place in cells from the world's origin.
inline double lineNoise(double x, uint32_t axis, int64_t period, uint32_t seed) {
    double sum = 0;
    for (int end = 0; end < 2; end++) {
        const double at = std::floor(x) + end, t = 1 - std::abs(x - at);
        const int64_t cell = ((int64_t(at) % period) + period) % period;
        const double slope = double(latticeHash(uint32_t(cell), axis, 0, seed) >> 8) / double(1 << 23) - 1;
        sum += slope * (x - at) * t * t * t * (10 - 15 * t + 6 * t * t);
    }
    return 2 * sum;
}

}  // namespace brume::reference
