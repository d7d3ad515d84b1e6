// noise_fog: fog of uneven density (MODELS.md §4; P1 §3.3, P3 §3.2.3, P5).
//
//   out = C·T + A·(1 - T), alpha passes through
//   exponential  T = exp(-density·n̂·x)                          x = max(0, L - start), m along the ray
//   power        1 - T = min(n̂·(x/distance)^exponent, max)      P1 eq 10 (which prints max for its listing's
//   clamp) n̂, the relative density, from the noise n in 0..1: low + (high - low)·n; P5's n·Δy²/2 + .001; 1 ±
//   strength·n; or P3's product of each axis' mean factor. n is the noise at (p - wind·t)/size of the
//   surface, or its mean over the ray A = mix(color, color_high, n) + sun_color·max(0, d·s)^exponent
//
// Limits: L = 0 gives T = 1; sky takes the noise's mean, 1/2, and x = 1e30 m; T = 0 gives A even for C = inf.
// Beyond 4096 cells a surface takes the mean too: no pixel resolves it, and fp32 would lose its place.
#include "common/fog.hpp"
#include "effect/plugin.hpp"
#include "noise_fog/derived.hpp"
#include "noise_fog/params.hpp"
#include "noise_fog/plan.hpp"
#include "noise_fog/reference.hpp"
#include "noise_fog/tile.hpp"

namespace brume::noise_fog {
namespace {

BRUME_VECTORISE void rows(const NoiseFog& p, const CpuContext& c, cv::Range range) {
    const Constants k = constantsOf(p, c);
    Tile t;
    forEachSpan(c, range, [&](const FogSpan& s) BRUME_INLINED {
        s.fetch(0);
        raysTile(c.view, s.depth, s.first, s.y, s.count, t);
        s.fetch(1);
        fogTile(p, k, s.depth, s.count, t);
        s.fetch(2);
        if (k.varyingAirlight)
            storeTile<true>(t, true, p.color, s);
        else
            storeTile<false>(t, true, p.color, s);
    });
}

}  // namespace

auto effect() {
    using Row = EffectOf<NoiseFog>::RowBinder<Point>;
    return EffectOf<NoiseFog>()
        .bind("color", &NoiseFog::color)
        .bind("color_high", &NoiseFog::colorHigh)
        .bind("model", &NoiseFog::model)
        .bind("where", &NoiseFog::where)
        .bind("mode", &NoiseFog::mode)
        .bind("low", &NoiseFog::low)
        .bind("high", &NoiseFog::high)
        .bind("strength", &NoiseFog::strength)
        .bind("start", &NoiseFog::start)
        .bind("density", &NoiseFog::density)
        .bind("power_distance", &NoiseFog::powerDistance)
        .bind("power_exponent", &NoiseFog::powerExponent)
        .bind("max_opacity", &NoiseFog::maxOpacity)
        .bind("noise", &NoiseFog::noise)
        .bind("size", &NoiseFog::size)
        .bind("octaves", &NoiseFog::octaves)
        .bind("wind", &NoiseFog::wind)
        .bind("seed", &NoiseFog::seed)
        .bind("tile", &NoiseFog::tile)
        .bind("extent", &NoiseFog::extent)
        .bind("method", &NoiseFog::method)
        .bind("resolution", &NoiseFog::resolution)
        .bind("smoothing", &NoiseFog::smoothing)
        .bind("steps", &NoiseFog::steps)
        .bind("range", &NoiseFog::range)
        .bind("x_profile", &NoiseFog::xProfile)
        .bind("x_density", &NoiseFog::xDensity)
        .bind("x_origin", &NoiseFog::xOrigin)
        .bind("x_falloff", &NoiseFog::xFalloff)
        .bind("y_profile", &NoiseFog::yProfile)
        .bind("y_density", &NoiseFog::yDensity)
        .bind("y_origin", &NoiseFog::yOrigin)
        .bind("y_falloff", &NoiseFog::yFalloff)
        .bind("z_profile", &NoiseFog::zProfile)
        .bind("z_density", &NoiseFog::zDensity)
        .bind("z_origin", &NoiseFog::zOrigin)
        .bind("z_falloff", &NoiseFog::zFalloff)
        .list<Point>("points", &NoiseFog::points,
                     [](Row& b) {
                         b.bind("axis", &Point::axis)
                             .bind("position", &Point::position)
                             .bind("density", &Point::density);
                     })
        .bind("sun_direction", &NoiseFog::sunDirection)
        .bind("sun_color", &NoiseFog::sunColor)
        .bind("sun_exponent", &NoiseFog::sunExponent)
        .bind("sun_offset", &NoiseFog::sunOffset)
        .derive("noise_cell", noiseCell)
        .derive("noise_fraction", noiseFraction)
        .derive("inverse_size", inverseSize)
        .derive("inverse_distance", inverseDistance)
        .derive("to_sun", toSun)
        .derive("baked_edge", bakedEdge)
        .derive("baked", bakedNoise)
        .derive("axis_log", axisLog)
        .derive("axis_points", axisPoints)
        .derive("axis_begin", axisBegin)
        .rows(rows)
        .referenceImage(reference)
        .plan(plan);
}

}  // namespace brume::noise_fog

BRUME_PLUGIN(brume::noise_fog::effect())
