// The methods of the CPU half: what each does with the steps of march.hpp.
#pragma once

#include "volume_fog/march.hpp"

namespace volume_fog {

// One sample a step: left, midpoint, jittered, equiangular, shared noise.
inline void marchSteps(March& m) {
    const float u = m.p.method == Left ? 0.0f : 0.5f;
    const bool areThin = areStepsThin(m);
    for (int i = 0; i < m.p.steps; i++) {
        placeStep(m, i, u);
        const bool isInMap = shadeStep(m, i);
        if (m.p.noise != NoNoise) placeNoise(m, i);
        addVolumes(m, i);
        addStep(m.tile, areThin, isInMap);
        if (m.severalAlbedos) {
            lightStep(m.tile, isInMap);
            addLamps(m, i);
            tintStep(m.tile);
            addStepLight(m.tile);
        } else {
            weighLamps(m, i);
        }
        if (i % 8 == 7 && isSaturated(m.tile)) break;
    }
    if (!m.severalAlbedos) addWeighedLight(m);
}

// Gauss-Legendre, four nodes a panel: nodes, weights, and the integrals from 0 to node i of the cubic that is
// 1 at node j and 0 at the others.
constexpr int nodes = 4;
constexpr float nodeAt[nodes] = {0.069431844f, 0.330009478f, 0.669990522f, 0.930568156f};
constexpr float nodeWeight[nodes] = {0.173927423f, 0.326072577f, 0.326072577f, 0.173927423f};
constexpr float nodeIntegral[nodes][nodes] = {{0.086963711f, -0.026604180f, 0.012627463f, -0.003555150f},
                                              {0.188118117f, 0.163036289f, -0.027880429f, 0.006735501f},
                                              {0.167191922f, 0.353953006f, 0.163036289f, -0.014190695f},
                                              {0.177482572f, 0.313445115f, 0.352676758f, 0.086963711f}};

struct Panel {
    alignas(64) Lanes depth[nodes], red[nodes], green[nodes], blue[nodes];
};

// A plain loop a stage: with the nodes inside one loop over pixels nothing vectorises.
BRUME_VECTORISE inline void addPanel(Tile& tile, const Panel& panel) {
    alignas(64) Lanes weight[nodes], before[nodes], depth, total, nearest, scale;
    for (int x = 0; x < tileWidth; x++) {
        depth[x] = total[x] = 0;
        nearest[x] = 3e38f;
    }
    for (int i = 0; i < nodes; i++) {
        const float a = nodeIntegral[i][0], b = nodeIntegral[i][1], c = nodeIntegral[i][2],
                    d = nodeIntegral[i][3];
        for (int x = 0; x < tileWidth; x++) {
            depth[x] += nodeWeight[i] * panel.depth[i][x];
            const float sum = ((a * panel.depth[0][x] + b * panel.depth[1][x]) + c * panel.depth[2][x]) +
                              d * panel.depth[3][x];
            before[i][x] = most(sum, 0.0f);
            nearest[x] = least(nearest[x], before[i][x]);
        }
    }
    // Only ratios of the weights count: from the nearest node on, they cannot all vanish in dense fog.
    for (int i = 0; i < nodes; i++)
        for (int x = 0; x < tileWidth; x++) {
            weight[i][x] = nodeWeight[i] * panel.depth[i][x] * brume::expFast(nearest[x] - before[i][x]);
            total[x] += weight[i][x];
        }
    // Scaled so that a constant S gives S·(1 - e^-Δτ) exactly.
    for (int x = 0; x < tileWidth; x++) {
        const float own = least(depth[x], tile.stop[x] - tile.depth[x]);
        const float scattered = tile.through[x] * brume::extinctionOf(own).opacity;
        scale[x] = scattered / most(total[x], 1e-30f);
        tile.through[x] -= scattered;
        tile.depth[x] += own;
    }
    auto addLight = [&](const Lanes* light, float* sum) {
        for (int x = 0; x < tileWidth; x++)
            sum[x] +=
                scale[x] *
                (((weight[0][x] * light[0][x] + weight[1][x] * light[1][x]) + weight[2][x] * light[2][x]) +
                 weight[3][x] * light[3][x]);
    };
    addLight(panel.red, tile.red);
    addLight(panel.green, tile.green);
    addLight(panel.blue, tile.blue);
}

inline void marchPanels(March& m, int panels) {
    Panel panel;
    for (int i = 0; i < panels; i++) {
        for (int j = 0; j < nodes; j++) {
            placeStep(m, i, nodeAt[j]);
            if (m.p.noise != NoNoise) placeNoise(m, i);
            addVolumes(m, i);
            lightStep(m.tile, shadeStep(m, i));
            addLamps(m, i);
            if (m.severalAlbedos) tintStep(m.tile);
            std::memcpy(panel.depth[j], m.tile.stepDepth, sizeof(Lanes));
            std::memcpy(panel.red[j], m.tile.source[0], sizeof(Lanes));
            std::memcpy(panel.green[j], m.tile.source[1], sizeof(Lanes));
            std::memcpy(panel.blue[j], m.tile.source[2], sizeof(Lanes));
        }
        addPanel(m.tile, panel);
        if (isSaturated(m.tile)) break;
    }
}

// The report's own march (P2 §4): steps from the eye to the surface, wherever the fog is; densities and
// colours summed without transmittance, lights mixed in turn. Its sum passes 1 behind the saturation
// distance; here it ends at 1. The tile's depth is its opacity, summed from 0: taken from 1, thin steps would
// lose their last bits.
constexpr float saturation = 2.99573227f;  // -ln .05: P2's distance to saturation is this over the extinction

BRUME_VECTORISE inline void addVolumeP2(Tile& tile, const VolumeTile& volume) {
    const float* v = volume.rows;
    const float perMetre = v[3] * (1.0f / saturation);
    for (int x = 0; x < tileWidth; x++) {
        const float at = tile.at[x];
        const float uy = most(tile.dy[x] * at - v[12], 0.0f);
        const float ux = most(std::abs(tile.dx[x] * at - v[16]) - v[17], 0.0f);
        const float uz = most(std::abs(tile.dz[x] * at - v[20]) - v[21], 0.0f);
        const float linear =
            most(1.0f - uy * v[13], 0.0f) * most(1.0f - ux * v[18], 0.0f) * most(1.0f - uz * v[22], 0.0f);
        const float falloff = linear * brume::expFast(-(uy * v[14] + ux * v[19] + uz * v[23]));
        const bool isInside = (at >= volume.enter[x]) & (at < volume.leave[x]);
        const float density = isInside ? perMetre * (tile.stride[x] * falloff * tile.noise[x]) : 0.0f;
        tile.stepDepth[x] += density;
    }
}

BRUME_VECTORISE inline void mixLampP2(Tile& tile, const LampTile& lamp) {
    const float* l = lamp.rows;
    for (int x = 0; x < tileWidth; x++) {
        const float beyond = tile.at[x] - lamp.along[x];
        const float distance2 = lamp.apart2[x] + beyond * beyond;
        const float share = clampUnit(l[7] / (l[8] + l[9] * std::sqrt(distance2) + l[10] * distance2));
        const float mixed = distance2 < l[3] * l[3] ? share : 0.0f;
        for (int k = 0; k < 3; k++) tile.light[k][x] += mixed * (l[4 + k] - tile.light[k][x]);
    }
}

BRUME_VECTORISE inline void addStepP2(Tile& tile) {
    for (int x = 0; x < tileWidth; x++) {
        const float density = least(tile.stepDepth[x], 1.0f - tile.depth[x]);
        tile.red[x] += density * tile.light[0][x];
        tile.green[x] += density * tile.light[1][x];
        tile.blue[x] += density * tile.light[2][x];
        tile.depth[x] += density;
    }
}

inline void marchP2(March& m) {
    Tile& tile = m.tile;
    const float share = 1.0f / float(m.p.steps);
    const float mixed = clampUnit(m.p.ambient_intensity);
    for (int x = 0; x < tileWidth; x++) {
        tile.begin[x] = 0;
        tile.stride[x] = tile.far[x] * share;
    }
    if (m.hasShadow) crossShadowMap(m);
    for (int i = 0; i < m.p.steps; i++) {
        placeStep(m, i, 0.0f);
        if (m.p.noise != NoNoise) placeNoise(m, i);
        for (int k = 0; k < m.volumeCount; k++) addVolumeP2(tile, m.volumes[k]);
        const bool isInMap = shadeStep(m, i);
        for (int x = 0; x < tileWidth; x++) {
            const float sun = isInMap ? sunShare(tile, x, 1.0f - m.p.shadow_strength) : 1.0f;
            for (int k = 0; k < 3; k++) {
                const float direct = m.sunLight[k] * sun;
                tile.light[k][x] = direct + mixed * (m.p.ambient[k] - direct);
            }
        }
        for (int k = 0; k < m.lampCount; k++) mixLampP2(tile, m.lamps[k]);
        addStepP2(tile);
    }
}

/// Into how many pieces the fogged part of a ray is cut.
inline int stridesOf(const Params& p) {
    return p.method == GaussLegendre ? (p.steps + nodes - 1) / nodes : p.steps;
}

/// The tile's optical depths and in-scattered light, by the method asked for.
inline void marchTile(March& m, int strides) {
    if (m.p.method == GaussLegendre)
        marchPanels(m, strides);
    else if (m.p.method == P2)
        marchP2(m);
    else
        marchSteps(m);
}

/// What in-scattered light is still to be multiplied by: an albedo that all volumes share.
inline cv::Vec3f commonAlbedo(const March& m) {
    cv::Vec3f albedo(1, 1, 1);
    if (m.volumeCount && !m.severalAlbedos && m.p.method != P2)
        for (int k = 0; k < 3; k++) albedo[k] = m.volumes[0].rows[8 + k];
    return albedo;
}

}  // namespace volume_fog
