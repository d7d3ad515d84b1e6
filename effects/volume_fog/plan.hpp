// What this frame needs of volume_fog (MODELS.md §9).
#pragma once

#include <cmath>

#include "effect/plan.hpp"
#include "error.hpp"
#include "volume_fog/volume_fog.hpp"

namespace volume_fog {

inline brume::Plan plan(const Params& p, const brume::PlanInput& input) {
    brume::Plan plan;
    const double reach =
        input.frame.skyShare > 0 ? p.max_distance : std::min(input.frame.maxDistance, double(p.max_distance));
    const double noise = p.noise == Additive ? 1. + p.noise_strength : 1;
    // Bounds: every volume met for as long as it can be, every lamp at its brightest.
    double depth = p.density * reach, extent = p.density > 0 ? reach : 0;
    double shortest = p.height_falloff != NoFalloff && p.density > 0 ? p.height_distance : HUGE_VAL;
    for (const Box& box : p.boxes) {
        const double across = std::min(reach, cv::norm(cv::Vec3d(box.size)));
        depth += box.density * across;
        extent = std::max(extent, across);
        if (box.height_falloff != NoFalloff) shortest = std::min(shortest, double(box.height_distance));
        if (box.edge_falloff != NoFalloff)
            shortest = std::min(shortest, .5 * std::min(box.size[0] * (1 - .01 * box.edge_start_x),
                                                        box.size[2] * (1 - .01 * box.edge_start_z)));
    }
    depth *= noise;
    const double peak = p.phase == HenyeyGreenstein
                            ? (1 + std::abs(p.anisotropy)) / std::pow(1 - std::abs(p.anisotropy), 2)
                            : (p.phase == Rayleigh ? 1.5 : 1);
    double light = 0;
    for (int k = 0; k < 3; k++) {
        double one =
            double(p.ambient[k]) * p.ambient_intensity + .25 * peak * p.sun_color[k] * p.sun_intensity;
        for (const PointLight& l : p.point_lights)
            one += .25 * peak * l.color[k] * l.intensity / std::max(double(l.attenuation[0]), 1e-4);
        light = std::max(light, one);
    }
    plan.maxOutput = std::max(input.maxInput, light);
    // sRGB's slope is at most 12.92.
    const double most = 12.92 * (1 - std::exp(-depth)) * std::max(light, input.maxInput);
    plan.skip = most < input.tolerance && !input.transmittanceIsRead;
    if (plan.skip) {
        plan.why = brume::text("optical depth is at most ", depth, ": nobody can see it");
        return plan;
    }
    plan.chosen["method"] = p.point_lights.empty() ? Midpoint : Equiangular;
    // Midpoint's error N^-2·extent³·|ρ''|/24, taking a falloff or noise cell for the scale on which ρ bends.
    if (p.noise != NoNoise) shortest = std::min(shortest, double(p.noise_size));
    const double depthSeen = std::min(depth, 3.);  // behind that much fog errors fade
    const double bends = shortest < HUGE_VAL && shortest > 0 ? extent / shortest : 0;
    double steps = std::sqrt(depthSeen * bends * bends / (24 * input.tolerance)) * .5;
    if (!p.point_lights.empty()) steps = std::max(steps, 48.);
    if (p.shadow_strength > 0) steps = std::max(steps, 32.);
    const long chosen = long(std::clamp(std::ceil(steps / 8) * 8, 16., 256.));
    plan.chosen["steps"] = chosen;
    plan.predictedError = steps > 0 ? input.tolerance * std::pow(steps / double(chosen), 2) : 0;
    plan.predictedCost = .6 * double(chosen) * double(1 + p.boxes.size() * .5 + p.point_lights.size() * .5);
    plan.why = brume::text(p.point_lights.empty() ? "midpoint" : "equiangular near lamps", ", ", chosen,
                           " steps for fog that bends over ",
                           bends > 0 ? brume::text(extent / bends, " m") : "nothing", " in ", extent, " m");
    return plan;
}

}  // namespace volume_fog
