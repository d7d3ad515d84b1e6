// What a CPU march begins with. It works on a tile of neighbouring pixels at a time, structure of arrays, one
// plain loop a numbered step, so that the compiler fills its vectors with neighbouring pixels. Same names and
// steps as volume_fog.fs.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/noise.hpp"
#include "common/phase.hpp"
#include "effect/kit/math.hpp"
#include "effect/plugin.hpp"
#include "volume_fog/derive.hpp"
#include "volume_fog/volume_fog.hpp"

/// Before a loop that goes through pointers: their memory is not the same.
#define BRUME_APART _Pragma("GCC ivdep")

namespace volume_fog {

constexpr int tileWidth = 64;  // px: of one row, or of several below each other
constexpr int squareBits = 3;  // of a square tile's pixel numbers: those that count along its rows
constexpr int mostVolumes = 33, mostLamps = 32;
using Lanes = float[tileWidth];

BRUME_INLINE float least(float a, float b) { return a < b ? a : b; }
BRUME_INLINE float most(float a, float b) { return a > b ? a : b; }
BRUME_INLINE float clampUnit(float x) { return least(most(x, 0.0f), 1.0f); }

// A volume's overlap with the view rays, and what is uniform about it.
struct VolumeTile {
    alignas(64) Lanes enter, leave;  // m along the ray
    const float* rows;               // its numbers (derive.hpp)
    bool hasLinear, hasExponential, hasEdges;
    float first, last;  // over the tile
    float evenUntil;    // m along the rays: no falloff has begun on any of them
};

// A lamp as the rays pass it.
struct LampTile {
    alignas(64) Lanes along, apart2;  // m to its closest approach, and its distance² there
    Lanes enter, leave;               // m, within range
    Lanes weight;                     // of its colour in what is in-scattered so far
    const float* rows;
    float firstStep, lastStep;    // of the march, whose rays come within its range
    float firstWhole, lastWhole;  // within which all rays' steps wholly are
};

// What a march carries for each pixel.
struct Tile {
    alignas(64) Lanes dx, dy, dz, far;   // unit ray, m to the surface
    float scene[4 * tileWidth];          // colour behind the fog
    Lanes begin, stride;                 // m: fogged part of the ray, and its share of a step
    Lanes depth, through, stop;          // optical depth so far, transmittance so far, depth to stop at
    Lanes red, green, blue;              // in-scattered so far
    Lanes weight, litWeight, dimWeight;  // of a step's light in that, and of steps in light and in shadow
    Lanes lit[3], dim[3];                // light of the sky and of the sun, the latter in shadow or not
    Lanes shadowU, shadowV, shadowD;     // way through the shadow map per m: texels, texels, depth
    // of the current step
    Lanes t0, t1, at, u, noise;  // m, m, m, 0..1, factor
    Lanes knots[4], cubic[4];    // noise round the step, when it is not looked up at every one
    Lanes stepDepth, albedoRed, albedoGreen, albedoBlue;
    Lanes light[3];          // where it is not just lit
    const float* source[3];  // what arrives: light or lit
    Lanes sunDepth,
        nearest;  // where a ray may be in shadow: its depth in the map, -inf off it, and the map's there
    alignas(64) int32_t mapIndex[tileWidth];
    alignas(64)
        int32_t pastMask[tileWidth];  // each ray's way between knots in the tile's, a power of two, less 1,
    Lanes knotShare;                  // and 1 over it
    bool areKnotsEven = false;        // all rays' are at the same steps, and sampled as far between them
    int knotEvery = 1, stretch = 0, pastKnot = 0;  // steps between knots; how many such are past, and steps
    int column = 0, row = 0;
    int rowBits = 6;  // of a pixel's number: those that count it along its row
    int columnOf(int x) const { return column + (x & ((1 << rowBits) - 1)); }
    int rowOf(int x) const { return row + (x >> rowBits); }
    float beginLast = 0, strideLast = 0;
    float firstInMap, lastInMap;        // steps of the march where a ray may be in shadow ...
    float firstWhollyIn, lastWhollyIn;  // ... and where all rays are within the shadow map
};

// The gradients of a cell of the noise, counted from the eye's.
struct KnownCell {
    bool isKnown = false;
    uint32_t cell;
    brume::SimplexCell gradients;
};

struct March {
    const Params& p;
    const brume::CpuContext& c;
    brume::NoiseLattice lattice;
    cv::Vec3f noiseFraction;
    float noiseInverseSize;
    const float* shadowRows;
    bool hasShadow;
    const float* mapFloats;
    float mapWidth, mapHeight;
    int32_t mapRowFloats, mapChannels;
    cv::Vec3f towardsSun, sunLight, ambient;
    float asymmetry;  // mean cosine of scattering of a phase function that has one
    int volumeCount, lampCount;
    bool severalAlbedos = false, isOnlyVolume;  // nothing else adds to a step's depth
    VolumeTile volumes[mostVolumes];
    LampTile lamps[mostLamps];
    Tile tile;
    static constexpr uint32_t knownCells = 64;
    KnownCell cells[knownCells];

    March(const Params& params, const brume::CpuContext& context);
};

inline March::March(const Params& params, const brume::CpuContext& context)
    : p(params), c(context), shadowRows(c.derived("shadow").data()) {
    const cv::Mat& map = c.image("shadow_map");
    mapFloats = map.ptr<float>();
    mapWidth = float(map.cols), mapHeight = float(map.rows);
    mapRowFloats = int32_t(map.step1()), mapChannels = map.channels();
    const auto cell = c.derived("noise_cell"), fraction = c.derived("noise_fraction");
    lattice = {int32_t(cell[0]), int32_t(cell[1]), int32_t(cell[2]), noisePeriod - 1, uint32_t(p.noise_seed)};
    noiseInverseSize = 1.0f / p.noise_size;
    const auto sun = c.derived("towards_sun");
    for (int k = 0; k < 3; k++) {
        noiseFraction[k] = fraction[k];
        towardsSun[k] = sun[k];
        sunLight[k] = p.sun_color[k] * p.sun_intensity;
        ambient[k] = p.ambient[k] * p.ambient_intensity;
    }
    asymmetry = p.phase == HenyeyGreenstein ? p.anisotropy : 0;
    hasShadow = p.shadow_strength > 0 && p.sun_intensity > 0 &&
                (shadowRows[0] != 0 || shadowRows[1] != 0 || shadowRows[2] != 0);
    volumeCount = int(c.derived("volume_count")[0]);
    for (int k = 0; k < volumeCount; k++) {
        const float* rows = c.derived("volumes").data() + 4 * volumeRows * k;
        volumes[k].rows = rows;
        volumes[k].hasEdges = rows[18] != 0 || rows[19] != 0 || rows[22] != 0 || rows[23] != 0;
        volumes[k].hasLinear = rows[13] != 0 || rows[18] != 0 || rows[22] != 0;
        volumes[k].hasExponential = rows[14] != 0 || rows[19] != 0 || rows[23] != 0;
    }
    for (int k = 1; k < volumeCount; k++)
        severalAlbedos |= std::memcmp(volumes[k].rows + 8, volumes[0].rows + 8, 3 * sizeof(float)) != 0;
    isOnlyVolume = volumeCount == 1 && p.method != P2;
    lampCount = int(p.point_lights.size());
    for (int k = 0; k < lampCount; k++) lamps[k].rows = c.derived("lamps").data() + 4 * lampRows * k;
}

// 4π·p in units of isotropic scattering would be 1; light is given as a white surface shows it, hence π.
BRUME_INLINE float scatteredShare(int phase, float g, float versine) {
    constexpr float pi = 3.14159265f;
    if (phase == HenyeyGreenstein) return pi * brume::henyeyGreensteinPhase(g, versine);
    if (phase == Rayleigh) return pi * brume::rayleighPhase(versine);
    return 0.25f;
}

// A row of a tile: mostly of the width that a square one's have, which needs no call.
template <int channels>
inline void copyPixels(float* to, const float* from, int count) {
    constexpr int usual = 1 << squareBits;
    if (count == usual)
        std::memcpy(to, from, channels * usual * sizeof(float));
    else
        std::memcpy(to, from, size_t(channels * count) * sizeof(float));
}

// The tile's part of an image; beside the image its last column goes on.
template <int channels>
inline void takeTile(const March& m, const cv::Mat& image, float* to) {
    const Tile& tile = m.tile;
    const int width = 1 << tile.rowBits, count = std::min(width, m.c.view.width - tile.column);
    for (int from = 0; from < tileWidth; from += width, to += channels * width) {
        copyPixels<channels>(to, image.ptr<float>(tile.rowOf(from)) + channels * tile.column, count);
        for (int x = channels * count; x < channels * width; x++) to[x] = to[x - channels];
    }
}

// 1. The rays of a tile: unit direction, and how far they go.
BRUME_VECTORISE inline void castRays(March& m) {
    Tile& tile = m.tile;
    const brume::View& view = m.c.view;
    const cv::Matx33f& r = view.worldFromView;
    Lanes z;
    takeTile<1>(m, m.c.depth, z);
    takeTile<4>(m, m.c.input, tile.scene);
    for (int x = 0; x < tileWidth; x++) {
        const float rayX = view.rayX(tile.columnOf(x)), y = view.rayY(tile.rowOf(x));
        const float length = brume::View::rayLength(rayX, y);
        const float scale = 1.0f / length;
        const float a = rayX * scale, b = y * scale, c = -scale;
        tile.dx[x] = r(0, 0) * a + r(0, 1) * b + r(0, 2) * c;
        tile.dy[x] = r(1, 0) * a + r(1, 1) * b + r(1, 2) * c;
        tile.dz[x] = r(2, 0) * a + r(2, 1) * b + r(2, 2) * c;
        tile.far[x] = least(z[x] * length, m.p.max_distance);
    }
}

// 2.1 The inverse of a direction's component; a ray parallel to a pair of walls is between them or not.
BRUME_INLINE float inverseOf(float d) {
    const float safe = std::abs(d) < 1e-20f ? 1e-20f : d;
    return 1.0f / safe;
}

// 2.2 Where the first of a tile's rays, of directions lo to hi along an axis, leaves the part -near to far.
BRUME_INLINE float wayWithin(float lo, float hi, float near, float far) {
    if (!(near >= 0.0f && far >= 0.0f)) return 0;
    const float forth = hi > 0.0f ? far / hi : HUGE_VALF, back = lo < 0.0f ? near / -lo : HUGE_VALF;
    return least(forth, back);
}

// 2. Where each ray is inside each volume, and the part [begin, end] that all of it lies in.
BRUME_VECTORISE inline void clipVolumes(March& m, int steps) {
    Tile& tile = m.tile;
    Lanes end;
    float lo[3] = {1, 1, 1}, hi[3] = {-1, -1, -1};
    const float* directions[3] = {tile.dx, tile.dy, tile.dz};
    for (int axis = 0; axis < 3; axis++)
        for (int x = 0; x < tileWidth; x++) {
            lo[axis] = least(lo[axis], directions[axis][x]);
            hi[axis] = most(hi[axis], directions[axis][x]);
        }
    for (int x = 0; x < tileWidth; x++) tile.begin[x] = 3e38f, end[x] = 0;
    for (int k = 0; k < m.volumeCount; k++) {
        VolumeTile& volume = m.volumes[k];
        const float *v = volume.rows, *low = v, *high = v + 4;
        volume.evenUntil = wayWithin(lo[1], hi[1], HUGE_VALF, v[12]);
        if (volume.hasEdges)
            volume.evenUntil =
                least(volume.evenUntil, least(wayWithin(lo[0], hi[0], v[17] - v[16], v[17] + v[16]),
                                              wayWithin(lo[2], hi[2], v[21] - v[20], v[21] + v[20])));
        float first = 3e38f, last = 0;
        for (int x = 0; x < tileWidth; x++) {
            const float ix = inverseOf(tile.dx[x]), iy = inverseOf(tile.dy[x]), iz = inverseOf(tile.dz[x]);
            const float x0 = low[0] * ix, x1 = high[0] * ix, y0 = low[1] * iy, y1 = high[1] * iy,
                        z0 = low[2] * iz, z1 = high[2] * iz;
            const float enter = most(most(least(x0, x1), least(y0, y1)), most(least(z0, z1), 0.0f));
            const float leave = least(least(most(x0, x1), most(y0, y1)), least(most(z0, z1), tile.far[x]));
            const bool isInside = enter < leave;
            volume.enter[x] = isInside ? enter : 3e38f;
            volume.leave[x] = isInside ? leave : 0.0f;
            tile.begin[x] = least(tile.begin[x], volume.enter[x]);
            end[x] = most(end[x], volume.leave[x]);
        }
        for (int x = 0; x < tileWidth; x++) {
            first = least(first, volume.enter[x]);
            last = most(last, volume.leave[x]);
        }
        volume.first = first;
        volume.last = last;
    }
    const float share = 1.0f / float(steps);
    for (int x = 0; x < tileWidth; x++) tile.stepDepth[x] = 0;  // what no volume is asked for
    tile.beginLast = 0, tile.strideLast = 0;
    for (int x = 0; x < tileWidth; x++) {
        tile.begin[x] = tile.begin[x] < end[x] ? tile.begin[x] : 0.0f;
        tile.stride[x] = (end[x] - tile.begin[x]) * share;
        tile.stride[x] = most(tile.stride[x], 0.0f);
    }
    for (int x = 0; x < tileWidth; x++) {
        tile.beginLast = most(tile.beginLast, tile.begin[x]);
        tile.strideLast = most(tile.strideLast, tile.stride[x]);
    }
}

// 3. How each ray passes each lamp, and the part within its range.
BRUME_VECTORISE inline void passLamps(March& m) {
    Tile& tile = m.tile;
    for (int k = 0; k < m.lampCount; k++) {
        LampTile& lamp = m.lamps[k];
        const float* l = lamp.rows;
        const float range2 = l[3] * l[3];
        for (int x = 0; x < tileWidth; x++) {
            const float along = l[0] * tile.dx[x] + l[1] * tile.dy[x] + l[2] * tile.dz[x];
            const float ax = l[0] - along * tile.dx[x], ay = l[1] - along * tile.dy[x],
                        az = l[2] - along * tile.dz[x];
            const float apart2 = ax * ax + ay * ay + az * az;
            const float half = std::sqrt(most(range2 - apart2, 0.0f));
            lamp.along[x] = along;
            lamp.apart2[x] = apart2;
            lamp.enter[x] = along - half;
            lamp.leave[x] = half > 0.0f ? along + half : -1.0f;
        }
        lamp.firstStep = lamp.lastWhole = 3e38f, lamp.lastStep = lamp.firstWhole = -1;
        for (int x = 0; x < tileWidth; x++) {
            const float share = 1.0f / most(tile.stride[x], 1e-30f);
            const float first = (lamp.enter[x] - tile.begin[x]) * share,
                        last = (lamp.leave[x] - tile.begin[x]) * share;
            lamp.firstWhole = most(lamp.firstWhole, first);
            lamp.lastWhole = least(lamp.lastWhole, last);
            if (!(lamp.leave[x] > tile.begin[x])) continue;
            lamp.firstStep = least(lamp.firstStep, first);
            lamp.lastStep = most(lamp.lastStep, last);
        }
    }
}

// 3.1 Which steps' rays cross the shadow map, by the slab test of clipVolumes: a hundredth of the map wider,
// for rounding, and narrower for the steps that are wholly in it.
constexpr float mapEdge = 0.01f;

BRUME_VECTORISE inline void crossShadowMap(March& m) {
    Tile& tile = m.tile;
    const float* r = m.shadowRows;
    constexpr float outer = 1.0f + 2 * mapEdge, inner = 1.0f - 2 * mapEdge;
    const float u0 = -mapEdge - r[3], v0 = -mapEdge - r[7], d0 = 1.0f + mapEdge - r[11];
    const float u1 = mapEdge - r[3], v1 = mapEdge - r[7], d1 = 1.0f - mapEdge - r[11];
    // nearer than a hundred maps, roundings are far below the hundredth: what is wholly in is looked up
    // unclamped
    constexpr float near = 100, real = 1e18f;
    const bool isNear = std::abs(r[3]) < near && std::abs(r[7]) < near && std::abs(r[11]) < near;
    Lanes first, last, firstWhole, lastWhole;
    BRUME_APART
    for (int x = 0; x < tileWidth; x++) {
        const float u = r[0] * tile.dx[x] + r[1] * tile.dy[x] + r[2] * tile.dz[x];
        const float v = r[4] * tile.dx[x] + r[5] * tile.dy[x] + r[6] * tile.dz[x];
        const float d = r[8] * tile.dx[x] + r[9] * tile.dy[x] + r[10] * tile.dz[x];
        tile.shadowU[x] = u * m.mapWidth;
        tile.shadowV[x] = v * m.mapHeight;
        tile.shadowD[x] = d;
        const float iu = inverseOf(u), iv = inverseOf(v), id = inverseOf(d);
        // what is beyond the map's far end is lit: a ray comes from there, or goes there
        const float enter = most(most(least(u0 * iu, (u0 + outer) * iu), least(v0 * iv, (v0 + outer) * iv)),
                                 id < 0.0f ? d0 * id : -3e38f);
        const float leave = least(least(most(u0 * iu, (u0 + outer) * iu), most(v0 * iv, (v0 + outer) * iv)),
                                  id < 0.0f ? 3e38f : d0 * id);
        const float from = most(most(least(u1 * iu, (u1 + inner) * iu), least(v1 * iv, (v1 + inner) * iv)),
                                id < 0.0f ? d1 * id : -3e38f);
        const float to = least(least(most(u1 * iu, (u1 + inner) * iu), most(v1 * iv, (v1 + inner) * iv)),
                               id < 0.0f ? 3e38f : d1 * id);
        const float share = 1.0f / most(tile.stride[x], 1e-30f);
        const bool isCrossed = enter <= leave;
        first[x] = isCrossed ? (enter - tile.begin[x]) * share : 3e38f;
        last[x] = isCrossed ? (leave - tile.begin[x]) * share : -3e38f;
        const bool isSound = isNear & (std::abs(u) < real) & (std::abs(v) < real) & (std::abs(d) < real);
        firstWhole[x] = isSound ? (from - tile.begin[x]) * share : 3e38f;
        lastWhole[x] = (to - tile.begin[x]) * share;
    }
    tile.firstInMap = tile.lastWhollyIn = 3e38f, tile.lastInMap = tile.firstWhollyIn = -3e38f;
    for (int x = 0; x < tileWidth; x++) {
        tile.firstInMap = least(tile.firstInMap, first[x]);
        tile.lastInMap = most(tile.lastInMap, last[x]);
        tile.firstWhollyIn = most(tile.firstWhollyIn, firstWhole[x]);
        tile.lastWhollyIn = least(tile.lastWhollyIn, lastWhole[x]);
    }
}

// 4. Optical depth at which what is left cannot show: e^-τ·max(C, A) ≤ 1/26356, an eighth of an 8-bit sRGB
// step near black. log2 by the bits, exact at powers of two and at most .0861 too small between, hence the
// addition.
BRUME_INLINE float stoppingDepth(float brightest) {
    int32_t bits;
    std::memcpy(&bits, &brightest, 4);
    const float log2 = float(bits) * 1.1920929e-7f - 126.9139f;
    return most((log2 + 14.68585f) * 0.69314718f, 0.0f);
}

BRUME_VECTORISE inline void startMarch(March& m) {
    Tile& tile = m.tile;
    const float g = std::abs(m.asymmetry), side = m.asymmetry < 0 ? -1.0f : 1.0f;
    const cv::Vec3f s = m.towardsSun * side;
    const float shaded = 1.0f - m.p.shadow_strength;
    for (int x = 0; x < tileWidth; x++) {
        const float versine = brume::versineBetween(tile.dx[x], tile.dy[x], tile.dz[x], s[0], s[1], s[2]);
        const float share = scatteredShare(m.p.phase, g, versine);
        for (int k = 0; k < 3; k++) {
            const float sun = share * m.sunLight[k];
            tile.lit[k][x] = m.ambient[k] + sun;
            tile.dim[k][x] = m.ambient[k] + shaded * sun;
        }
        tile.depth[x] = tile.red[x] = tile.green[x] = tile.blue[x] = 0;
        tile.litWeight[x] = tile.dimWeight[x] = 0;
        tile.through[x] = tile.noise[x] = 1;
        tile.stop[x] = 3e38f;
    }
    for (int k = 0; k < m.lampCount; k++) std::fill_n(m.lamps[k].weight, tileWidth, 0.0f);
    if (m.hasShadow) crossShadowMap(m);
    if (!m.p.early_stop) return;
    Lanes red, green, blue;
    for (int x = 0; x < tileWidth; x++) {
        red[x] = tile.lit[0][x];
        green[x] = tile.lit[1][x];
        blue[x] = tile.lit[2][x];
    }
    const float strongest = scatteredShare(m.p.phase, g, 0.0f);
    for (int k = 0; k < m.lampCount; k++) {
        const LampTile& lamp = m.lamps[k];
        if (lamp.lastStep < 0) continue;
        const float* l = lamp.rows;
        for (int x = 0; x < tileWidth; x++) {
            const float apart = std::sqrt(lamp.apart2[x]);
            const float intensity = l[7] * strongest / (l[8] + l[9] * apart + l[10] * lamp.apart2[x]);
            const float inRange = lamp.leave[x] > 0.0f ? intensity : 0.0f;
            red[x] += inRange * l[4];
            green[x] += inRange * l[5];
            blue[x] += inRange * l[6];
        }
    }
    for (int x = 0; x < tileWidth; x++) {
        const float* color = tile.scene + 4 * x;
        float brightest = most(most(red[x], green[x]), most(blue[x], 1e-30f));
        int32_t bits, candidate;
        std::memcpy(&bits, &brightest, 4);
        for (int k = 0; k < 3; k++) {  // by bits, so that NaN and inf count as large
            std::memcpy(&candidate, color + k, 4);
            bits = std::max(bits, candidate & 0x7fffffff);
        }
        std::memcpy(&brightest, &bits, 4);
        tile.stop[x] = stoppingDepth(brightest);
    }
}

}  // namespace volume_fog
