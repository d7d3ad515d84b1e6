// depth_fog: homogeneous fog (MODELS.md §1).
//
//   out = C·T + A·(1 - T) per channel; T = exp(-τ), alpha passes through
//   exponential          τ = β·x           x = max(0, min(L, cutoff) - start), L the distance along the ray,
//   m exponential squared  τ = (β·x)²        β = -ln(.05)/V or 3.912/V or given, times the tint, 1/m linear
//   (P4)          1 - T = clamp(sat(l - start)·curve, 0, max), l = sat((Z - near)/(far - near)) power (P1 eqs
//   2, 3)  1 - T = min((x/distance)^exponent, max); P1 prints max where its listing clamps sun (P1 eqs 5-8)
//   A += A_sun·max(0, d·s)^exponent, or A_sun·HG(d·s)
//
// Limits: β = 0 gives T = 1 even at sky; T = 0 gives A even for C = inf; sky is τ = ∞ unless cut off.
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/fog.hpp"
#include "common/sun_offset.hpp"
#include "depth_fog/reference.hpp"
#include "effect/plugin.hpp"

namespace {

using namespace brume;
using namespace depthFog;

// --- derived constants, fp64 ---------------------------------------------------------------------

std::vector<double> beta(const DepthFog& p, const DeriveContext&) {
    const double contrast[] = {-std::log(.05), -std::log(.02)};
    double extinction = p.measure == 2 ? double(p.extinction) : contrast[p.measure] / p.visibility;
    std::vector<double> beta;
    for (int n = 0; n < 3; n++) {
        beta.push_back(extinction * p.tint[n]);
        // GPUs take numbers below this for 0, which would be no fog even before the sky
        if (beta[n] > 0) beta[n] = std::max(beta[n], double(std::numeric_limits<float>::min()));
    }
    return beta;
}

std::vector<double> depthScale(const DepthFog& p, const DeriveContext&) {
    double range = double(p.far) - p.near;
    return {range > 0 ? std::min(1 / range, 1e30) : 1e30};  // no range: a step at near
}

std::vector<double> inverseDistance(const DepthFog& p, const DeriveContext&) {
    return {1. / p.powerDistance};
}

std::vector<double> toSun(const DepthFog& p, const DeriveContext&) {
    cv::Vec3d s(p.sunDirection);
    double length = cv::norm(s);
    if (length == 0) return {0, 0, 0};
    return {s[0] / length, s[1] / length, s[2] / length};
}

std::vector<double> sunLight(const DepthFog& p, const DeriveContext&) {
    double g = p.sunAnisotropy;
    double factor = p.sun == henyeyGreenstein ? (1 - g * g) / (4 * CV_PI) : 1;
    if (cv::norm(p.sunDirection) == 0) factor = 0;
    return {factor * p.sunColor[0], factor * p.sunColor[1], factor * p.sunColor[2]};
}

// --- CPU -----------------------------------------------------------------------------------------

// fp32 constants of one call.
struct Constants {
    float beta[3];
    float toSun[3], sunLight[3];
    float depthScale, inverseDistance, cutoff;
    bool oneBeta;
};

Constants constantsOf(const DepthFog& p, const CpuContext& c) {
    Constants k{};
    for (int n = 0; n < 3; n++) {
        k.beta[n] = c.derived("beta")[n];
        k.toSun[n] = c.derived("toSun")[n];
        k.sunLight[n] = c.derived("sunLight")[n];
    }
    k.depthScale = c.derived("depthScale")[0];
    k.inverseDistance = c.derived("inverseDistance")[0];
    k.cutoff = p.cutoff > 0 ? p.cutoff : HUGE_VALF;
    k.oneBeta = k.beta[0] == k.beta[1] && k.beta[1] == k.beta[2];
    return k;
}

// 1. Distance travelled in fog; finite even for sky, so that no product meets 0·inf.
BRUME_INLINE float fogDistance(float distance, float start, float cutoff) {
    float x = std::min(distance, cutoff) - start;
    x = x > 0.0f ? x : 0.0f;
    return x < 3.0e38f ? x : 3.0e38f;
}

BRUME_INLINE Extinction limited(Extinction e, float maxOpacity) {
    bool over = e.opacity > maxOpacity;
    return {over ? 1.0f - maxOpacity : e.transmittance, over ? maxOpacity : e.opacity};
}

struct Tile : FogTile {
    float distance[fogTileSize];  // L, m
};

// 3. Transmittance and opacity of one channel.
template <int model>
BRUME_INLINE void fogChannel(const DepthFog& p, const Constants& k, float beta, const float* depth,
                             const float* along, int count, float* transmittance, float* opacity) {
    const float near = p.near, linearStart = p.linearStart, curve = p.curve, maxOpacity = p.maxOpacity;
    const float start = p.start, exponent = p.powerExponent;
    const float depthScale = k.depthScale, inverseDistance = k.inverseDistance, cutoff = k.cutoff;
    const float endless = beta > 0 ? 1e18f : 0;  // optical depth of an endless way; its square is finite, too
    for (int i = 0; i < count; i++) {
        Extinction e;
        if constexpr (model == linear) {
            float l = std::min(std::max((depth[i] - near) * depthScale, 0.0f), 1.0f);
            float s = std::max(l - linearStart, 0.0f) * curve;
            e.opacity = std::min(s, maxOpacity);
            e.transmittance = 1.0f - e.opacity;
        } else if constexpr (model == power) {
            float u = fogDistance(along[i], start, cutoff) * inverseDistance;
            e.opacity = std::min(powFast(u, exponent), maxOpacity);
            e.transmittance = 1.0f - e.opacity;
        } else {
            const float x = fogDistance(along[i], start, cutoff);
            float opticalDepth = x < 3.0e38f ? beta * x : endless;
            if constexpr (model == exponentialSquared) opticalDepth = opticalDepth * opticalDepth;
            e = limited(extinctionOf(opticalDepth), maxOpacity);
        }
        transmittance[i] = e.transmittance;
        opacity[i] = e.opacity;
    }
}

// 2. Distance of the pixels of one tile.
BRUME_INLINE void distanceTile(const DepthFog& p, const View& v, const FogSpan& s, Tile& t) {
    const float originX = v.originX, inverseFx = v.inverseFx;
    const int first = s.first, count = s.count;
    const float y = s.y;
    if (p.distanceAlong == 0) {
        for (int i = 0; i < count; i++) {
            float x = (float(first + i) + originX) * inverseFx;
            t.distance[i] = s.depth[i] * View::rayLength(x, y);
        }
    } else {
        for (int i = 0; i < count; i++) t.distance[i] = s.depth[i];
    }
}

// 4. Airlight with the sun's lobe. Everything read in a loop is a local copy: a store to the tile might
// otherwise change it, for all the compiler knows.
BRUME_INLINE void airlightTile(const DepthFog& p, const Constants& k, const View& v, const float* depth,
                               int i0, float y, int count, Tile& t) {
    const cv::Matx33f r = v.worldFromView;
    const float exponent = p.sunExponent, g = p.sunAnisotropy;
    const float sx = k.toSun[0], sy = k.toSun[1], sz = k.toSun[2];
    const float originX = v.originX, inverseFx = v.inverseFx;
    float dx[fogTileSize], dy[fogTileSize], dz[fogTileSize], lobe[fogTileSize];
    for (int i = 0; i < count; i++) {
        float x = (float(i0 + i) + originX) * inverseFx;
        float unit = 1.0f / View::rayLength(x, y);
        dx[i] = (r(0, 0) * x + r(0, 1) * y - r(0, 2)) * unit;
        dy[i] = (r(1, 0) * x + r(1, 1) * y - r(1, 2)) * unit;
        dz[i] = (r(2, 0) * x + r(2, 1) * y - r(2, 2)) * unit;
    }
    for (int i = 0; i < count; i++)
        lobe[i] = depth[i] * View::rayLength((float(i0 + i) + originX) * inverseFx, y);
    offsetDirections(dx, dy, dz, lobe, p.sunOffset, count);
    if (p.sun == powerSun) {
        for (int i = 0; i < count; i++) {
            float cosine = dx[i] * sx + dy[i] * sy + dz[i] * sz;
            lobe[i] = powFast(cosine > 0.0f ? cosine : 0.0f, exponent);
        }
    } else {
        // Henyey-Greenstein by the distance of two unit vectors, which does not cancel in the forward peak.
        // A negative g peaks away from the sun: the same lobe about the opposite direction.
        const float side = g < 0.0f ? -1.0f : 1.0f, peak = std::fabs(g);
        for (int i = 0; i < count; i++) {
            float ax = dx[i] - side * sx, ay = dy[i] - side * sy, az = dz[i] - side * sz;
            float denominator = (1 - peak) * (1 - peak) + peak * (ax * ax + ay * ay + az * az);
            lobe[i] = 1.0f / (denominator * std::sqrt(denominator));
        }
    }
    for (int n = 0; n < 3; n++) {
        const float fog = p.color[n], light = k.sunLight[n];
        float* airlight = t.airlight[n];
        for (int i = 0; i < count; i++) airlight[i] = fog + light * lobe[i];
    }
}

// 5. Composite in sRGB-encoded values.
BRUME_INLINE void encodedTile(const DepthFog& p, const Tile& t, bool oneChannel, const FogSpan& s) {
    float plane[4][fogTileSize];
    for (int i = 0; i < s.count; i++)
        for (int n = 0; n < 4; n++) plane[n][i] = s.in[4 * i + n];
    for (int n = 0; n < 3; n++) {
        const float* transmittance = t.transmittance[oneChannel ? 0 : n];
        const float* opacity = t.opacity[oneChannel ? 0 : n];
        float airlight[fogTileSize];
        for (int i = 0; i < s.count; i++) airlight[i] = p.sun == noSun ? p.color[n] : t.airlight[n][i];
        for (int i = 0; i < s.count; i++)
            plane[n][i] =
                attenuated(encodeSrgb(plane[n][i]), transmittance[i]) + encodeSrgb(airlight[i]) * opacity[i];
        for (int i = 0; i < s.count; i++) plane[n][i] = decodeSrgb(plane[n][i]);
    }
    storePlanes(plane, s.out, s.count, s.streams);
    if (s.transmittance) transmittanceTile(t, oneChannel, s.transmittance, s.count);
}

// Of an even fog, a few pixels at a time: they are on their way to memory while the next are computed, which
// is as long as what is written past the caches takes.
template <int model, bool streams>
BRUME_INLINE void evenTile(const DepthFog& p, const Constants& k, const FogSpan& s, Tile& t) {
    constexpr int few = 32;
    const cv::Vec3f airlight = p.color;
    auto some = [&](int i, auto count) BRUME_INLINED {
        float *T = t.transmittance[0] + i, *opacity = t.opacity[0] + i;
        fogChannel<model>(p, k, k.beta[0], s.depth + i, t.distance + i, count, T, opacity);
        compositeEven<streams>(T, opacity, airlight, s.in + 4 * i, s.out + 4 * i, count);
    };
    int i = 0;
    for (; i + few <= s.count; i += few) some(i, std::integral_constant<int, few>());
    if (i < s.count) some(i, s.count - i);
}

template <int model>
BRUME_INLINE void fogRows(const DepthFog& p, const Constants& k, const CpuContext& c, cv::Range range) {
    const bool one = model == linear || model == power || k.oneBeta;
    Tile t;
    forEachSpan(c, range, [&](const FogSpan& s) BRUME_INLINED {
        s.fetch(0);
        distanceTile(p, c.view, s, t);
        s.fetch(1);
        if (one && p.sun == noSun && p.mixing == 0) {
            s.fetch(2);
            s.fetch(3);
            if (s.streams)
                evenTile<model, true>(p, k, s, t);
            else
                evenTile<model, false>(p, k, s, t);
            if (s.transmittance) transmittanceTile(t, true, s.transmittance, s.count);
            return;
        }
        for (int n = 0; n < (one ? 1 : 3); n++)
            fogChannel<model>(p, k, k.beta[n], s.depth, t.distance, s.count, t.transmittance[n],
                              t.opacity[n]);
        s.fetch(2);
        if (p.sun != noSun) airlightTile(p, k, c.view, s.depth, s.first, s.y, s.count, t);
        if (p.mixing == 1)
            encodedTile(p, t, one, s);
        else if (p.sun != noSun)
            storeTile<true>(t, one, p.color, s);
        else
            storeTile<false>(t, one, p.color, s);
    });
}

BRUME_VECTORISE void rows(const DepthFog& p, const CpuContext& c, cv::Range range) {
    const Constants k = constantsOf(p, c);
    if (p.model == exponential)
        fogRows<exponential>(p, k, c, range);
    else if (p.model == exponentialSquared)
        fogRows<exponentialSquared>(p, k, c, range);
    else if (p.model == linear)
        fogRows<linear>(p, k, c, range);
    else
        fogRows<power>(p, k, c, range);
}

// --- plan ----------------------------------------------------------------------------------------

Plan plan(const DepthFog& p, const PlanInput& in) {
    double darkest = HUGE_VAL, airlight = 0;
    for (int n = 0; n < 3; n++) {
        darkest = std::min(darkest, double(p.color[n]));
        airlight = std::max(airlight, double(p.color[n]));
    }
    if (p.sun == powerSun) airlight += std::max({p.sunColor[0], p.sunColor[1], p.sunColor[2]});
    if (p.sun == henyeyGreenstein) {
        double g = std::abs(p.sunAnisotropy);
        airlight += (1 + g) / ((1 - g) * (1 - g)) / (4 * CV_PI) *
                    std::max({p.sunColor[0], p.sunColor[1], p.sunColor[2]});
    }
    double farthest = in.frame.skyShare > 0 ? HUGE_VAL : in.frame.maxDistance;
    Truth truth = fogTruth(p, {}, farthest, farthest, 0);
    double opacity = 0;
    for (int n = 0; n < 3; n++) opacity = std::max(opacity, 1 - truth.transmittance[n]);

    Plan plan;
    plan.output = in.input.mixedWith(darkest, airlight);
    plan.predictedCost = 1.3;
    // Encoded values mix to what is that much nearer in steps, clipped or not.
    double change =
        p.mixing == 1 ? opacity * in.gain *
                            (srgb(std::max(in.input.high, airlight)) - srgb(std::min(in.input.low, darkest)))
                      : in.mixingShows(opacity, darkest, airlight);
    if (!in.transmittanceIsRead && change <= in.tolerance) {
        plan.skip = true;
        plan.predictedError = change;
        plan.predictedCost = 0;
        plan.why = "even the farthest surface changes by less than the tolerance";
    } else {
        plan.why = "one closed form, nothing cheaper";
    }
    return plan;
}

auto effect() {
    return EffectOf<DepthFog>()
        .bind("model", &DepthFog::model)
        .bind("measure", &DepthFog::measure)
        .bind("visibility", &DepthFog::visibility)
        .bind("extinction", &DepthFog::extinction)
        .bind("tint", &DepthFog::tint)
        .bind("color", &DepthFog::color)
        .bind("max_opacity", &DepthFog::maxOpacity)
        .bind("distance_along", &DepthFog::distanceAlong)
        .bind("start", &DepthFog::start)
        .bind("cutoff", &DepthFog::cutoff)
        .bind("near", &DepthFog::near)
        .bind("far", &DepthFog::far)
        .bind("linear_start", &DepthFog::linearStart)
        .bind("curve", &DepthFog::curve)
        .bind("power_distance", &DepthFog::powerDistance)
        .bind("power_exponent", &DepthFog::powerExponent)
        .bind("sun", &DepthFog::sun)
        .bind("sun_direction", &DepthFog::sunDirection)
        .bind("sun_color", &DepthFog::sunColor)
        .bind("sun_exponent", &DepthFog::sunExponent)
        .bind("sun_anisotropy", &DepthFog::sunAnisotropy)
        .bind("sun_offset", &DepthFog::sunOffset)
        .bind("mixing", &DepthFog::mixing)
        .derive("beta", beta)
        .derive("depthScale", depthScale)
        .derive("inverseDistance", inverseDistance)
        .derive("toSun", toSun)
        .derive("sunLight", sunLight)
        .rows(rows)
        .reference(reference)
        .plan(plan);
}

}  // namespace

BRUME_PLUGIN(effect())
