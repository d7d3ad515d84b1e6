// What noise_fog can leave out, and which noise is cheapest.
#pragma once

#include <algorithm>
#include <cmath>

#include "common/trial.hpp"
#include "effect/plugin.hpp"
#include "error.hpp"
#include "noise_fog/params.hpp"
#include "noise_fog/trial.hpp"

namespace brume::noise_fog {

// Octaves whose cells span two pixels on the nearest surface; finer ones only alias.
inline int octavesSeen(const NoiseFog& p, const FrameStatistics& frame) {
    const double footprint = frame.minDistance * frame.radiansPerPixel;
    int octaves = 1;
    while (octaves < 5 && p.size * std::pow(.5, octaves) > 2 * footprint) octaves++;
    return octaves;
}

// Frame copies on the CPU at 1280×720 with two threads, as `brume bench noise_fog --backend cpu` has them:
// `samples` places of noise a pixel.
inline double costOf(const NoiseFog& p, int method, int samples) {
    if (p.where == asAProduct) {
        double cost = 10;
        for (int a = 0; a < 3; a++) cost += p.axis(a).profile == noiseAxis ? 9 * p.octaves : 0;
        return cost;
    }
    return method == baked ? 3.9 + 1.6 * samples
                           : 1.1 + 1.7 * p.octaves * samples * std::pow(2 * p.smoothingRow() + 1, 3);
}

// The densest that the noise can make the fog.
inline double densest(const NoiseFog& p, const FrameStatistics& frame) {
    if (p.mode == additive) return 1 + p.strength;
    if (p.mode == subtractive) return 1;
    if (p.mode == modulate) return std::max(p.low, p.high);
    const double dy =
        std::max(std::abs(frame.maxHeight - frame.eyeHeight), std::abs(frame.minHeight - frame.eyeHeight));
    return dy * dy / 2 + .001;
}

// True where even the farthest surface at its densest changes by less than the tolerance.
inline bool isUnseen(const NoiseFog& p, const PlanInput& in, double darkest, double brightest, Plan& plan) {
    if (p.where == asAProduct || in.frame.skyShare > 0 || in.transmittanceIsRead) return false;
    const double x = std::max(0., in.frame.maxDistance - p.start), most = densest(p, in.frame);
    const double opacity = p.model == exponential
                               ? -std::expm1(-double(p.density) * x * most)
                               : most * std::pow(x / p.powerDistance, double(p.powerExponent));
    plan.predictedError = in.mixingShows(std::min(opacity, double(p.maxOpacity)), darkest, brightest);
    plan.skip = plan.predictedError <= in.tolerance;
    if (plan.skip) plan.why = "even the farthest surface at its densest changes by less than the tolerance";
    return plan.skip;
}

inline Plan plan(const NoiseFog& asked, const PlanInput& in) {
    NoiseFog p = asked;
    Plan plan;
    if (in.chooses("octaves")) plan.chosen["octaves"] = p.octaves = octavesSeen(p, in.frame);
    double darkest = HUGE_VAL, brightest = 0;
    for (int n = 0; n < 3; n++) {
        darkest = std::min(darkest, double(std::min(p.color[n], p.colorHigh[n])));
        brightest = std::max(brightest, double(std::max(p.color[n], p.colorHigh[n])) + p.sunColor[n]);
    }
    plan.output = in.input.mixedWith(darkest, brightest);
    const bool isMarch = p.where == alongTheRay;
    plan.chosen["method"] = procedural;
    if (isMarch || in.chooses("steps")) plan.chosen["steps"] = p.steps;  // others have none
    if (isUnseen(p, in, darkest, brightest, plan)) return plan;
    plan.predictedError = 0;
    if (p.where == asAProduct) {
        plan.predictedCost = costOf(p, procedural, 1);
        plan.why = "one closed form, nothing cheaper";
        return plan;
    }
    std::vector<int> methods = {procedural, baked};
    if (!in.chooses("method")) methods = {p.method};
    std::vector<TrialOption> options;
    for (int method : methods)
        for (int steps : isMarch&& in.chooses("steps") ? trialSteps(512) : std::vector<int>{p.steps})
            options.push_back({method, steps, costOf(p, method, isMarch ? steps : 1), method == baked});
    Texels texels(p.edge());
    // Some 14400 pixels: of 137 numbers of steps that were accepted, on 195 frames of 640×360 and 1280×720,
    // one was over the tolerance on some pixel, 1.15 times.
    const int apart = std::max(1, int(std::lround(std::sqrt(in.scene.size.area() / 14400.))));
    std::vector<TrialLevel> levels;
    if (isMarch || apart > 1) levels.push_back({apart, 1.25});
    // Smoothed noise at the surface may cost many times the volume: that this is unseen is worth a closer
    // look, in the end at every pixel.
    if (!isMarch && apart > 7) levels.push_back({apart / 4, 1.1});
    if (!isMarch) levels.push_back({1, 1});
    auto trialOf = [&](std::vector<Probe> rays) {
        return std::make_unique<RayTrial>(p, in, std::move(rays), texels);
    };
    TrialLevels<Screen<RayTrial>> trials(levels, [&](int each) {
        return std::make_unique<Screen<RayTrial>>(
            in, each, exactly, each == apart ? fewRays(p, in) : std::vector<Probe>(), trialOf,
            [&](const std::vector<Probe>& rays) { return fogOn(p, in, rays, texels); });
    });
    auto errorOf = [&](const TrialOption& option, double enough) {
        return option.method == procedural && !isMarch ? 0 : trials.error(option, enough);
    };
    const TrialChoice best = cheapest(options, in.tolerance, isMarch && in.chooses("steps"), errorOf);
    plan.chosen["method"] = best.option.method;
    if (plan.chosen.count("steps")) plan.chosen["steps"] = best.option.steps;
    plan.predictedCost = best.option.cost;
    const RayTrial* few = trials.at(0).first();
    const double edge = few ? few->atEdge(best.option.method, best.option.steps) : 0;
    plan.predictedError = std::max(best.error, edge);
    plan.why = best.option.method == baked ? "baked" : "procedural";
    if (isMarch) plan.why += text(" in ", best.option.steps, " steps");
    plan.why += !best.isUnseen ? " is the most exact, and may show"
                : edge > in.tolerance
                    ? " is the cheapest that does not show, except at the edge of holes in the fog"
                    : " is the cheapest that does not show";
    return plan;
}

}  // namespace brume::noise_fog
