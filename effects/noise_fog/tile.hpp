// noise_fog's CPU half on a tile of one row; numbered as in noise_fog.fs. To be inlined into functions marked
// BRUME_VECTORISE.
#pragma once

#include "common/fog.hpp"
#include "common/sun_offset.hpp"
#include "effect/plugin.hpp"
#include "noise_fog/methods.hpp"
#include "noise_fog/params.hpp"
#include "noise_fog/texels.hpp"

namespace brume::noise_fog {

constexpr float endlessWay = 1e30f;
constexpr float farCells = 4096;

// fp32 constants of one call.
struct Constants {
    NoiseLattice lattice;
    float fraction[3], inverseSize, inverseDistance, toSun[3];
    const float* volume;
    Texels* texels;  // instead of the volume, if any
    int edge;
    Product product;
    bool isGround, varyingAirlight;
};

inline Constants constantsOf(const NoiseFog& p, const CpuContext& c) {
    Constants k{};
    const auto cell = c.derived("noise_cell"), fraction = c.derived("noise_fraction");
    k.lattice = {int(cell[0]), int(cell[1]), int(cell[2]), uint32_t(p.tile) - 1, uint32_t(p.seed)};
    k.inverseSize = c.derived("inverse_size")[0];
    k.inverseDistance = c.derived("inverse_distance")[0];
    k.volume = c.derived("baked").data();
    k.texels = nullptr;
    k.edge = int(c.derived("baked_edge")[0]);
    k.isGround = p.isGround();
    k.varyingAirlight = p.hasSun() || (p.where != asAProduct && p.color != p.colorHigh);
    const auto points = c.derived("axis_points"), begin = c.derived("axis_begin"),
               log = c.derived("axis_log");
    k.product.lattice = k.lattice;
    k.product.inverseSize = k.inverseSize;
    k.product.low = p.low, k.product.high = p.high, k.product.octaves = p.octaves;
    for (int a = 0; a < 3; a++) {
        k.fraction[a] = k.product.fraction[a] = fraction[a];
        k.toSun[a] = c.derived("to_sun")[a];
        k.product.axis[a] = p.axis(a);
        k.product.log[a] = log[a];
        k.product.points[a] = points.data() + 4 * int(begin[a]);
        k.product.count[a] = int(begin[a + 1]) - int(begin[a]);
    }
    return k;
}

// A tile of one row: ways, rays in the world (of planar length 1), the noise's coordinates, the noise.
struct Tile : FogTile {
    float L[fogTileSize], length[fogTileSize], ray[3][fogTileSize];
    float reach[fogTileSize];  // how much of the planar depth the noise looks at
    float p[3][fogTileSize], noise[fogTileSize], sum[fogTileSize];
    float relative[fogTileSize];
};

BRUME_INLINE void raysTile(const View& v, const float* depth, int i0, float y, int count, Tile& t) {
    const auto r = v.worldFromView;
    const float originX = v.originX, inverseFx = v.inverseFx;
    for (int i = 0; i < count; i++) {
        const float x = (float(i0 + i) + originX) * inverseFx;
        t.length[i] = View::rayLength(x, y);
        t.L[i] = depth[i] * t.length[i];
        t.ray[0][i] = (r(0, 0) * x + r(0, 1) * y) - r(0, 2);
        t.ray[1][i] = (r(1, 0) * x + r(1, 1) * y) - r(1, 2);
        t.ray[2][i] = (r(2, 0) * x + r(2, 1) * y) - r(2, 2);
    }
}

// 1. The noise at the coordinates p.
template <NoiseKind kind>
BRUME_INLINE void proceduralTile(const Constants& k, int octaves, int count, Tile& t) {
    float weight = 1, scale = 1, total = 0;
    for (int i = 0; i < count; i++) t.noise[i] = 0;
    for (int octave = 0; octave < octaves; octave++) {
        const NoiseLattice l = octaveLattice(k.lattice, octave);
        for (int i = 0; i < count; i++) {
            const float x = t.p[0][i] * scale, y = t.p[1][i] * scale, z = t.p[2][i] * scale;
            const float n = kind == NoiseKind::Perlin ? perlinNoise(x, y, z, l) : simplexNoise(x, y, z, l);
            t.noise[i] += weight * n;
        }
        total += weight;
        weight *= 0.5f;
        scale *= 2.0f;
    }
    for (int i = 0; i < count; i++) t.noise[i] = 0.5f + 0.5f * (t.noise[i] / total);
}

BRUME_INLINE void exactTile(const NoiseFog& p, const Constants& k, int count, Tile& t) {
    if (p.noise == int(NoiseKind::Perlin))
        proceduralTile<NoiseKind::Perlin>(k, p.octaves, count, t);
    else
        proceduralTile<NoiseKind::Simplex>(k, p.octaves, count, t);
}

// 1.1 The baked noise, not smoothed, without its volume: texels are computed as they are asked for.
BRUME_INLINE void texelsTile(const NoiseFog& p, const Constants& k, int count, Tile& t) {
    const int edge = k.edge, mask = edge - 1, texels = edge / p.tile;
    const int cell[3] = {k.lattice.cellX, k.lattice.cellY, k.lattice.cellZ};
    float share[3][fogTileSize], value[8][fogTileSize];
    int place[8][fogTileSize], low[3][fogTileSize], missing[8 * fogTileSize], unknown = 0;
    for (int a = 0; a < 3; a++)
        for (int i = 0; i < count; i++) {
            const float q = t.p[a][i] * float(texels), whole = std::floor(q);
            share[a][i] = q - whole;
            low[a][i] = cellNumber(whole) + cell[a] * texels;
        }
    for (int corner = 0; corner < 8; corner++)
        for (int i = 0; i < count; i++)
            place[corner][i] =
                ((low[0][i] + (corner & 1)) & mask) + edge * (((low[1][i] + (corner >> 1 & 1)) & mask) +
                                                              edge * ((low[2][i] + (corner >> 2)) & mask));
    for (int corner = 0; corner < 8; corner++)
        for (int i = 0; i < count; i++) {
            value[corner][i] = (*k.texels)[place[corner][i]];
            missing[unknown] = place[corner][i];
            unknown += value[corner][i] == 0;
        }
    if (unknown > 0) {
        const float texel = 1.0f / float(texels);
        for (int first = 0; first < unknown; first += fogTileSize) {
            const int some = std::min(unknown - first, fogTileSize);
            for (int i = 0; i < some; i++) {
                const int at = missing[first + i];
                t.p[0][i] = float((at & mask) - cell[0] * texels) * texel;
                t.p[1][i] = float((at / edge & mask) - cell[1] * texels) * texel;
                t.p[2][i] = float(at / edge / edge - cell[2] * texels) * texel;
            }
            exactTile(p, k, some, t);
            for (int i = 0; i < some; i++) k.texels->set(missing[first + i], t.noise[i]);
        }
        for (int corner = 0; corner < 8; corner++)
            for (int i = 0; i < count; i++) value[corner][i] = (*k.texels)[place[corner][i]];
    }
    for (int axis = 0; axis < 3; axis++)
        for (int corner = 0; corner < 4 >> axis; corner++)
            for (int i = 0; i < count; i++)
                value[corner][i] =
                    value[2 * corner][i] + share[axis][i] * (value[2 * corner + 1][i] - value[2 * corner][i]);
    for (int i = 0; i < count; i++) t.noise[i] = value[0][i];
}

// 1.2 Smoothed (P5), the noise is a weighted mean of that at texels' distances round a place.
BRUME_INLINE void unsmoothedTile(const NoiseFog& p, const Constants& k, int count, Tile& t) {
    if (p.method == baked)
        texelsTile(p, k, count, t);
    else
        exactTile(p, k, count, t);
}
BRUME_INLINE void smoothedTile(const NoiseFog& p, const Constants& k, int count, Tile& t) {
    const float texel = float(p.tile) / float(p.edge());
    const int s = p.smoothingRow(), neighbours = 2 * s + 1;
    const float rows[3][5] = {{1}, {0.25f, 0.5f, 0.25f}, {0.0625f, 0.25f, 0.375f, 0.25f, 0.0625f}};
    float from[3][fogTileSize], sum[fogTileSize];
    for (int a = 0; a < 3; a++)
        for (int i = 0; i < count; i++) from[a][i] = t.p[a][i] - float(s) * texel;
    for (int i = 0; i < count; i++) sum[i] = 0;
    for (int z = 0; z < neighbours; z++)
        for (int y = 0; y < neighbours; y++)
            for (int x = 0; x < neighbours; x++) {
                for (int i = 0; i < count; i++) {
                    t.p[0][i] = from[0][i] + float(x) * texel;
                    t.p[1][i] = from[1][i] + float(y) * texel;
                    t.p[2][i] = from[2][i] + float(z) * texel;
                }
                unsmoothedTile(p, k, count, t);
                const float weight = rows[s][x] * rows[s][y] * rows[s][z];
                for (int i = 0; i < count; i++) sum[i] += weight * t.noise[i];
            }
    for (int i = 0; i < count; i++) t.noise[i] = sum[i];
}
BRUME_INLINE void noiseTile(const NoiseFog& p, const Constants& k, int count, Tile& t) {
    if (p.method == baked && !k.texels) {
        const int texels = k.edge / p.tile, edge = k.edge;
        const float scale = float(texels), *volume = k.volume;
        const int baseX = k.lattice.cellX * texels, baseY = k.lattice.cellY * texels,
                  baseZ = k.lattice.cellZ * texels;
        for (int i = 0; i < count; i++)
            t.noise[i] = volumeNoise(volume, edge, t.p[0][i] * scale, t.p[1][i] * scale, t.p[2][i] * scale,
                                     baseX, baseY, baseZ);
    } else if (p.smoothingRow() > 0) {
        smoothedTile(p, k, count, t);
    } else {
        unsmoothedTile(p, k, count, t);
    }
}

// Coordinates at `part` of the reach.
BRUME_INLINE void cellsTile(const Constants& k, float part, int count, Tile& t) {
    const float inverseSize = k.inverseSize, vertical = k.isGround ? 0.0f : 1.0f;
    const float f0 = k.fraction[0], f1 = k.fraction[1], f2 = k.fraction[2];
    for (int i = 0; i < count; i++) {
        const float cells = (t.reach[i] * part) * inverseSize;
        t.p[0][i] = f0 + t.ray[0][i] * cells;
        t.p[1][i] = f1 + t.ray[1][i] * cells * vertical;
        t.p[2][i] = f2 + t.ray[2][i] * cells;
    }
}

// 2. The noise of each pixel: at its surface, or its mean along the ray.
BRUME_INLINE void pixelNoiseTile(const NoiseFog& p, const Constants& k, const float* depth, int count,
                                 Tile& t) {
    if (p.where == atTheSurface) {
        const float far = farCells / k.inverseSize * 1.0001f, inverseSize = k.inverseSize;
        for (int i = 0; i < count; i++) t.reach[i] = depth[i] < far ? depth[i] : far;
        cellsTile(k, 1.0f, count, t);
        noiseTile(p, k, count, t);
        for (int i = 0; i < count; i++) t.noise[i] = t.L[i] * inverseSize > farCells ? 0.5f : t.noise[i];
        return;
    }
    const float range = p.range, steps = float(p.steps);
    for (int i = 0; i < count; i++) {
        t.sum[i] = 0;
        t.reach[i] = (t.L[i] < range ? t.L[i] : range) / t.length[i];
    }
    for (int step = 0; step < p.steps; step++) {
        cellsTile(k, (float(step) + 0.5f) / steps, count, t);
        noiseTile(p, k, count, t);
        for (int i = 0; i < count; i++) t.sum[i] += t.noise[i];
    }
    for (int i = 0; i < count; i++) {
        const float share = t.L[i] > range ? range / t.L[i] : 1.0f;
        t.noise[i] = 0.5f + share * (t.sum[i] / steps - 0.5f);
    }
}

// 3. Relative density.
template <int mode>
BRUME_INLINE void modulateTile(const NoiseFog& p, const float* depth, int count, Tile& t) {
    for (int i = 0; i < count; i++) {
        const float planar = depth[i] < 1e15f ? depth[i] : 1e15f;
        t.relative[i] = modulated<mode>(p, t.noise[i], planar * t.ray[1][i]);
    }
}

// 6. Transmittance and opacity of the model.
BRUME_INLINE void modelTile(const NoiseFog& p, const Constants& k, int count, Tile& t) {
    const float start = p.start, density = p.density, limit = p.maxOpacity, exponent = p.powerExponent;
    const float inverseDistance = k.inverseDistance;
    float *transmittance = t.transmittance[0], *opacity = t.opacity[0];
    if (p.model == exponential) {
        for (int i = 0; i < count; i++) {
            float x = t.L[i] - start;
            x = x > 0.0f ? x : 0.0f;
            x = x < endlessWay ? x : endlessWay;
            const Extinction e = extinctionOf(density * x * t.relative[i]);
            const bool isOver = e.opacity > limit;
            transmittance[i] = isOver ? 1.0f - limit : e.transmittance;
            opacity[i] = isOver ? limit : e.opacity;
        }
        return;
    }
    for (int i = 0; i < count; i++) {
        float x = t.L[i] - start;
        x = x > 0.0f ? x : 0.0f;
        x = x < endlessWay ? x : endlessWay;
        float u = powFast(x * inverseDistance, exponent);
        u = u < endlessWay ? u : endlessWay;
        const float whole = t.relative[i] * u;
        opacity[i] = whole < limit ? whole : limit;
        transmittance[i] = 1.0f - opacity[i];
    }
}

// 5. Airlight.
BRUME_INLINE void airlightTile(const NoiseFog& p, const Constants& k, int count, Tile& t) {
    for (int n = 0; n < 3; n++) {
        const float a = p.color[n], b = p.colorHigh[n] - p.color[n];
        for (int i = 0; i < count; i++) t.airlight[n][i] = a + t.noise[i] * b;
    }
    if (!p.hasSun()) return;
    const float exponent = p.sunExponent;
    const float s0 = k.toSun[0], s1 = k.toSun[1], s2 = k.toSun[2];
    const float c0 = p.sunColor[0], c1 = p.sunColor[1], c2 = p.sunColor[2];
    float x[fogTileSize], y[fogTileSize], z[fogTileSize];
    for (int i = 0; i < count; i++) {
        const float shorten = 1.0f / t.length[i];
        x[i] = t.ray[0][i] * shorten, y[i] = t.ray[1][i] * shorten, z[i] = t.ray[2][i] * shorten;
    }
    offsetDirections(x, y, z, t.L, p.sunOffset, count);
    for (int i = 0; i < count; i++) {
        const float cosine = x[i] * s0 + y[i] * s1 + z[i] * s2;
        const float lobe = powFast(cosine > 0.0f ? cosine : 0.0f, exponent);
        t.airlight[0][i] += c0 * lobe;
        t.airlight[1][i] += c1 * lobe;
        t.airlight[2][i] += c2 * lobe;
    }
}

// Relative density is known.
BRUME_INLINE void densityTile(const NoiseFog& p, const Constants& k, int count, Tile& t) {
    modelTile(p, k, count, t);
    if (k.varyingAirlight) airlightTile(p, k, count, t);
}

// The noise is known.
BRUME_INLINE void noisyTile(const NoiseFog& p, const Constants& k, const float* depth, int count, Tile& t) {
    if (p.mode == modulate)
        modulateTile<modulate>(p, depth, count, t);
    else if (p.mode == ocean)
        modulateTile<ocean>(p, depth, count, t);
    else if (p.mode == additive)
        modulateTile<additive>(p, depth, count, t);
    else
        modulateTile<subtractive>(p, depth, count, t);
    densityTile(p, k, count, t);
}

BRUME_INLINE void fogTile(const NoiseFog& p, const Constants& k, const float* depth, int count, Tile& t) {
    if (p.where != asAProduct) {
        pixelNoiseTile(p, k, depth, count, t);
        noisyTile(p, k, depth, count, t);
        return;
    }
    for (int i = 0; i < count; i++) {
        const float unit = 1.0f / t.length[i];
        t.relative[i] = k.product.mean(t.ray[0][i] * unit, t.ray[1][i] * unit, t.ray[2][i] * unit, t.L[i]);
        t.noise[i] = 0;
    }
    densityTile(p, k, count, t);
}

}  // namespace brume::noise_fog
