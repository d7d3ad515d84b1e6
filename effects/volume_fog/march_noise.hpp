// Step 6 of the CPU march: noise along the rays of a tile. Same names and numbered steps as density.glsl.
#pragma once

#include "volume_fog/tile.hpp"

namespace volume_fog {

// 6. Noise, 0..1, `at` m along each ray. Neighbouring rays mostly meet the same cell: there its gradients are
// hashed once, and kept, since other steps and rows come through it too.
constexpr int noiseGroup = 16;  // px: what is looked up together
static_assert(noisePeriod == 1 << 10);

// Where in a cell of the noise the rays of a tile are, 0..1, and in which, ten bits an axis, from the eye's.
struct NoiseTile {
    alignas(64) Lanes x, y, z;
    alignas(64) uint32_t cell[tileWidth];
};

// Rays go 1e5 m at most through cells of .1 m and more: a million of them, far within 32 bits.
BRUME_INLINE uint32_t cellNumber(float x, float y, float z) {
    return (uint32_t(int32_t(x)) & 1023u) | (uint32_t(int32_t(y)) & 1023u) << 10 |
           (uint32_t(int32_t(z)) & 1023u) << 20;
}

// Places the tile in the cell of its first ray; false: not all are in it.
BRUME_VECTORISE inline bool placeInCell(const March& m, const float* at, NoiseTile& n) {
    const Tile& tile = m.tile;
    const float inverseSize = m.noiseInverseSize;
    const cv::Vec3f f = m.noiseFraction;
    const float first = at[0] * inverseSize;
    const float wholeX = std::floor(f[0] + tile.dx[0] * first),
                wholeY = std::floor(f[1] + tile.dy[0] * first),
                wholeZ = std::floor(f[2] + tile.dz[0] * first);
    n.cell[0] = cellNumber(wholeX, wholeY, wholeZ);
    int isApart = 0;
    BRUME_APART
    for (int x = 0; x < tileWidth; x++) {
        const float way = at[x] * inverseSize;
        n.x[x] = (f[0] + tile.dx[x] * way) - wholeX;
        n.y[x] = (f[1] + tile.dy[x] * way) - wholeY;
        n.z[x] = (f[2] + tile.dz[x] * way) - wholeZ;
        const float low = least(least(n.x[x], n.y[x]), n.z[x]), high = most(most(n.x[x], n.y[x]), n.z[x]);
        isApart |= !((low >= 0.0f) & (high < 1.0f));
    }
    return !isApart;
}

BRUME_VECTORISE inline void placeInCells(const March& m, const float* at, NoiseTile& n) {
    const Tile& tile = m.tile;
    const float inverseSize = m.noiseInverseSize;
    const cv::Vec3f f = m.noiseFraction;
    BRUME_APART
    for (int x = 0; x < tileWidth; x++) {
        const float way = at[x] * inverseSize;
        const float px = f[0] + tile.dx[x] * way, py = f[1] + tile.dy[x] * way, pz = f[2] + tile.dz[x] * way;
        const float wholeX = std::floor(px), wholeY = std::floor(py), wholeZ = std::floor(pz);
        n.x[x] = px - wholeX;
        n.y[x] = py - wholeY;
        n.z[x] = pz - wholeZ;
        n.cell[x] = cellNumber(wholeX, wholeY, wholeZ);
    }
}

// Groups of rays from the one `from`, all in the cell whose gradients are given ...
BRUME_VECTORISE inline void lookUpInCell(const NoiseTile& n, const brume::SimplexCell& gradients, int from,
                                         int groups, float* noise) {
    const brume::SimplexCell cell = gradients;
    const float *px = n.x + from, *py = n.y + from, *pz = n.z + from;
    const int count = groups * noiseGroup;
    noise += from;
    BRUME_APART
    for (int x = 0; x < count; x++) noise[x] = 0.5f + 0.5f * brume::simplexInCell(px[x], py[x], pz[x], cell);
}

// ... or in either of two ...
BRUME_INLINE brume::SimplexGradients either(bool isA, const brume::SimplexGradients& a,
                                            const brume::SimplexGradients& b) {
    return {isA ? a.x : b.x, isA ? a.y : b.y, isA ? a.z : b.z};
}
BRUME_INLINE brume::SimplexCell either(bool isA, const brume::SimplexCell& a, const brume::SimplexCell& b) {
    return {either(isA, a.corners, b.corners), either(isA, a.next, b.next), isA ? a.x : b.x, isA ? a.y : b.y,
            isA ? a.z : b.z};
}
BRUME_VECTORISE inline void lookUpInTwo(const NoiseTile& n, uint32_t first, const brume::SimplexCell& inFirst,
                                        const brume::SimplexCell& inOther, int from, float* noise) {
    const brume::SimplexCell a = inFirst, b = inOther;
    const float *px = n.x + from, *py = n.y + from, *pz = n.z + from;
    const uint32_t* cell = n.cell + from;
    noise += from;
    BRUME_APART
    for (int x = 0; x < noiseGroup; x++)
        noise[x] = 0.5f + 0.5f * brume::simplexInCell(px[x], py[x], pz[x], either(cell[x] == first, a, b));
}

// ... or each in its own.
BRUME_VECTORISE inline void lookUpInCells(const March& m, const NoiseTile& n, int from, int groups,
                                          float* noise) {
    const brume::NoiseLattice lattice = m.lattice;
    const float *px = n.x + from, *py = n.y + from, *pz = n.z + from;
    const uint32_t* cell = n.cell + from;
    const int count = groups * noiseGroup;
    noise += from;
    BRUME_APART
    for (int x = 0; x < count; x++)
        noise[x] =
            0.5f + 0.5f * brume::simplexInCell(px[x], py[x], pz[x], int32_t(cell[x] & 1023u) + lattice.cellX,
                                               int32_t(cell[x] >> 10 & 1023u) + lattice.cellY,
                                               int32_t(cell[x] >> 20) + lattice.cellZ, lattice);
}

inline const brume::SimplexCell& cellAt(March& m, uint32_t cell) {
    KnownCell& known = m.cells[(cell * 2654435769u) >> 26];
    if (!known.isKnown || known.cell != cell)
        known = {true, cell,
                 brume::simplexCell(int32_t(cell & 1023u) + m.lattice.cellX,
                                    int32_t(cell >> 10 & 1023u) + m.lattice.cellY,
                                    int32_t(cell >> 20) + m.lattice.cellZ, m.lattice)};
    return known.gradients;
}

inline void lookUpNoise(March& m, const float* at, float* noise) {
    constexpr int groups = tileWidth / noiseGroup;
    NoiseTile n;
    if (placeInCell(m, at, n)) {
        lookUpInCell(n, cellAt(m, n.cell[0]), 0, groups, noise);
        return;
    }
    placeInCells(m, at, n);
    for (int from = 0; from < tileWidth; from += noiseGroup) {
        const uint32_t first = n.cell[from], last = n.cell[from + noiseGroup - 1];
        uint32_t apart = 0, beyond = 0;
        for (int x = from; x < from + noiseGroup; x++) {
            apart |= n.cell[x] ^ first;
            beyond |= uint32_t(n.cell[x] != first) & uint32_t(n.cell[x] != last);
        }
        if (!apart) {
            lookUpInCell(n, cellAt(m, first), from, 1, noise);
        } else if (!beyond) {
            const brume::SimplexCell inFirst = cellAt(m, first);  // the other may take its place
            lookUpInTwo(n, first, inFirst, cellAt(m, last), from, noise);
        } else {
            lookUpInCells(m, n, from, 1, noise);
        }
    }
}

inline float noiseStrength(const March& m) {
    return m.p.noise == Additive ? m.p.noise_strength : -m.p.noise_strength;
}

// 6.1 How many steps of each ray are between knots: noise_every, and on rays below a quarter, an eighth, ...
// of max_distance twice, four times, ... as many. Tiles look knots up as often as their longest ray.
BRUME_VECTORISE inline void spaceKnots(March& m) {
    Tile& tile = m.tile;
    // a little below, since rays may be of round shares of it
    const float longest = 0.485f * m.p.max_distance / float(m.p.steps);
    int32_t fewest = mostDoublings, greatest = 0;
    for (int x = 0; x < tileWidth; x++) {
        const float ratio = longest / most(tile.stride[x], 1e-30f);
        int32_t bits;
        std::memcpy(&bits, &ratio, 4);
        tile.pastMask[x] = std::min(std::max((bits >> 23) - 127, 0), mostDoublings);
        fewest = std::min(fewest, tile.pastMask[x]);
        greatest = std::max(greatest, tile.pastMask[x]);
    }
    tile.knotEvery = m.p.noise_every << fewest;
    tile.areKnotsEven = fewest == greatest && m.p.method != Jittered;
    for (int x = 0; x < tileWidth; x++) {
        const int32_t times = 1 << (tile.pastMask[x] - fewest);
        tile.pastMask[x] = times - 1;
        tile.knotShare[x] = 1.0f / float(times);
    }
}

// Where knots are kept that begin `ahead` of the present stretch: in turn, where all rays move on together.
inline float* knotsOf(Tile& tile, int ahead) {
    return tile.knots[tile.areKnotsEven ? (tile.stretch + ahead) & 3 : ahead + 1];
}

// Knots of all rays, `ahead` of their own spacings beyond the end of the last `knotEvery` steps.
inline void lookUpKnots(March& m, int ahead, float* knots) {
    Tile& tile = m.tile;
    Lanes at;
    const int begun = tile.stretch * tile.knotEvery;
    for (int x = 0; x < tileWidth; x++)
        at[x] =
            tile.begin[x] + tile.stride[x] * float(begun + ahead * tile.knotEvery * (tile.pastMask[x] + 1));
    lookUpNoise(m, at, knots);
}

// 6.2 The cubic through each ray's four knots, as a factor of density, of the way g through the stretch of
// knotEvery steps that begins.
BRUME_VECTORISE inline void fitNoise(Tile& tile, const float* fresh, float strength) {
    float *a = tile.knots[0], *b = tile.knots[1], *c = tile.knots[2], *d = tile.knots[3];
    const int32_t stretch = tile.stretch;
    BRUME_APART
    for (int x = 0; x < tileWidth; x++) {
        const int32_t past = stretch & tile.pastMask[x];
        const float share = tile.knotShare[x], f = float(past) * share;
        const bool isDue = past == 0;
        a[x] = isDue ? b[x] : a[x];
        b[x] = isDue ? c[x] : b[x];
        c[x] = isDue ? d[x] : c[x];
        d[x] = isDue ? fresh[x] : d[x];
        const float first = c[x] - 0.333333333f * a[x] - 0.5f * b[x] - 0.166666667f * d[x];
        const float second = 0.5f * (a[x] + c[x]) - b[x];
        const float third = 0.166666667f * (d[x] - a[x]) + 0.5f * (b[x] - c[x]);
        const float scaled = strength * share;
        tile.cubic[0][x] = 1.0f + strength * (b[x] + f * (first + f * (second + f * third)));
        tile.cubic[1][x] = scaled * (first + f * (2.0f * second + f * (3.0f * third)));
        tile.cubic[2][x] = scaled * share * (second + f * (3.0f * third));
        tile.cubic[3][x] = scaled * share * share * third;
    }
}

// Where knots of all rays are at the same steps, every ray is as far, g, between them: the cubic through four
// is their sum, weighted alike on all.
BRUME_VECTORISE inline void weighNoise(March& m, float g) {
    Tile& tile = m.tile;
    const float strength = noiseStrength(m);
    const float lowest = 1.0f + least(strength, 0.0f), highest = 1.0f + most(strength, 0.0f);
    const float a = -0.166666667f * strength * (g * (g - 1.0f) * (g - 2.0f)),
                b = 0.5f * strength * ((g + 1.0f) * (g - 1.0f) * (g - 2.0f)),
                c = -0.5f * strength * ((g + 1.0f) * g * (g - 2.0f)),
                d = 0.166666667f * strength * ((g + 1.0f) * g * (g - 1.0f));
    const float *k0 = knotsOf(tile, -1), *k1 = knotsOf(tile, 0), *k2 = knotsOf(tile, 1),
                *k3 = knotsOf(tile, 2);
    BRUME_APART
    for (int x = 0; x < tileWidth; x++)
        tile.noise[x] =
            least(most(1.0f + ((a * k0[x] + b * k1[x]) + (c * k2[x] + d * k3[x])), lowest), highest);
}

BRUME_VECTORISE inline void interpolateNoise(March& m, int past) {
    Tile& tile = m.tile;
    const float strength = noiseStrength(m), inverse = 1.0f / float(tile.knotEvery);
    const float lowest = 1.0f + least(strength, 0.0f), highest = 1.0f + most(strength, 0.0f);
    const float *k0 = tile.cubic[0], *k1 = tile.cubic[1], *k2 = tile.cubic[2], *k3 = tile.cubic[3];
    auto factorAt = [&](int x, float g) {
        return least(most(k0[x] + g * (k1[x] + g * (k2[x] + g * k3[x])), lowest), highest);
    };
    if (m.p.method != Jittered) {  // every pixel is as far through the stretch
        const float g = (float(past) + tile.u[0]) * inverse;
        BRUME_APART
        for (int x = 0; x < tileWidth; x++) tile.noise[x] = factorAt(x, g);
        return;
    }
    for (int x = 0; x < tileWidth; x++) tile.noise[x] = factorAt(x, (float(past) + tile.u[x]) * inverse);
}

// 6.3 Noise as this method finds it, as a factor of density.
BRUME_VECTORISE inline void placeNoise(March& m, int i) {
    Tile& tile = m.tile;
    const int every = m.p.noise_every;
    if (m.p.method == SharedNoise) {
        if (i % 2) return;
        lookUpNoise(m, tile.t1, tile.noise);
    } else if (every > 1 && m.p.method != GaussLegendre && m.p.method != P2) {
        // counted: a division at every step would take as long as the arithmetic of a tile
        if (i == 0) {
            spaceKnots(m);
            tile.stretch = tile.pastKnot = 0;
            for (int k = -1; k <= 1; k++) lookUpKnots(m, k, knotsOf(tile, tile.areKnotsEven ? k : k + 1));
        } else if (++tile.pastKnot == tile.knotEvery) {
            tile.stretch++, tile.pastKnot = 0;
        }
        if (tile.areKnotsEven) {
            if (tile.pastKnot == 0) lookUpKnots(m, 2, knotsOf(tile, 2));
            weighNoise(m, (float(tile.pastKnot) + tile.u[0]) / float(tile.knotEvery));
            return;
        }
        if (tile.pastKnot == 0) {
            Lanes fresh;
            lookUpKnots(m, 2, fresh);
            fitNoise(tile, fresh, noiseStrength(m));
        }
        interpolateNoise(m, tile.pastKnot);
        return;
    } else {
        lookUpNoise(m, tile.at, tile.noise);
    }
    const float strength = noiseStrength(m);
    for (int x = 0; x < tileWidth; x++) tile.noise[x] = 1.0f + strength * tile.noise[x];
}

}  // namespace volume_fog
