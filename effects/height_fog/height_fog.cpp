// height_fog: fog whose extinction depends on height alone (MODELS.md §2; P3 eqs 6-9).
//
//   out = C·T + A·(1 - T), T = exp(-τ) per channel, alpha passes through
//   τ = ∫ ρ(y) ds along the view ray = L·(mean of ρ between the eye's height and the surface's)
//   ρ in 1/m: two exponential layers density·tint·exp(-falloff·(y - height)), or linear between the points of
//   a ramp or a table, constant beyond them
//
// Limits: L = 0 or ρ = 0 give T = 1; a level ray has ρ of the eye; sky has (∫ ρ to where the ray goes)/|d.y|,
// infinite unless the fog ends; T = 0 gives A even for C = inf. Heights are counted from the eye, rebased in
// fp64.
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/fog.hpp"
#include "effect/plugin.hpp"
#include "height_fog/derived.hpp"
#include "height_fog/methods.hpp"
#include "height_fog/params.hpp"
#include "height_fog/reference.hpp"

namespace brume::height_fog {
namespace {

// --- derived constants, fp64

double eyeOf(const DeriveContext& c) { return c.camera.eye()[1]; }

std::vector<double> numbers(const cv::Vec3d& v) { return {v[0], v[1], v[2]}; }

std::vector<double> perNode(const std::vector<cv::Vec3d>& rgb) {
    std::vector<double> all;
    for (const auto& v : rgb) all.insert(all.end(), {v[0], v[1], v[2], 0});
    return all;
}

std::vector<double> eyeDensity(const HeightFog& p, const DeriveContext& c) {
    return numbers(ProfileFunction(p, eyeOf(c)).at(0));
}
std::vector<double> depthAbove(const HeightFog& p, const DeriveContext& c) {
    return numbers(ProfileFunction(p, eyeOf(c)).endlessIntegral(true));
}
std::vector<double> depthBelow(const HeightFog& p, const DeriveContext& c) {
    return numbers(ProfileFunction(p, eyeOf(c)).endlessIntegral(false));
}
std::vector<double> logDensity(const HeightFog& p, const DeriveContext& c) {
    auto at = [&](double density, double height, double falloff) {
        return density > 0 ? std::log(density) - falloff * (eyeOf(c) - height) : 0;
    };
    return {at(p.density, p.height, p.falloff), at(p.density2, p.height2, p.falloff2)};
}

Knots fourKnots(const HeightFog& p, double eye) {
    Knots knots = rampKnots(p, eye);
    if (knots.empty()) knots.push_back({0, {}});
    knots.resize(4, knots.back());
    return knots;
}
std::vector<double> rampKnotNumbers(const HeightFog& p, const DeriveContext& c) {
    std::vector<double> all;
    for (const auto& k : fourKnots(p, eyeOf(c)))
        all.insert(all.end(), {k.density[0], k.density[1], k.density[2], k.y});
    return all;
}
std::vector<double> rampSlopes(const HeightFog& p, const DeriveContext&) {
    const Knots knots = fourKnots(p, 0);
    std::vector<cv::Vec3d> slopes(4);
    for (int k = 0; k < 3; k++) {
        const double way = knots[k + 1].y - knots[k].y;
        if (way > 0) slopes[k] = (knots[k + 1].density - knots[k].density) * (1 / way);
    }
    return perNode(slopes);
}

std::vector<double> nodeCount(const HeightFog& p, const DeriveContext&) { return {double(tableNodes(p))}; }
std::vector<double> tableStep(const HeightFog& p, const DeriveContext& c) {
    return {makeTable(p, eyeOf(c)).step};
}
std::vector<double> tableBase(const HeightFog& p, const DeriveContext& c) {
    return {double(makeTable(p, eyeOf(c)).base)};
}
std::vector<double> tableBaseHeight(const HeightFog& p, const DeriveContext& c) {
    return {makeTable(p, eyeOf(c)).baseHeight};
}
std::vector<double> tableDensity(const HeightFog& p, const DeriveContext& c) {
    return perNode(makeTable(p, eyeOf(c)).density);
}
std::vector<double> tableMean(const HeightFog& p, const DeriveContext& c) {
    return perNode(makeTable(p, eyeOf(c)).mean);
}
std::vector<double> tableToNode(const HeightFog& p, const DeriveContext& c) {
    return perNode(makeTable(p, eyeOf(c)).toNode);
}

// --- CPU

// fp32 constants of one call.
struct Constants {
    float eyeDensity[3], above[3], below[3];
    Layer layer[2];
    float logDensity[2];
    bool hasLayer[2];
    Ramp<float> ramp[3];
    TableView<float> table;
    bool oneChannel;
};

Constants constantsOf(const HeightFog& p, const CpuContext& c) {
    Constants k{};
    const auto knots = c.derived("ramp_knots"), slopes = c.derived("ramp_slopes");
    for (int n = 0; n < 3; n++) {
        k.eyeDensity[n] = c.derived("eye_density")[n];
        k.above[n] = c.derived("depth_above")[n];
        k.below[n] = c.derived("depth_below")[n];
        for (int i = 0; i < 4; i++) {
            k.ramp[n].y[i] = knots[4 * i + 3];
            k.ramp[n].density[i] = knots[4 * i + n];
            k.ramp[n].slope[i] = slopes[4 * i + n];
        }
    }
    for (int l = 0; l < 2; l++) {
        k.logDensity[l] = c.derived("log_density")[l];
        k.layer[l] = Layer::of(k.logDensity[l], l == 0 ? p.falloff : p.falloff2);
    }
    k.hasLayer[0] = p.density > 0, k.hasLayer[1] = p.density2 > 0;
    k.table = {c.derived("table_density").data(), c.derived("table_mean").data(),
               c.derived("table_to_node").data(), int(c.derived("table_nodes")[0]),
               int(c.derived("table_base")[0]),   c.derived("table_base_height")[0],
               c.derived("table_step")[0]};
    auto grey = [](const cv::Vec3f& t) { return t[0] == t[1] && t[1] == t[2]; };
    if (p.profile == exponential)
        k.oneChannel = (!k.hasLayer[0] || grey(p.tint)) && (!k.hasLayer[1] || grey(p.tint2));
    else if (p.profile == ramp)
        k.oneChannel = std::all_of(p.ramp.begin(), p.ramp.end(), [&](auto& r) { return grey(r.tint); });
    else
        k.oneChannel = std::all_of(p.table.begin(), p.table.end(), [&](auto& r) { return grey(r.tint); });
    return k;
}

// A tile of one row: how long each way is, what it climbs over it and over a metre of planar depth, and the
// fog.
struct Tile : FogTile {
    float L[fogTileSize], dy[fogTileSize], climb[fogTileSize], length[fogTileSize];
};

constexpr float endlessWay = 1e30f;

BRUME_INLINE void raysTile(const View& v, const float* depth, int i0, float y, int count, Tile& t) {
    const auto& r = v.worldFromView;
    const float rx = r(1, 0), ry = r(1, 1), rz = r(1, 2), originX = v.originX, inverseFx = v.inverseFx;
    for (int i = 0; i < count; i++) {
        const float x = (float(i0 + i) + originX) * inverseFx;
        t.length[i] = View::rayLength(x, y);
        t.climb[i] = (rx * x + ry * y) - rz;
        const float Z = depth[i] < endlessWay ? depth[i] : endlessWay;
        t.L[i] = Z * t.length[i];
        t.dy[i] = Z * t.climb[i];
    }
}

// 5. Optical depth from the mean density held in opticalDepth[n]; sky and other endless ways apart.
BRUME_INLINE void depthTile(const Constants& k, int n, int count, Tile& t) {
    const float above = k.above[n], below = k.below[n], level = k.eyeDensity[n] * endlessWay;
    float* opticalDepth = t.opticalDepth[n];
    for (int i = 0; i < count; i++) {
        const float climb = t.climb[i];
        float sky = (climb > 0.0f ? above : below) * t.length[i] / std::fabs(climb);
        sky = climb == 0.0f ? level : sky;
        opticalDepth[i] = t.L[i] >= endlessWay ? sky : t.L[i] * opticalDepth[i];
    }
}

// 1. Exponential layers, sky and all.
BRUME_INLINE void layersTile(const HeightFog& p, const Constants& k, int channels, int count, Tile& t) {
    bool isFirst = true;
    for (int l = 0; l < 2; l++) {
        if (!k.hasLayer[l]) continue;
        const Layer layer = k.layer[l];
        float* depth = t.opacity[0];  // free until the optical depth is known
        if (layer.deep > 0)
            for (int i = 0; i < count; i++) depth[i] = layer.opticalDepth<true>(t.L[i], t.dy[i]);
        else
            for (int i = 0; i < count; i++) depth[i] = layer.opticalDepth<false>(t.L[i], t.dy[i]);
        for (int n = 0; n < channels; n++) {
            const float tint = (l == 0 ? p.tint : p.tint2)[n];
            float* sum = t.opticalDepth[n];
            if (isFirst)
                for (int i = 0; i < count; i++) sum[i] = tint * depth[i];
            else
                for (int i = 0; i < count; i++) sum[i] += tint * depth[i];
        }
        isFirst = false;
    }
    for (int n = 0; n < channels && isFirst; n++) std::fill_n(t.opticalDepth[n], count, 0.0f);
}

template <int method>
BRUME_INLINE void tableTile(const Constants& k, int channels, int count, Tile& t) {
    using View = TableView<float>;
    const View table = k.table;
    const View::Place eye = table.placeOf(0.0f);
    int cell[fogTileSize], near[fogTileSize], far[fogTileSize];
    float cells[fogTileSize];
    for (int i = 0; i < count; i++) {
        const View::Place at = table.placeOf(t.dy[i]);
        cell[i] = at.cell, near[i] = at.near, far[i] = at.far, cells[i] = at.cells;
    }
    // Loads apart from arithmetic, whose loops then vectorise.
    float a[fogTileSize], b[fogTileSize], whole[fogTileSize], toNode[fogTileSize];
    for (int n = 0; n < channels; n++) {
        for (int i = 0; i < count; i++) {
            const View::Found found = table.find(n, near[i], far[i]);
            a[i] = found.near, b[i] = found.far, whole[i] = found.cellMean, toNode[i] = found.toNode;
        }
        for (int i = 0; i < count; i++)
            t.opticalDepth[n][i] = table.mean<method>({a[i], b[i], whole[i], toNode[i]}, eye,
                                                      {cell[i], near[i], far[i], cells[i]}, t.dy[i]);
    }
}

BRUME_INLINE float densityAt(const HeightFog& p, const Constants& k, int n, float y) {
    if (p.profile == ramp) return k.ramp[n].at(y);
    if (p.profile == table) return k.table.at(n, y);
    float rho = 0;
    for (int l = 0; l < 2; l++)
        if (k.hasLayer[l])
            rho += (l == 0 ? p.tint : p.tint2)[n] *
                   expFast(std::min(k.logDensity[l] - k.layer[l].falloff * y, 60.0f));
    return rho;
}

BRUME_INLINE void meanTile(const HeightFog& p, const Constants& k, int channels, int count, Tile& t) {
    if (p.method == march) {
        for (int n = 0; n < channels; n++)
            for (int i = 0; i < count; i++)
                t.opticalDepth[n][i] =
                    marchMean(t.dy[i], p.steps, [&](float y) { return densityAt(p, k, n, y); });
    } else if (p.method == tableLinear) {
        tableTile<tableLinear>(k, channels, count, t);
    } else if (p.method == tableHermite) {
        tableTile<tableHermite>(k, channels, count, t);
    } else if (p.profile == table) {
        tableTile<closedForm>(k, channels, count, t);
    } else if (p.profile == ramp) {
        for (int n = 0; n < channels; n++)
            for (int i = 0; i < count; i++) t.opticalDepth[n][i] = k.ramp[n].mean(t.dy[i], k.eyeDensity[n]);
    } else {
        layersTile(p, k, channels, count, t);
    }
}

BRUME_VECTORISE void rows(const HeightFog& p, const CpuContext& c, cv::Range range) {
    const Constants k = constantsOf(p, c);
    const int channels = k.oneChannel ? 1 : 3;
    const bool endsInSky = p.method == closedForm && p.profile == exponential;
    Tile t;
    forEachSpan(c, range, [&](const FogSpan& s) BRUME_INLINED {
        s.fetch(0);
        raysTile(c.view, s.depth, s.first, s.y, s.count, t);
        s.fetch(1);
        meanTile(p, k, channels, s.count, t);
        for (int n = 0; n < channels && !endsInSky; n++) depthTile(k, n, s.count, t);
        s.fetch(2);
        extinctionTile(t, channels, s.count);
        storeTile<false>(t, k.oneChannel, p.color, s);
    });
}

// --- reference

void reference(const HeightFog& p, const ReferenceContext& c, std::span<const cv::Point> pixels,
               std::span<ReferencePixel> truth) {
    const ApproximateDepth approximate(p);
    const double epsilon = std::numeric_limits<float>::epsilon();
    const double eye = c.camera.eye()[1];
    for (size_t k = 0; k < pixels.size(); k++) {
        const cv::Vec4f scene = c.input.at<cv::Vec4f>(pixels[k]);
        const cv::Vec3d ray = c.camera.ray(pixels[k].x, pixels[k].y);
        const double L = double(c.depth.at<float>(pixels[k])) * cv::norm(ray);
        const auto& m = c.camera.worldFromCamera;
        const double up = (m(1, 0) * ray[0] + m(1, 1) * ray[1] + m(1, 2) * ray[2]) / cv::norm(ray);
        ReferencePixel& pixel = truth[k];
        pixel = {};
        for (int n = 0; n < 3; n++) {
            const double depth = referenceDepth(p, eye, L, up, n), T = std::exp(-depth);
            const double opacity = -std::expm1(-depth), A = p.color[n];
            pixel.color[n] = (depth < 87 ? scene[n] * T : 0) + A * opacity;
            pixel.transmittance[n] = T;
            const double C = std::isfinite(scene[n]) ? double(scene[n]) : 0;
            pixel.scale = std::max({pixel.scale, std::abs(C), A});

            // What 4 ulp of the way, of its direction, of the heights and of the exponents do; what the
            // method leaves.
            double change = 0;
            auto against = [&](double other) {
                change = std::max(change, std::abs(std::exp(-other) - T));
                // from here on even infinity is hidden
                if (!std::isfinite(scene[n]) && (other < 87) != (depth < 87)) pixel.ambiguous = true;
            };
            double sum = 0;
            auto take = [&] { sum += change, change = 0; };
            for (int sign : {-1, 1}) against(referenceDepth(p, eye, L, up + sign * 4 * epsilon, n));
            take();
            const double dy = std::isfinite(L) ? std::abs(L * up) : 0;
            const double exponent =
                p.profile == exponential
                    ? std::max({std::abs(p.falloff * (eye - p.height)),
                                std::abs(p.falloff2 * (eye - p.height2)), p.falloff * dy, p.falloff2 * dy})
                    : 0;
            if (std::isfinite(L)) {
                const double held = heldHeight(p, eye, L * up);
                for (int sign : {-1, 1})
                    against(referenceDepth(p, eye + sign * 4 * epsilon * held, L, up, n));
                take();
                against(depth * (1 + 4 * epsilon * (1 + exponent)) +
                        4 * epsilon * L * referenceDensity(p, eye + L * up, n));
                take();
                against(depth + approximate.changeOfHeights(eye, L, up, n));
                take();
            }
            // Where a method is far from the truth, its own depth is what rounding moves.
            if (std::isfinite(L) && !approximate.isExact()) {
                const double own = approximate(eye, L, up, n);
                const double moved =
                    own * 4 * epsilon * (1 + exponent) + approximate.changeOfHeights(eye, L, up, n);
                double around = std::exp(-std::max(0., own - moved)) - std::exp(-own);
                for (int sign : {-1, 1})
                    around +=
                        std::abs(std::exp(-approximate(eye, L, up + sign * 4 * epsilon, n)) - std::exp(-own));
                sum = std::max(sum, around);
            }
            const double reach = std::abs(C - A);
            pixel.allowance = std::max(pixel.allowance, sum * reach);
            pixel.transmittanceAllowance = std::max(pixel.transmittanceAllowance, sum);
            if (std::isfinite(L) && !approximate.isExact()) {
                const double own = approximate(eye, L, up, n);
                against(own);
                change += own * std::exp(-own) * approximate.roundingOfSum();
                pixel.methodError = std::max(pixel.methodError, change * reach);
                pixel.transmittanceMethodError = std::max(pixel.transmittanceMethodError, change);
            }
        }
        pixel.color[3] = scene[3];
    }
}

// --- plan

Plan plan(const HeightFog& p, const PlanInput& in) {
    Plan plan;
    plan.chosen["method"] = closedForm;
    plan.why = "the closed form is exact and cheaper than any table or march";
    plan.predictedCost = p.profile == table  ? 2
                         : p.profile == ramp ? 2.4
                         : p.density2 > 0    ? 3
                                             : 1.8;  // measured
    const auto [darkest, airlight] =
        std::minmax({double(p.color[0]), double(p.color[1]), double(p.color[2])});
    plan.output = in.input.mixedWith(darkest, airlight);

    // The densest of all heights that the ways pass bounds the opacity of the farthest.
    const double low = std::min(in.frame.minHeight, in.frame.eyeHeight),
                 high = std::max(in.frame.maxHeight, in.frame.eyeHeight);
    std::vector<double> heights = {low, high};
    for (const Knot& knot : p.profile == ramp    ? rampKnots(p, 0)
                            : p.profile == table ? tableKnots(p, 0)
                                                 : Knots{})
        if (knot.y > low && knot.y < high) heights.push_back(knot.y);
    const ProfileFunction profile(p, 0);
    double densest = 0;
    for (double y : heights) {
        const cv::Vec3d rho = profile.at(y);
        densest = std::max({densest, rho[0], rho[1], rho[2]});
    }
    double depth = densest * in.frame.maxDistance;
    if (in.frame.skyShare > 0) {
        const ProfileFunction fromEye(p, in.frame.eyeHeight);
        for (const cv::Vec3d& v : {fromEye.endlessIntegral(true), fromEye.endlessIntegral(false)})
            if (v[0] + v[1] + v[2] > 0) depth = HUGE_VAL;
    }
    const double change = in.mixingShows(-std::expm1(-depth), darkest, airlight);
    if (!in.transmittanceIsRead && change <= in.tolerance) {
        plan.skip = true;
        plan.predictedError = change;
        plan.predictedCost = 0;
        plan.why = "even the longest way through the densest height changes less than the tolerance";
    }
    return plan;
}

}  // namespace

auto effect() {
    using Point = EffectOf<HeightFog>::RowBinder<RampPoint>;
    using Row = EffectOf<HeightFog>::RowBinder<TableRow>;
    return EffectOf<HeightFog>()
        .bind("color", &HeightFog::color)
        .bind("profile", &HeightFog::profile)
        .bind("method", &HeightFog::method)
        .bind("density", &HeightFog::density)
        .bind("height", &HeightFog::height)
        .bind("falloff", &HeightFog::falloff)
        .bind("tint", &HeightFog::tint)
        .bind("density2", &HeightFog::density2)
        .bind("height2", &HeightFog::height2)
        .bind("falloff2", &HeightFog::falloff2)
        .bind("tint2", &HeightFog::tint2)
        .list<RampPoint>("ramp", &HeightFog::ramp,
                         [](Point& b) {
                             b.bind("height", &RampPoint::height)
                                 .bind("density", &RampPoint::density)
                                 .bind("tint", &RampPoint::tint);
                         })
        .list<TableRow>("table", &HeightFog::table,
                        [](Row& b) { b.bind("density", &TableRow::density).bind("tint", &TableRow::tint); })
        .bind("table_bottom", &HeightFog::tableBottom)
        .bind("table_top", &HeightFog::tableTop)
        .bind("table_size", &HeightFog::tableSize)
        .bind("steps", &HeightFog::steps)
        .derive("eye_density", eyeDensity)
        .derive("depth_above", depthAbove)
        .derive("depth_below", depthBelow)
        .derive("log_density", logDensity)
        .derive("ramp_knots", rampKnotNumbers)
        .derive("ramp_slopes", rampSlopes)
        .derive("table_nodes", nodeCount)
        .derive("table_step", tableStep)
        .derive("table_base", tableBase)
        .derive("table_base_height", tableBaseHeight)
        .derive("table_density", tableDensity)
        .derive("table_mean", tableMean)
        .derive("table_to_node", tableToNode)
        .rows(rows)
        .referenceImage(reference)
        .plan(plan);
}

}  // namespace brume::height_fog

BRUME_PLUGIN(brume::height_fog::effect())
