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
    float* scene = tile.scene;
    for (int x = 0; x < tileWidth; x++) {
        const float t = transmittance[x];
        const float share = isP2 ? tile.depth[x] : 1.0f;
        const float color[3] = {tile.red[x], tile.green[x], tile.blue[x]};
        for (int k = 0; k < 3; k++) {
            const float behind = t > 0.0f ? scene[4 * x + k] * t : 0.0f;
            scene[4 * x + k] = behind + color[k] * albedo[k] * share;
        }
    }
    const int width = 1 << tile.rowBits, count = std::min(width, m.c.view.width - tile.column);
    auto at = [&](const cv::Mat& image, int x) {
        return const_cast<float*>(image.ptr<float>(tile.rowOf(x))) + 4 * tile.column;
    };
    for (int from = 0; from < tileWidth; from += width)
        copyPixels<4>(at(m.c.output, from), scene + 4 * from, count);
    if (m.c.transmittance.empty()) return;
    for (int from = 0; from < tileWidth; from += width) {
        float* running = at(m.c.transmittance, from);
        for (int x = 0; x < count; x++)
            for (int k = 0; k < 3; k++) running[4 * x + k] *= transmittance[from + x];
    }
}

// Columns of tiles one after the other: neighbours in a column look up the same part of the map.
void marchRows(March& m, int strides, cv::Range range, int rowBits) {
    m.tile.rowBits = rowBits;
    for (m.tile.column = 0; m.tile.column < m.c.view.width; m.tile.column += 1 << rowBits) {
        for (m.tile.row = range.start; m.tile.row < range.end; m.tile.row += tileWidth >> rowBits) {
            castRays(m);
            clipVolumes(m, strides);
            passLamps(m);
            startMarch(m);
            marchTile(m, strides);
            storeTile(m);
        }
    }
}

// Tiles as wide as high: their rays have most in common, cells of the noise and texels of the shadow map.
// Rows that are left below the last of them are in wider ones.
void rows(const Params& p, const CpuContext& c, cv::Range range) {
    const auto march = std::make_unique<March>(p, c);
    const int strides = stridesOf(p);
    for (int rowBits = squareBits; range.start < range.end; rowBits++) {
        const int high = tileWidth >> rowBits, end = range.end - range.size() % high;
        marchRows(*march, strides, {range.start, end}, rowBits);
        range.start = end;
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
        .rows(rows, tileWidth >> squareBits)
        .referenceImage(reference)
        .plan(plan);
}

}  // namespace
}  // namespace volume_fog

BRUME_PLUGIN(volume_fog::effect())
