// Noise baked into a tiling volume; twin of noise_volume.glsl. Trilinear between texels: RMS error over the
// noise's own deviation 12 / 3.3 / .85 / .2 % at 4 / 8 / 16 / 32 texels a cell (MODELS.md §4).
#pragma once

#include <cmath>
#include <cstdint>
#include <opencv2/core/utility.hpp>
#include <vector>

#include "common/noise.hpp"
#include "effect/kit/math.hpp"

namespace brume {

/// The volume (edge³ values, x fastest; edge = mask + 1) at q, in texels from the texel `base`.
BRUME_INLINE float volumeNoise(const float* volume, int edge, float qx, float qy, float qz, int baseX,
                               int baseY, int baseZ) {
    const int mask = edge - 1;
    const float wholeX = std::floor(qx), wholeY = std::floor(qy), wholeZ = std::floor(qz);
    const float fx = qx - wholeX, fy = qy - wholeY, fz = qz - wholeZ;
    const int ax = (cellNumber(wholeX) + baseX) & mask, ay = (cellNumber(wholeY) + baseY) & mask,
              az = (cellNumber(wholeZ) + baseZ) & mask;
    const int bx = (ax + 1) & mask, by = (ay + 1) & mask, bz = (az + 1) & mask;
    const int y0 = ay * edge, y1 = by * edge, z0 = az * edge * edge, z1 = bz * edge * edge;
    const float a00 = volume[z0 + y0 + ax], b00 = volume[z0 + y0 + bx];
    const float a10 = volume[z0 + y1 + ax], b10 = volume[z0 + y1 + bx];
    const float a01 = volume[z1 + y0 + ax], b01 = volume[z1 + y0 + bx];
    const float a11 = volume[z1 + y1 + ax], b11 = volume[z1 + y1 + bx];
    const float x00 = a00 + fx * (b00 - a00), x10 = a10 + fx * (b10 - a10);
    const float x01 = a01 + fx * (b01 - a01), x11 = a11 + fx * (b11 - a11);
    const float xy0 = x00 + fy * (x10 - x00), xy1 = x01 + fy * (x11 - x01);
    return xy0 + fz * (xy1 - xy0);
}

/// Weights of row 2·s of Pascal's triangle, normalised: 2·s + 1 of them (P5's blur, odd rows only, so that it
/// does not shift).
inline std::vector<double> pascalRow(int s) {
    std::vector<double> row = {1};
    for (int k = 0; k < 2 * s; k++) {
        std::vector<double> next(row.size() + 1, 0);
        for (size_t i = 0; i < row.size(); i++) next[i] += .5 * row[i], next[i + 1] += .5 * row[i];
        row = next;
    }
    return row;
}

/// Row (y, z) of the volume before smoothing, fp64, octave by octave so that it vectorises.
template <NoiseKind kind>
BRUME_INLINE void bakeRow(double* row, int edge, double cellsPerTexel, double y, double z,
                          const NoiseLattice& lattice, int octaves) {
    double weight = 1, scale = 1, total = 0;
    for (int x = 0; x < edge; x++) row[x] = 0;
    for (int octave = 0; octave < octaves; octave++) {
        const NoiseLattice l = octaveLattice(lattice, octave);
        for (int x = 0; x < edge; x++) {
            const double place = x * cellsPerTexel * scale;
            row[x] += weight * (kind == NoiseKind::Perlin ? perlinNoise(place, y * scale, z * scale, l)
                                                          : simplexNoise(place, y * scale, z * scale, l));
        }
        total += weight;
        weight *= .5;
        scale *= 2;
    }
    for (int x = 0; x < edge; x++) row[x] = .5 + .5 * (row[x] / total);
}
BRUME_VECTORISE inline void bakeSlice(double* slice, NoiseKind kind, int edge, double cellsPerTexel, double z,
                                      const NoiseLattice& lattice, int octaves) {
    for (int y = 0; y < edge; y++) {
        if (kind == NoiseKind::Perlin)
            bakeRow<NoiseKind::Perlin>(slice + y * edge, edge, cellsPerTexel, y * cellsPerTexel, z, lattice,
                                       octaves);
        else
            bakeRow<NoiseKind::Simplex>(slice + y * edge, edge, cellsPerTexel, y * cellsPerTexel, z, lattice,
                                        octaves);
    }
}

/// Bakes `edge`³ values of the noise of `octaves` octaves that repeats after `tile` cells, fp64, smoothed
/// along each axis by Pascal's row 2·smoothing, wrapping. edge and tile are powers of two, edge ≥ tile.
inline std::vector<double> bakeNoise(NoiseKind kind, int octaves, int tile, int edge, int smoothing,
                                     uint32_t seed) {
    std::vector<double> volume(size_t(edge) * edge * edge);
    const double cellsPerTexel = double(tile) / edge;
    NoiseLattice lattice;
    lattice.mask = uint32_t(tile) - 1;
    lattice.seed = seed;
    cv::parallel_for_({0, edge}, [&](const cv::Range& slices) {
        for (int z = slices.start; z < slices.end; z++)
            bakeSlice(&volume[size_t(z) * edge * edge], kind, edge, cellsPerTexel, z * cellsPerTexel, lattice,
                      octaves);
    });
    if (smoothing == 0) return volume;
    const std::vector<double> weights = pascalRow(smoothing);
    std::vector<double> smoothed(volume.size());
    for (size_t stride : {size_t(1), size_t(edge), size_t(edge) * edge}) {
        cv::parallel_for_({0, edge}, [&](const cv::Range& slices) {
            const size_t begin = size_t(slices.start) * edge * edge, end = size_t(slices.end) * edge * edge;
            for (size_t at = begin; at < end; at++) {
                const long place = long(at / stride % edge);
                double sum = 0;
                for (int k = -smoothing; k <= smoothing; k++) {
                    const long wrapped = (place + k + edge) & (edge - 1);
                    sum += weights[k + smoothing] * volume[at + (wrapped - place) * long(stride)];
                }
                smoothed[at] = sum;
            }
        });
        volume.swap(smoothed);
    }
    return volume;
}

}  // namespace brume
