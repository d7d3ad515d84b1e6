// The C++ half of volume_fog: parameters, constants, the CPU march. See volume_fog.fs for what it computes.
#include "volume_fog/volume_fog.hpp"

#include <memory>

#include "effect/plugin.hpp"
#include "volume_fog/derive.hpp"
#include "volume_fog/methods.hpp"
#include "volume_fog/plan.hpp"
#include "volume_fog/reference.hpp"

namespace volume_fog {
namespace {

using namespace brume;

// 11. Composite; where nothing of the scene is left, not even infinity shows.
BRUME_VECTORISE void storeTile(March& m) {
    Tile& tile = m.tile;
    const bool isP2 = m.p.method == P2;
    Lanes transmittance;
    for (int x = 0; x < tileWidth; x++) {
        const float left = extinctionOf(tile.depth[x]).transmittance;
        transmittance[x] = isP2 ? 1.0f - tile.depth[x] : left;
    }
    const cv::Vec3f albedo = commonAlbedo(m);
    const float* input = m.c.input.ptr<float>(tile.row) + 4 * tile.column;
    float* output = const_cast<float*>(m.c.output.ptr<float>(tile.row)) + 4 * tile.column;
    const int count = std::min(tileWidth, m.c.view.width - tile.column);
    for (int x = 0; x < count; x++) {
        const float t = transmittance[x];
        const float share = isP2 ? tile.depth[x] : 1.0f;
        const float color[3] = {tile.red[x], tile.green[x], tile.blue[x]};
        for (int k = 0; k < 3; k++) {
            const float scene = t > 0.0f ? input[4 * x + k] * t : 0.0f;
            output[4 * x + k] = scene + color[k] * albedo[k] * share;
        }
        output[4 * x + 3] = input[4 * x + 3];
    }
    if (m.c.transmittance.empty()) return;
    float* running = const_cast<float*>(m.c.transmittance.ptr<float>(tile.row)) + 4 * tile.column;
    for (int x = 0; x < count; x++)
        for (int k = 0; k < 3; k++) running[4 * x + k] *= transmittance[x];
}

// Columns of tiles one after the other: neighbours in a column look up the same part of the shadow map.
void rows(const Params& p, const CpuContext& c, cv::Range range) {
    const auto march = std::make_unique<March>(p, c);
    March& m = *march;
    const int strides = stridesOf(p);
    for (int column = 0; column < c.view.width; column += tileWidth) {
        for (int row = range.start; row < range.end; row++) {
            m.tile.column = column;
            m.tile.row = row;
            castRays(m);
            clipVolumes(m, strides);
            passLamps(m);
            startMarch(m);
            marchTile(m, strides);
            storeTile(m);
        }
    }
}

void bindBox(EffectOf<Params>::RowBinder<Box>& row) {
    row.bind("center", &Box::center)
        .bind("size", &Box::size)
        .bind("density", &Box::density)
        .bind("albedo", &Box::albedo)
        .bind("height_falloff", &Box::height_falloff)
        .bind("height_start", &Box::height_start)
        .bind("height_distance", &Box::height_distance)
        .bind("edge_falloff", &Box::edge_falloff)
        .bind("edge_start_x", &Box::edge_start_x)
        .bind("edge_start_z", &Box::edge_start_z);
}

void bindLight(EffectOf<Params>::RowBinder<PointLight>& row) {
    row.bind("position", &PointLight::position)
        .bind("color", &PointLight::color)
        .bind("intensity", &PointLight::intensity)
        .bind("range", &PointLight::range)
        .bind("attenuation", &PointLight::attenuation);
}

EffectOf<Params> effect() {
    return EffectOf<Params>()
        .bind("method", &Params::method)
        .bind("steps", &Params::steps)
        .bind("early_stop", &Params::early_stop)
        .bind("max_distance", &Params::max_distance)
        .bind("density", &Params::density)
        .bind("albedo", &Params::albedo)
        .bind("height_falloff", &Params::height_falloff)
        .bind("height_start", &Params::height_start)
        .bind("height_distance", &Params::height_distance)
        .list<Box>("boxes", &Params::boxes, bindBox)
        .bind("noise", &Params::noise)
        .bind("noise_strength", &Params::noise_strength)
        .bind("noise_size", &Params::noise_size)
        .bind("wind", &Params::wind)
        .bind("noise_seed", &Params::noise_seed)
        .bind("noise_every", &Params::noise_every)
        .bind("sun_direction", &Params::sun_direction)
        .bind("sun_color", &Params::sun_color)
        .bind("sun_intensity", &Params::sun_intensity)
        .bind("shadow_strength", &Params::shadow_strength)
        .bind("shadow_bias", &Params::shadow_bias)
        .bind("ambient", &Params::ambient)
        .bind("ambient_intensity", &Params::ambient_intensity)
        .list<PointLight>("point_lights", &Params::point_lights, bindLight)
        .bind("phase", &Params::phase)
        .bind("anisotropy", &Params::anisotropy)
        .derive("volume_count", deriveVolumeCount)
        .derive("volumes", deriveVolumes)
        .derive("lamps", deriveLamps)
        .derive("towards_sun", deriveTowardsSun)
        .derive("shadow", deriveShadow)
        .derive("noise_cell", deriveNoiseCell)
        .derive("noise_fraction", deriveNoiseFraction)
        .rows(rows)
        .referenceImage(reference)
        .plan(plan);
}

}  // namespace
}  // namespace volume_fog

BRUME_PLUGIN(volume_fog::effect())
