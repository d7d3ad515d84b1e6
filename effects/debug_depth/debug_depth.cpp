// debug_depth: planar depth as colours on a logarithmic scale.
//
//   place = sat((log2 Z - log2 nearest)/(log2 farthest - log2 nearest)); Z = 0 is the near end, sky is white
//   out = C·(1 - strength) + palette(place)·strength; farthest ≤ nearest: a step at nearest
#include <algorithm>
#include <cmath>

#include "effect/kit/math.hpp"
#include "effect/plugin.hpp"

namespace {

using namespace brume;

struct DebugDepth {
    int palette;
    float nearest, farthest, strength;
};

std::vector<double> logNearest(const DebugDepth& p, const DeriveContext&) {
    return {std::log2(double(p.nearest))};
}

std::vector<double> inverseOctaves(const DebugDepth& p, const DeriveContext&) {
    double octaves = std::log2(double(p.farthest) / p.nearest);
    return {octaves > 0 ? std::min(1 / octaves, 1e30) : 1e30};
}

// Colour as a function of the place: for each channel the value at place 0 and the change in each quarter.
constexpr float first[3] = {.85f, .10f, .05f};
constexpr float change[4][3] = {
    {0, .55f, 0}, {-.75f, -.10f, .15f}, {-.05f, -.35f, .55f}, {.10f, -.17f, -.45f}};

BRUME_VECTORISE void rows(const DebugDepth& p, const CpuContext& c, cv::Range range) {
    const float base = c.derived("logNearest")[0], scale = c.derived("inverseOctaves")[0];
    const float strength = p.strength, keep = 1.0f - p.strength;
    const bool grey = p.palette == 1;
    constexpr int tile = 256;
    float place[tile];
    for (int j = range.start; j < range.end; j++) {
        const float* depth = c.depth.ptr<float>(j);
        const float* in = c.input.ptr<float>(j);
        float* out = const_cast<float*>(c.output.ptr<float>(j));
        for (int i0 = 0; i0 < c.view.width; i0 += tile) {
            int count = std::min(tile, c.view.width - i0);
            // 1. place
            for (int i = 0; i < count; i++) {
                float z = std::max(depth[i0 + i], 1.17549435e-38f);
                place[i] = std::min(std::max((log2Fast(std::min(z, 3e38f)) - base) * scale, 0.0f), 1.0f);
            }
            // 2, 3. colour and mix
            for (int i = 0; i < count; i++) {
                bool sky = isInf(depth[i0 + i]);
                for (int n = 0; n < 3; n++) {
                    float shown = 1.0f - place[i];
                    if (!grey) {
                        shown = first[n];
                        for (int q = 0; q < 4; q++)
                            shown +=
                                change[q][n] * std::min(std::max(place[i] * 4.0f - float(q), 0.0f), 1.0f);
                    }
                    float scene = in[4 * (i0 + i) + n];
                    float left = keep > 0.0f ? scene * keep : 0.0f;
                    out[4 * (i0 + i) + n] = left + (sky ? 1.0f : shown) * strength;
                }
                out[4 * (i0 + i) + 3] = in[4 * (i0 + i) + 3];
            }
        }
    }
}

ReferencePixel reference(const DebugDepth& p, const ReferenceContext& c, cv::Point at) {
    static const double stops[5][3] = {
        {.85, .10, .05}, {.85, .65, .05}, {.10, .55, .20}, {.05, .20, .75}, {.15, .03, .30}};
    cv::Vec4f scene = c.input.at<cv::Vec4f>(at);
    double z = c.depth.at<float>(at);
    double place = p.farthest > p.nearest ? std::log(z / p.nearest) / std::log(double(p.farthest) / p.nearest)
                                          : (z > p.nearest ? 1 : 0);
    place = std::clamp(place, 0., 1.);
    ReferencePixel pixel;
    int stop = std::min(int(place * 4), 3);
    for (int n = 0; n < 3; n++) {
        double shown = 1 - place;
        if (p.palette == 0)
            shown = stops[stop][n] + (stops[stop + 1][n] - stops[stop][n]) * (place * 4 - stop);
        if (std::isinf(z)) shown = 1;
        double left = p.strength < 1 ? double(scene[n]) * (1 - double(p.strength)) : 0;
        pixel.color[n] = left + shown * p.strength;
        if (std::isfinite(scene[n])) pixel.scale = std::max(pixel.scale, std::abs(double(scene[n])));
    }
    pixel.color[3] = scene[3];
    // log2 Z in fp32 carries ulp(log2 Z), which a short scale magnifies.
    double octaves = std::log2(double(p.farthest) / p.nearest);
    double logUlp =
        4 * 6e-8 *
        std::max({1., std::abs(std::log2(double(p.nearest))), std::abs(std::log2(std::max(z, 1e-38)))});
    if (std::isfinite(z))
        pixel.allowance =
            std::min(1., octaves > 0 ? logUlp / octaves * 3 : std::abs(z - p.nearest) < 1e-6 * z);
    return pixel;
}

}  // namespace

BRUME_PLUGIN(EffectOf<DebugDepth>()
                 .bind("palette", &DebugDepth::palette)
                 .bind("nearest", &DebugDepth::nearest)
                 .bind("farthest", &DebugDepth::farthest)
                 .bind("strength", &DebugDepth::strength)
                 .derive("logNearest", logNearest)
                 .derive("inverseOctaves", inverseOctaves)
                 .rows(rows)
                 .reference(reference))
