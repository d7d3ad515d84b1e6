// The CPU march, step by step; same names and numbered steps as volume_fog.fs. Every loop over a tile is
// plain, and vectorises.
#pragma once

#include <bit>

#include "effect/kit/gather.hpp"
#include "volume_fog/march_noise.hpp"
#include "volume_fog/tile.hpp"

namespace volume_fog {

// 5. The bounds of step i, and where in it things are sampled.
BRUME_VECTORISE inline void placeStep(March& m, int i, float u) {
    Tile& tile = m.tile;
    if (m.p.method == Jittered) {
        const uint32_t key = m.c.view.seed ^ (uint32_t(m.c.view.frameIndex) * 0x9e3779b9u);
        for (int x = 0; x < tileWidth; x++) {
            const uint32_t hash =
                brume::latticeHash(uint32_t(tile.columnOf(x)), uint32_t(tile.rowOf(x)), uint32_t(i), key);
            tile.u[x] = float(int32_t(hash >> 8)) * 5.9604645e-8f;
        }
    } else if (i == 0 || tile.u[0] != u) {
        for (int x = 0; x < tileWidth; x++) tile.u[x] = u;
    }
    for (int x = 0; x < tileWidth; x++) {
        tile.t0[x] = tile.begin[x] + tile.stride[x] * float(i);
        tile.t1[x] = tile.begin[x] + tile.stride[x] * float(i + 1);
        tile.at[x] = tile.t0[x] + tile.u[x] * (tile.t1[x] - tile.t0[x]);
    }
    if (m.isOnlyVolume) return;
    for (int x = 0; x < tileWidth; x++) tile.stepDepth[x] = 0;
    if (!m.severalAlbedos) return;
    for (int x = 0; x < tileWidth; x++) tile.albedoRed[x] = tile.albedoGreen[x] = tile.albedoBlue[x] = 0;
}

// 7.1 2^-u for u ≥ 0, relative error below 2e-7; nothing falls off farther than to 2^-125.
BRUME_INLINE float halved(float u) {
    const float shift = 12582912.0f;  // 1.5·2^23: taking less from it rounds that to a whole number
    const float inside = least(u, 125.0f), shifted = shift - inside;
    const float r = (shift - shifted) - inside;
    float p = 1.535336188e-4f;  // Cephes' exp2f
    p = p * r + 1.339887440e-3f;
    p = p * r + 9.618437358e-3f;
    p = p * r + 5.550332471e-2f;
    p = p * r + 2.402264791e-1f;
    p = p * r + 6.931472029e-1f;
    p = p * r + 1.0f;
    // all above the whole number's own bits leave the word
    const uint32_t scale = (std::bit_cast<uint32_t>(shifted) << 23) + 0x3f800000u;
    return p * std::bit_cast<float>(scale);
}

// 7. A volume's density and its optical depth within the step: by its overlap with the step, so that a
// uniform box is exact. Falloffs count u metres beyond their start.
template <bool isOnly, bool edges, bool linear, bool exponential>
BRUME_INLINE void addVolumeLoop(Tile& tile, const VolumeTile& volume, float* depths) {
    const float* v = volume.rows;
    constexpr float toHalve = 1.44269504f;
    const float alongX = v[19] * toHalve, alongY = v[14] * toHalve, alongZ = v[23] * toHalve;
    BRUME_APART
    for (int x = 0; x < tileWidth; x++) {
        const float from = most(volume.enter[x], tile.t0[x]);
        const float length = most(least(volume.leave[x], tile.t1[x]) - from, 0.0f);
        const float at = from + tile.u[x] * length;
        float density = v[3];
        float uy = 0, ux = 0, uz = 0;
        if constexpr (linear || exponential) uy = most(tile.dy[x] * at - v[12], 0.0f);
        if constexpr (edges) {
            ux = most(std::abs(tile.dx[x] * at - v[16]) - v[17], 0.0f);
            uz = most(std::abs(tile.dz[x] * at - v[20]) - v[21], 0.0f);
        }
        if constexpr (linear) density *= most(1.0f - uy * v[13], 0.0f);
        if constexpr (linear && edges)
            density *= most(1.0f - ux * v[18], 0.0f) * most(1.0f - uz * v[22], 0.0f);
        if constexpr (exponential && edges)
            density *= halved(uy * alongY + ux * alongX + uz * alongZ);
        else if constexpr (exponential)
            density *= halved(uy * alongY);
        const float depth = length * density * tile.noise[x];
        if constexpr (isOnly) {
            tile.stepDepth[x] = depth;
        } else {
            tile.stepDepth[x] += depth;
            depths[x] = depth;
        }
    }
}

template <bool isOnly>
BRUME_INLINE void addVolumeOf(Tile& tile, const VolumeTile& volume, bool isEven, float* depths) {
    const int kind = isEven ? 0 : 4 * volume.hasEdges + 2 * volume.hasLinear + volume.hasExponential;
    switch (kind) {
        case 0:
            addVolumeLoop<isOnly, false, false, false>(tile, volume, depths);
            break;
        case 1:
            addVolumeLoop<isOnly, false, false, true>(tile, volume, depths);
            break;
        case 2:
            addVolumeLoop<isOnly, false, true, false>(tile, volume, depths);
            break;
        case 5:
            addVolumeLoop<isOnly, true, false, true>(tile, volume, depths);
            break;
        case 6:
            addVolumeLoop<isOnly, true, true, false>(tile, volume, depths);
            break;
        default:
            addVolumeLoop<isOnly, true, true, true>(tile, volume, depths);
            break;
    }
}

BRUME_VECTORISE inline void addVolume(March& m, const VolumeTile& volume, bool isEven) {
    Tile& tile = m.tile;
    if (m.isOnlyVolume) return addVolumeOf<true>(tile, volume, isEven, nullptr);
    Lanes depths;
    addVolumeOf<false>(tile, volume, isEven, depths);
    if (!m.severalAlbedos) return;
    const float* v = volume.rows;
    for (int x = 0; x < tileWidth; x++) {
        tile.albedoRed[x] += depths[x] * v[8];
        tile.albedoGreen[x] += depths[x] * v[9];
        tile.albedoBlue[x] += depths[x] * v[10];
    }
}

// 8. Light that reaches the step: ambient, sun unless in shadow ... Where in the map's floats a step is, and
// its depth there; nothing is behind a depth of -inf.
template <bool areWithin>
BRUME_INLINE void placeInMapLoop(March& m) {
    Tile& tile = m.tile;
    const float* r = m.shadowRows;
    const float width = m.mapWidth, height = m.mapHeight, u0 = r[3] * width, v0 = r[7] * height;
    const int32_t rowFloats = m.mapRowFloats, channels = m.mapChannels;
    BRUME_APART
    for (int x = 0; x < tileWidth; x++) {
        float u = u0 + tile.shadowU[x] * tile.at[x];
        float v = v0 + tile.shadowV[x] * tile.at[x];
        float d = r[11] + tile.shadowD[x] * tile.at[x];
        if constexpr (!areWithin) {
            const bool isOnIt = (u >= 0.0f) & (u < width) & (v >= 0.0f) & (v < height) & (d <= 1.0f);
            d = isOnIt ? d : -HUGE_VALF;
            u = least(most(u, 0.0f), width - 1.0f);
            v = least(most(v, 0.0f), height - 1.0f);
        }
        tile.mapIndex[x] = int32_t(v) * rowFloats + channels * int32_t(u);
        tile.sunDepth[x] = d;
    }
}

BRUME_VECTORISE inline void placeInMap(March& m, bool areWithin) {
    if (areWithin)
        placeInMapLoop<true>(m);
    else
        placeInMapLoop<false>(m);
}

/// Whether any of the rays may be in shadow during step i.
inline bool shadeStep(March& m, int i) {
    if (!m.hasShadow) return false;
    Tile& tile = m.tile;
    const float begin = float(i), end = begin + 1.0f;
    if (!(end + 1.0f > tile.firstInMap && begin - 1.0f < tile.lastInMap)) return false;
    placeInMap(m, begin - 1.0f > tile.firstWhollyIn && end + 1.0f < tile.lastWhollyIn);
    brume::gather(m.mapFloats, tile.mapIndex, tile.nearest, tileWidth);
    return true;
}

// Share of sunlight that arrives.
BRUME_INLINE float sunShare(const Tile& tile, int x, float shaded) {
    return tile.sunDepth[x] > tile.nearest[x] ? shaded : 1.0f;
}

BRUME_VECTORISE inline void lightStep(Tile& tile, bool isInMap) {
    for (int k = 0; k < 3; k++) tile.source[k] = isInMap ? tile.light[k] : tile.lit[k];
    if (!isInMap) return;
    for (int x = 0; x < tileWidth; x++) {
        const bool isShaded = tile.sunDepth[x] > tile.nearest[x];
        for (int k = 0; k < 3; k++) tile.light[k][x] = isShaded ? tile.dim[k][x] : tile.lit[k][x];
    }
}

// 8.1 An angle of 0..π from its sine and cosine times anything positive.
BRUME_INLINE float angleOf(float sine, float cosine) {
    const float a = std::abs(cosine);
    const float small = least(sine, a), large = most(most(sine, a), 1e-30f);
    // tan²-halving once, then the series: arctan q = 2·arctan(q/(1 + √(1 + q²))), |q| ≤ 1 becomes ≤ √2 - 1
    const float q = small / large;
    const float t = q / (1.0f + std::sqrt(1.0f + q * q));
    const float s = t * t;
    const float arctan =
        2.0f * t *
        (1.0f +
         s * (-0.333333333f +
              s * (0.2f + s * (-0.142857143f + s * (0.111111111f + s * (-0.0909090909f +
                                                                        s * (0.0769230769f - s * 0.05f)))))));
    const float acute = sine > a ? 1.57079633f - arctan : arctan;
    return cosine < 0.0f ? 3.14159265f - acute : acute;
}

// 8.2 ... and each lamp: its mean over the part of the step that is within its range. By midpoint, or
// (equiangular) with 1/(distance² + core²) integrated exactly as the angle it subtends, the rest taken at the
// angle's middle. A whole step's midpoint needs no parts: the same without what is then 1.
enum class LampStep { Part, Whole, Equiangular };

template <LampStep kind, bool isotropic, bool isWeighed>
BRUME_INLINE void addLampLoop(Tile& tile, LampTile& lamp, int phase, float asymmetry) {
    const float* l = lamp.rows;
    const float g = std::abs(asymmetry), side = asymmetry < 0 ? -1.0f : 1.0f;
    alignas(64) Lanes mean;
    BRUME_APART
    for (int x = 0; x < tileWidth; x++) {
        float beyond;
        if constexpr (kind == LampStep::Whole) {
            beyond = tile.at[x] - lamp.along[x];
            const float distance2 = lamp.apart2[x] + beyond * beyond;
            mean[x] = l[7] / (l[8] + l[9] * brume::sqrtFast(distance2) + l[10] * distance2);
        } else {
            const float from = most(lamp.enter[x], tile.t0[x]);
            const float length = most(least(lamp.leave[x], tile.t1[x]) - from, 0.0f);
            const float a = from - lamp.along[x], b = a + length;  // m past the closest approach
            const float step = most(tile.t1[x] - tile.t0[x], 1e-30f);
            if constexpr (kind == LampStep::Equiangular) {
                const float core2 = lamp.apart2[x] + l[11], core = std::sqrt(core2);
                const float ra = std::sqrt(core2 + a * a), rb = std::sqrt(core2 + b * b);
                beyond = (a * rb + b * ra) / (ra + rb);
                const float angle = angleOf(core * length, core2 + a * b);
                const float distance2 = lamp.apart2[x] + beyond * beyond;
                const float attenuation = l[8] + l[9] * std::sqrt(distance2) + l[10] * distance2;
                mean[x] = l[7] / step * (angle / core) * ((core2 + beyond * beyond) / attenuation);
            } else {
                beyond = a + tile.u[x] * length;
                const float distance2 = lamp.apart2[x] + beyond * beyond;
                mean[x] = l[7] * length / (step * (l[8] + l[9] * std::sqrt(distance2) + l[10] * distance2));
            }
        }
        if constexpr (!isotropic) {
            // The versine of the angle to the lamp, without cancellation looking into it.
            const float c = beyond * side;
            const float distance = most(std::sqrt(lamp.apart2[x] + c * c), 1e-18f);
            const float versine =
                c < 0.0f ? lamp.apart2[x] / (distance * (distance - c)) : 1.0f + c / distance;
            mean[x] *= scatteredShare(phase, g, versine);
        }
        if constexpr (isWeighed) lamp.weight[x] += tile.weight[x] * mean[x];
    }
    if constexpr (isWeighed) return;
    for (int k = 0; k < 3; k++) {
        const float color = isotropic ? 0.25f * l[4 + k] : l[4 + k];
        if (color == 0.0f) continue;
        const float* other = tile.source[k];
        float* sum = tile.light[k];
        BRUME_APART
        for (int x = 0; x < tileWidth; x++) sum[x] = other[x] + mean[x] * color;
        tile.source[k] = sum;
    }
}

template <LampStep kind, bool isWeighed>
BRUME_INLINE void addLampOf(March& m, LampTile& lamp) {
    if (m.p.phase == Isotropic)
        addLampLoop<kind, true, isWeighed>(m.tile, lamp, Isotropic, 0);
    else
        addLampLoop<kind, false, isWeighed>(m.tile, lamp, m.p.phase, m.asymmetry);
}

template <bool isWeighed>
BRUME_INLINE void addLampBy(March& m, LampTile& lamp, bool isWhole) {
    if (m.p.method == Equiangular)
        addLampOf<LampStep::Equiangular, isWeighed>(m, lamp);
    else if (isWhole)
        addLampOf<LampStep::Whole, isWeighed>(m, lamp);
    else
        addLampOf<LampStep::Part, isWeighed>(m, lamp);
}

BRUME_VECTORISE inline void addLamp(March& m, LampTile& lamp, bool isWhole) {
    addLampBy<false>(m, lamp, isWhole);
}
BRUME_VECTORISE inline void weighLamp(March& m, LampTile& lamp, bool isWhole) {
    addLampBy<true>(m, lamp, isWhole);
}

// Lamps that no ray of the tile is near during step i (or one beside it, for rounding) add nothing.
template <void (*add)(March&, LampTile&, bool)>
inline void forLampsNear(March& m, int i) {
    const float begin = float(i), end = begin + 1.0f;
    for (int k = 0; k < m.lampCount; k++) {
        LampTile& lamp = m.lamps[k];
        if (end + 1.0f > lamp.firstStep && begin - 1.0f < lamp.lastStep)
            add(m, lamp, begin - 1.0f > lamp.firstWhole && end + 1.0f < lamp.lastWhole);
    }
}
inline void addLamps(March& m, int i) { forLampsNear<addLamp>(m, i); }
inline void weighLamps(March& m, int i) { forLampsNear<weighLamp>(m, i); }

// Falloffs that have not begun on any ray of the tile by the end of step i are factors of 1.
inline void addVolumes(March& m, int i) {
    const float end = m.tile.beginLast + m.tile.strideLast * float(i + 1);
    for (int k = 0; k < m.volumeCount; k++) {
        const VolumeTile& volume = m.volumes[k];
        if (volume.last > volume.first) addVolume(m, volume, end <= volume.evenUntil);
    }
}

// 9. The albedo of the step's mixture.
BRUME_VECTORISE inline void tintStep(Tile& tile) {
    const float* albedo[3] = {tile.albedoRed, tile.albedoGreen, tile.albedoBlue};
    for (int k = 0; k < 3; k++) {
        const float* light = tile.source[k];
        BRUME_APART
        for (int x = 0; x < tileWidth; x++)
            tile.light[k][x] = light[x] * (albedo[k][x] * (1.0f / most(tile.stepDepth[x], 1e-30f)));
        tile.source[k] = tile.light[k];
    }
}

// 10. What the step scatters towards the eye: S·T·(1 - e^-Δτ), exact for constant S. Light that differs from
// step to step only by shadow, and lamps, needs no sums of colours: weights are summed.
template <bool areThin, bool isInMap>
BRUME_INLINE void addStepLoop(Tile& tile) {
    BRUME_APART
    for (int x = 0; x < tileWidth; x++) {
        const float depth = least(tile.stepDepth[x], tile.stop[x] - tile.depth[x]);
        const float opacity = areThin ? 0.0f - brume::expm1Small(-depth) : brume::extinctionOf(depth).opacity;
        const float weight = tile.through[x] * opacity;
        tile.weight[x] = weight;
        if constexpr (isInMap) {
            const bool isShaded = tile.sunDepth[x] > tile.nearest[x];
            tile.litWeight[x] += isShaded ? 0.0f : weight;
            tile.dimWeight[x] += isShaded ? weight : 0.0f;
        } else {
            tile.litWeight[x] += weight;
        }
        tile.through[x] -= weight;
        tile.depth[x] += depth;
    }
}

BRUME_VECTORISE inline void addStepLight(Tile& tile) {
    float* sums[3] = {tile.red, tile.green, tile.blue};
    for (int k = 0; k < 3; k++) {
        float* sum = sums[k];
        const float* light = tile.source[k];
        BRUME_APART
        for (int x = 0; x < tileWidth; x++) sum[x] += tile.weight[x] * light[x];
    }
}

BRUME_VECTORISE inline void addWeighedLight(March& m) {
    Tile& tile = m.tile;
    float* sums[3] = {tile.red, tile.green, tile.blue};
    for (int k = 0; k < 3; k++) {
        float* sum = sums[k];
        BRUME_APART
        for (int x = 0; x < tileWidth; x++)
            sum[x] = tile.litWeight[x] * tile.lit[k][x] + tile.dimWeight[x] * tile.dim[k][x];
        for (int lamp = 0; lamp < m.lampCount; lamp++) {
            const float own = m.lamps[lamp].rows[4 + k], color = m.p.phase == Isotropic ? 0.25f * own : own;
            const float* weight = m.lamps[lamp].weight;
            if (color == 0.0f) continue;
            BRUME_APART
            for (int x = 0; x < tileWidth; x++) sum[x] += weight[x] * color;
        }
    }
}

// Thin steps need no reduction of the exponent. They are at most as dense as volumes and noise together can
// be, and as long as their ends' roundings make them.
inline bool areStepsThin(const March& m) {
    constexpr float thin = 0.34f;
    const float end = m.tile.beginLast + m.tile.strideLast * float(m.p.steps);
    const float added = m.p.noise == Additive ? m.p.noise_strength : 0.0f;
    float density = 0;
    for (int k = 0; k < m.volumeCount; k++) density += m.volumes[k].rows[3];
    return (m.tile.strideLast + 2.4e-7f * end) * (1.0f + added) * density < 0.99f * thin;
}

BRUME_VECTORISE inline void addStep(Tile& tile, bool areThin, bool isInMap) {
    if (areThin && isInMap)
        addStepLoop<true, true>(tile);
    else if (areThin)
        addStepLoop<true, false>(tile);
    else if (isInMap)
        addStepLoop<false, true>(tile);
    else
        addStepLoop<false, false>(tile);
}

BRUME_VECTORISE inline bool isSaturated(const Tile& tile) {
    int isOpen = 0;
    for (int x = 0; x < tileWidth; x++) isOpen |= tile.stop[x] - tile.depth[x] > 0.0f;
    return !isOpen;
}

}  // namespace volume_fog
