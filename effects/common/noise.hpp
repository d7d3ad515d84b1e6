// Coherent noise on an integer lattice; twin of noise.glsl, with the same names and numbered steps.
//
// Coordinates are in cells of the first octave. A caller never hands over a large coordinate: it splits the
// camera's place once, in fp64, into a whole cell and a fraction (noiseLattice), and passes only the fraction
// plus the way along the ray, so that noise 10 km or 10 000 km from the world's origin is the same noise. The
// lattice repeats after `period` cells, a power of two; wrapping it keeps every whole number exact in fp32.
//
//   NoiseLattice lattice = noiseLattice(eye, velocity, time, size, period, seed, fraction);   // derive
//   float n = noiseOctaves<NoiseKind::Perlin>(fraction + d * (L / size), lattice, octaves);    // per pixel
//
// Range: perlinNoise and simplexNoise -1..1 (attained within 1e-6 at the worst place of a cell), noiseOctaves
// 0..1 with mean 1/2. Both are 0 on lattice points and twice continuously differentiable. Everything is
// branch-free in the position, so that a loop over a row vectorises.
//
// Sources: gradients and fade, Perlin, "Improving noise" (2002); kernel sum, Perlin, "Noise hardware" (2001),
// with the radius that keeps it continuous (Gustavson, "Simplex noise demystified", 2005). Perlin's skewed
// lattice is body-centred cubic; here it lies along the axes (whole points and half points), so that it tiles
// with any whole period. The hash: Teschner et al. (2003) primes, then Wellons' "lowbias32" mixer.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <opencv2/core/matx.hpp>

namespace brume {

/// Where the noise's coordinates begin: the whole cell in 0..period-1, the wrap mask (period - 1), and the
/// seed.
struct NoiseLattice {
    int32_t cellX = 0, cellY = 0, cellZ = 0;
    uint32_t mask = 0xffffffffu;
    uint32_t seed = 0;
};

enum class NoiseKind { Perlin = 0, Simplex = 1 };

/// Splits (position - velocity·time)/size, all fp64, into a whole cell, wrapped to `period` (a power of two
/// up to 2^20), and the remaining fraction in 0..1.
inline NoiseLattice noiseLattice(const cv::Vec3d& position, const cv::Vec3d& velocity, double time,
                                 double size, uint32_t period, uint32_t seed, cv::Vec3d& fraction) {
    NoiseLattice lattice;
    lattice.mask = period - 1;
    lattice.seed = seed;
    int32_t* cell[3] = {&lattice.cellX, &lattice.cellY, &lattice.cellZ};
    for (int axis = 0; axis < 3; axis++) {
        // Each term is wrapped before the difference: v·t may be far larger than the position.
        const double extent = double(period) * size;
        double p = std::fmod(position[axis], extent) - std::fmod(velocity[axis] * time, extent);
        p = p / size;
        p -= double(period) * std::floor(p / double(period));
        const double whole = std::floor(p);
        *cell[axis] = int32_t(int64_t(whole) & int64_t(lattice.mask));
        fraction[axis] = p - whole;
    }
    return lattice;
}

/// Cells beyond all int32 come round again.
[[gnu::always_inline]] inline int32_t wrappedSum(int32_t a, int32_t b) {
    return int32_t(uint32_t(a) + uint32_t(b));
}

/// The number of the cell that begins at `whole`. Beyond 2^30 (and where there is none, for NaN) it stays:
/// fp32 knows whole cells only there, where noise is 0 in any of them, and no integer may be made of what it
/// cannot hold.
template <class Real>
[[gnu::always_inline]] inline int32_t cellNumber(Real whole) {
    constexpr Real most = 1 << 30;
    whole = whole > -most ? whole : -most;
    return int32_t(whole < most ? whole : most);
}

// 1. the hash of a lattice point, uniform over 32 bits
[[gnu::always_inline]] inline uint32_t latticeHash(uint32_t x, uint32_t y, uint32_t z, uint32_t seed) {
    uint32_t h = (x * 73856093u) ^ (y * 19349663u) ^ (z * 83492791u) ^ (seed * 2654435769u);
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ (h >> 16);
}

// 2. the gradient's slope towards (x, y, z): one of the cube's 12 edges, four of them twice (Perlin 2002)
template <class Real>
[[gnu::always_inline]] inline Real latticeSlope(uint32_t hash, Real x, Real y, Real z) {
    const uint32_t h = hash & 15u;
    const Real u = h < 8u ? x : y;
    const Real v = h < 4u ? y : ((h & 13u) == 12u ? x : z);
    return ((h & 1u) != 0u ? -u : u) + ((h & 2u) != 0u ? -v : v);
}

// 3. Perlin's gradient noise, quintic fade, scaled by 1/1.0363538 to -1..1
template <class Real>
[[gnu::always_inline]] inline Real perlinNoise(Real x, Real y, Real z, const NoiseLattice& lattice) {
    // 3.1 cell and place in it
    const Real floorX = std::floor(x), floorY = std::floor(y), floorZ = std::floor(z);
    const Real fx = x - floorX, fy = y - floorY, fz = z - floorZ;
    const int32_t cellX = wrappedSum(cellNumber(floorX), lattice.cellX),
                  cellY = wrappedSum(cellNumber(floorY), lattice.cellY),
                  cellZ = wrappedSum(cellNumber(floorZ), lattice.cellZ);
    const uint32_t x0 = uint32_t(cellX) & lattice.mask, x1 = (uint32_t(cellX) + 1u) & lattice.mask;
    const uint32_t y0 = uint32_t(cellY) & lattice.mask, y1 = (uint32_t(cellY) + 1u) & lattice.mask;
    const uint32_t z0 = uint32_t(cellZ) & lattice.mask, z1 = (uint32_t(cellZ) + 1u) & lattice.mask;
    // 3.2 fade 6t⁵ - 15t⁴ + 10t³
    const Real wx = fx * fx * fx * (fx * (fx * Real(6) - Real(15)) + Real(10));
    const Real wy = fy * fy * fy * (fy * (fy * Real(6) - Real(15)) + Real(10));
    const Real wz = fz * fz * fz * (fz * (fz * Real(6) - Real(15)) + Real(10));
    // 3.3 slopes at the corners
    const Real gx = fx - Real(1), gy = fy - Real(1), gz = fz - Real(1);
    const uint32_t s = lattice.seed;
    const Real n000 = latticeSlope(latticeHash(x0, y0, z0, s), fx, fy, fz);
    const Real n100 = latticeSlope(latticeHash(x1, y0, z0, s), gx, fy, fz);
    const Real n010 = latticeSlope(latticeHash(x0, y1, z0, s), fx, gy, fz);
    const Real n110 = latticeSlope(latticeHash(x1, y1, z0, s), gx, gy, fz);
    const Real n001 = latticeSlope(latticeHash(x0, y0, z1, s), fx, fy, gz);
    const Real n101 = latticeSlope(latticeHash(x1, y0, z1, s), gx, fy, gz);
    const Real n011 = latticeSlope(latticeHash(x0, y1, z1, s), fx, gy, gz);
    const Real n111 = latticeSlope(latticeHash(x1, y1, z1, s), gx, gy, gz);
    // 3.4 blend
    const Real n00 = n000 + wx * (n100 - n000), n10 = n010 + wx * (n110 - n010);
    const Real n01 = n001 + wx * (n101 - n001), n11 = n011 + wx * (n111 - n011);
    const Real n0 = n00 + wy * (n10 - n00), n1 = n01 + wy * (n11 - n01);
    return (n0 + wz * (n1 - n0)) * Real(0.9649214);
}

// 4.1 Of all lattice points, four are within sqrt(1/2) of a place in a cell: the nearest corner, the corner
// next to it across the axis along which the place is nearest to the middle, the cell's centre, and the next
// centre along the axis of the largest distance from the middle. With u = |f - 1/2| along each axis, their
// 1/2 - r² are
//   s + Σu - 3/4,  that - 2·min u,  s = 1/2 - Σu²,  s + 2·max u - 1
// and each point adds the fourth power of that, where it is positive, times its slope. (Where the choice of
// an axis is open, what is chosen adds nothing.)
template <class Real>
struct SimplexReach {
    Real least, most;                     ///< of u
    Real corner, across, centre, beyond;  ///< fourth powers

    [[gnu::always_inline]] SimplexReach(Real ux, Real uy, Real uz) {
        const Real lower = ux < uy ? ux : uy, upper = ux < uy ? uy : ux;
        least = lower < uz ? lower : uz;
        most = upper > uz ? upper : uz;
        const Real s = Real(0.5) - (ux * ux + uy * uy + uz * uz);
        const Real c = s + ((ux + uy + uz) - Real(0.75));
        corner = fourth(c);
        across = fourth(c - (least + least));
        centre = fourth(s);
        beyond = fourth(s + ((most + most) - Real(1)));
    }
    [[gnu::always_inline]] static Real fourth(Real t) {
        t = t > Real(0) ? t : Real(0);
        t = t * t;
        return t * t;
    }
};

// 4. simplex noise at f in 0..1 of a cell: the whole points and the half points, scaled by 1/.01300716 to
// -1..1
template <class Real>
[[gnu::always_inline]] inline Real simplexInCell(Real fx, Real fy, Real fz, int32_t cellX, int32_t cellY,
                                                 int32_t cellZ, const NoiseLattice& lattice) {
    const Real dx = fx - Real(0.5), dy = fy - Real(0.5), dz = fz - Real(0.5);
    const Real ux = std::abs(dx), uy = std::abs(dy), uz = std::abs(dz);
    const SimplexReach<Real> reach(ux, uy, uz);
    // 4.2 the axes chosen, and towards which side the place is
    const int32_t acrossX = int32_t(ux <= reach.least), acrossY = int32_t(uy <= reach.least) & (1 - acrossX),
                  acrossZ = 1 - acrossX - acrossY;
    const int32_t beyondX = int32_t(ux >= reach.most), beyondY = int32_t(uy >= reach.most) & (1 - beyondX),
                  beyondZ = 1 - beyondX - beyondY;
    const int32_t upX = int32_t(dx >= Real(0)), upY = int32_t(dy >= Real(0)), upZ = int32_t(dz >= Real(0));
    const int32_t sideX = 2 * upX - 1, sideY = 2 * upY - 1, sideZ = 2 * upZ - 1;
    // 4.3 their slopes
    auto slope = [&](int32_t x, int32_t y, int32_t z, uint32_t seed, Real px, Real py, Real pz) {
        const uint32_t hash = latticeHash((uint32_t(cellX) + uint32_t(x)) & lattice.mask,
                                          (uint32_t(cellY) + uint32_t(y)) & lattice.mask,
                                          (uint32_t(cellZ) + uint32_t(z)) & lattice.mask, seed);
        return latticeSlope(hash, px, py, pz);
    };
    const Real cx = dx - Real(0.5) * Real(sideX), cy = dy - Real(0.5) * Real(sideY),
               cz = dz - Real(0.5) * Real(sideZ);
    const int32_t ax = acrossX * sideX, ay = acrossY * sideY, az = acrossZ * sideZ;
    const int32_t bx = beyondX * sideX, by = beyondY * sideY, bz = beyondZ * sideZ;
    const uint32_t seed = lattice.seed, halfSeed = lattice.seed ^ 0x68e31da4u;
    const Real whole =
        reach.corner * slope(upX, upY, upZ, seed, cx, cy, cz) +
        reach.across * slope(upX - ax, upY - ay, upZ - az, seed, cx + Real(ax), cy + Real(ay), cz + Real(az));
    const Real half = reach.centre * slope(0, 0, 0, halfSeed, dx, dy, dz) +
                      reach.beyond * slope(bx, by, bz, halfSeed, dx - Real(bx), dy - Real(by), dz - Real(bz));
    return (whole + half) * Real(76.88073);
}
template <class Real>
[[gnu::always_inline]] inline Real simplexNoise(Real x, Real y, Real z, const NoiseLattice& lattice) {
    const Real floorX = std::floor(x), floorY = std::floor(y), floorZ = std::floor(z);
    return simplexInCell(x - floorX, y - floorY, z - floorZ, wrappedSum(cellNumber(floorX), lattice.cellX),
                         wrappedSum(cellNumber(floorY), lattice.cellY),
                         wrappedSum(cellNumber(floorZ), lattice.cellZ), lattice);
}

// 4.4 The gradients of the fifteen lattice points that simplex noise meets within a cell: where many places
// lie in one cell, hashing is done once. Twice a gradient's component, 2, 0 or -2, is two bits at a float's
// top, so a word holds that component for a point at every fourth bit, and a shift brings out one.
struct SimplexGradients {
    uint32_t x = 0, y = 0, z = 0;

    void set(int shift, uint32_t hash) {
        auto topBits = [&](float x, float y, float z) {
            return std::bit_cast<uint32_t>(2.0f * latticeSlope(hash, x, y, z) + 0.0f) >> shift;
        };
        x |= topBits(1, 0, 0), y |= topBits(0, 1, 0), z |= topBits(0, 0, 1);
    }
    [[gnu::always_inline]] float slope(uint32_t shift, float dx, float dy, float dz) const {
        auto component = [&](uint32_t word) { return std::bit_cast<float>((word << shift) & 0xc0000000u); };
        return component(x) * dx + component(y) * dy + component(z) * dz;
    }
};

struct SimplexCell {
    SimplexGradients corners;   // a shift of 4 where the place is below the middle in x, 8 in y, 16 in z
    SimplexGradients next;      // of the centres beyond: in x 0 or, below, 4; in y 8 or 16; in z 12 or 28
    float x = 0, y = 0, z = 0;  // twice the own centre's
};

inline SimplexCell simplexCell(int32_t cellX, int32_t cellY, int32_t cellZ, const NoiseLattice& lattice) {
    auto hash = [&](int32_t x, int32_t y, int32_t z, uint32_t seed) {
        return latticeHash((uint32_t(cellX) + uint32_t(x)) & lattice.mask,
                           (uint32_t(cellY) + uint32_t(y)) & lattice.mask,
                           (uint32_t(cellZ) + uint32_t(z)) & lattice.mask, seed);
    };
    const uint32_t halfSeed = lattice.seed ^ 0x68e31da4u;
    SimplexCell cell;
    for (int i = 0; i < 8; i++)
        cell.corners.set(4 * i, hash(1 - (i & 1), 1 - (i >> 1 & 1), 1 - (i >> 2), lattice.seed));
    for (int below = 0; below < 2; below++) {
        const int32_t side = 1 - 2 * below;
        cell.next.set(4 * below, hash(side, 0, 0, halfSeed));
        cell.next.set(8 + 8 * below, hash(0, side, 0, halfSeed));
        cell.next.set(12 + 16 * below, hash(0, 0, side, halfSeed));
    }
    const uint32_t centre = hash(0, 0, 0, halfSeed);
    cell.x = 2.0f * latticeSlope(centre, 1.0f, 0.0f, 0.0f);
    cell.y = 2.0f * latticeSlope(centre, 0.0f, 1.0f, 0.0f);
    cell.z = 2.0f * latticeSlope(centre, 0.0f, 0.0f, 1.0f);
    return cell;
}

// 4.5 the same in a cell whose gradients are known
[[gnu::always_inline]] inline float simplexInCell(float fx, float fy, float fz, const SimplexCell& cell) {
    auto bits = [](float x) { return std::bit_cast<uint32_t>(x); };
    const float dx = fx - 0.5f, dy = fy - 0.5f, dz = fz - 0.5f;
    const float ux = std::abs(dx), uy = std::abs(dy), uz = std::abs(dz);
    const SimplexReach<float> reach(ux, uy, uz);
    auto towards = [&](float size, float d) {
        return std::bit_cast<float>((bits(d) & 0x80000000u) | std::bit_cast<uint32_t>(size));
    };
    const float sideX = towards(1.0f, dx), sideY = towards(1.0f, dy), sideZ = towards(1.0f, dz);
    const float cx = dx - towards(0.5f, dx), cy = dy - towards(0.5f, dy), cz = dz - towards(0.5f, dz);
    const uint32_t belowX = bits(dx) >> 29 & 4u, belowY = bits(dy) >> 28 & 8u, belowZ = bits(dz) >> 27 & 16u;
    const uint32_t corner = belowX | belowY | belowZ;
    const bool acrossX = ux <= reach.least, acrossY = uy <= reach.least, acrossZ = uz <= reach.least;
    const uint32_t across = corner ^ (acrossX ? 4u : acrossY ? 8u : 16u);
    const bool beyondX = ux >= reach.most, beyondY = uy >= reach.most, beyondZ = uz >= reach.most;
    const uint32_t beyond = beyondX ? belowX : beyondY ? belowY + 8u : belowZ + 12u;
    const float whole =
        reach.corner * cell.corners.slope(corner, cx, cy, cz) +
        reach.across * cell.corners.slope(across, acrossX ? cx + sideX : cx, acrossY ? cy + sideY : cy,
                                          acrossZ ? cz + sideZ : cz);
    const float half = reach.centre * (cell.x * dx + cell.y * dy + cell.z * dz) +
                       reach.beyond * cell.next.slope(beyond, beyondX ? dx - sideX : dx,
                                                      beyondY ? dy - sideY : dy, beyondZ ? dz - sideZ : dz);
    return (whole + half) * 38.440365f;
}

// 5. the lattice of octave o: cells half as large each time, periods as many metres, a seed of its own
[[gnu::always_inline]] inline NoiseLattice octaveLattice(const NoiseLattice& lattice, int octave) {
    return {lattice.cellX << octave, lattice.cellY << octave, lattice.cellZ << octave,
            (lattice.mask << octave) | ((1u << octave) - 1u), lattice.seed + uint32_t(octave) * 0x9e3779b9u};
}

// 6. octaves 1, 1/2, 1/4 ... of half the size each, normalised to 0..1
template <NoiseKind kind, class Real>
[[gnu::always_inline]] inline Real noiseOctaves(Real x, Real y, Real z, const NoiseLattice& lattice,
                                                int octaves) {
    Real sum = 0, weight = 1, scale = 1, total = 0;
    for (int octave = 0; octave < octaves; octave++) {
        const NoiseLattice l = octaveLattice(lattice, octave);
        const Real n = kind == NoiseKind::Perlin ? perlinNoise(x * scale, y * scale, z * scale, l)
                                                 : simplexNoise(x * scale, y * scale, z * scale, l);
        sum += weight * n;
        total += weight;
        weight *= Real(0.5);
        scale *= Real(2);
    }
    return Real(0.5) + Real(0.5) * (sum / total);
}

template <NoiseKind kind, class Real>
[[gnu::always_inline]] inline Real noiseOctaves(const cv::Vec<Real, 3>& p, const NoiseLattice& lattice,
                                                int octaves) {
    return noiseOctaves<kind>(p[0], p[1], p[2], lattice, octaves);
}

}  // namespace brume
