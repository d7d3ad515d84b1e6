// Gradient noise along one axis, and its mean over a way; twin of noise_line.glsl.
//
// P3 integrates such noise beforehand into a texture. No table is needed: between lattice points the noise is
// a polynomial of degree 6, and over a whole cell with slopes a and b its integral is 2/7·(a - b), so sums
// over whole cells telescope. Differences of an integral would lose all digits on short ways; these parts
// lose none.
#pragma once

#include <cmath>
#include <cstdint>

#include "common/noise.hpp"

namespace brume {

// 1. the slope at a lattice point, uniform in -1..1
template <class Real>
inline Real lineSlope(int32_t cell, uint32_t axis, uint32_t mask, uint32_t seed) {
    return Real(latticeHash(uint32_t(cell) & mask, axis, 0u, seed) >> 8) * Real(1.1920928955078125e-7) -
           Real(1);
}

// 2. the noise at f in 0..1 between slopes a and b, -1..1
template <class Real>
inline Real lineNoise(Real a, Real b, Real f) {
    const Real w = f * f * f * (f * (f * Real(6) - Real(15)) + Real(10));
    const Real low = a * f, high = b * (f - Real(1));
    return Real(2) * (low + w * (high - low));
}

// 3. its mean over f0..f1 inside one cell: of degree 6, so four Gauss points are exact
template <class Real>
inline Real lineCellMean(Real a, Real b, Real f0, Real f1) {
    const Real middle = Real(.5) * (f0 + f1), reach = Real(.5) * (f1 - f0);
    const Real near = Real(0.33998104358485626) * reach, far = Real(0.86113631159405258) * reach;
    return Real(0.32607257743127307) * (lineNoise(a, b, middle - near) + lineNoise(a, b, middle + near)) +
           Real(0.17392742256872693) * (lineNoise(a, b, middle - far) + lineNoise(a, b, middle + far));
}

// 4. its mean over x0..x1 ≥ x0: the two cells cut, and the whole cells between them; 0 over more than a
// million cells
template <class Real>
inline Real lineMean(Real x0, Real x1, int32_t cell, uint32_t axis, uint32_t mask, uint32_t seed) {
    const Real way = x1 - x0;
    if (way > Real(1e6)) return Real(0);
    const Real c0 = std::floor(x0), c1 = std::floor(x1);
    const int32_t i0 = cell + int32_t(c0), i1 = cell + int32_t(c1);
    const Real a0 = lineSlope<Real>(i0, axis, mask, seed), b0 = lineSlope<Real>(i0 + 1, axis, mask, seed);
    if (i0 == i1) return lineCellMean(a0, b0, x0 - c0, x1 - c0);
    const Real a1 = lineSlope<Real>(i1, axis, mask, seed), b1 = lineSlope<Real>(i1 + 1, axis, mask, seed);
    const Real f0 = x0 - c0, f1 = x1 - c1;
    return (lineCellMean(a0, b0, f0, Real(1)) * (Real(1) - f0) + Real(0.2857142857142857) * (b0 - a1) +
            lineCellMean(a1, b1, Real(0), f1) * f1) /
           way;
}

// 5. octaves of it, 0..1
template <class Real>
inline Real lineOctavesMean(Real x0, Real x1, int32_t cell, uint32_t axis, const NoiseLattice& lattice,
                            int octaves) {
    Real sum = 0, weight = 1, scale = 1, total = 0;
    for (int octave = 0; octave < octaves; octave++) {
        const NoiseLattice l = octaveLattice(lattice, octave);
        sum += weight * lineMean(x0 * scale, x1 * scale, cell << octave, axis, l.mask, l.seed);
        total += weight;
        weight *= Real(.5);
        scale *= Real(2);
    }
    return Real(.5) + Real(.5) * (sum / total);
}

}  // namespace brume
