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

// How opaque the fog is in front of a surface, but for the limit, where the noise is n all the way.
inline double opacityAt(const NoiseFog& p, float n, double distance, double dy) {
    const float y = float(dy);
    const double relative = p.mode == modulate   ? modulated<modulate>(p, n, y)
                            : p.mode == ocean    ? modulated<ocean>(p, n, y)
                            : p.mode == additive ? modulated<additive>(p, n, y)
                                                 : modulated<subtractive>(p, n, y);
    const double x = std::max(0., distance - p.start);
    return p.model == exponential ? -std::expm1(-double(p.density) * relative * x)
                                  : relative * std::pow(x / double(p.powerDistance), double(p.powerExponent));
}

// Every second ray ends where the fog still thickens: farther, dense fog hides whatever its noise does.
inline std::vector<Probe> cutShort(const NoiseFog& p, const PlanInput& in, std::vector<Probe> rays) {
    constexpr double farthest = 1e6;
    auto reachOf = [&](size_t k, double slope, double far) {
        const float n = k % 2 ? .25f : .75f;
        const double wanted = p.maxOpacity * (k / 2 % 2 ? .5 : .97);
        for (double near = in.frame.minDistance; far - near > 1e-6 * far;) {
            const double middle = (near + far) / 2;
            (opacityAt(p, n, middle, middle * slope) < wanted ? near : far) = middle;
        }
        return far;
    };
    const double level[] = {reachOf(0, 0, farthest), reachOf(1, 0, farthest), reachOf(2, 0, farthest),
                            reachOf(3, 0, farthest)};
    cv::parallel_for_({0, int(rays.size() / 2)}, [&](const cv::Range& range) {
        for (int k = range.start; k < range.end; k++) {
            Probe& ray = rays[2 * k + 1];
            const double far = std::min(ray.distance, farthest);
            const double reach = p.mode == ocean ? reachOf(k, ray.direction[1], far) : level[k % 4];
            if (reach < .99 * farthest) ray.distance = std::min(ray.distance, reach);
        }
    });
    std::stable_sort(rays.begin(), rays.end(),
                     [](const Probe& a, const Probe& b) { return a.distance < b.distance; });
    return rays;
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
    // Margins are what was seen on 40 frames of 1280×720, of methods and numbers of steps near the tolerance:
    // all pixels were up to 6 times as bad as the few rays, and up to 4.4 times as one ray of every tile.
    // Four of every tile come to 1.6 times, or to what the growth from one to four tells. At the surface,
    // where a ray is one place and the volume is the only choice, sixteen may settle what four do not, and
    // all of them what those do not.
    Texels texels(p.edge());
    std::vector<TrialLevel> levels = {{0, 8}, {1, 4}, {2, 1.6}};
    if (!isMarch) levels.insert(levels.end(), {{4, 1.25}, {ImageBounds::tile, 1.1}});
    TrialLevels<RayTrial> trials(levels, [&](int finer) {
        return std::make_unique<RayTrial>(
            p, in, finer ? cutShort(p, in, raysEverywhere(in, finer)) : fewRays(p, in), texels);
    });
    auto errorOf = [&](const TrialOption& option, double enough) { return trials.error(option, enough); };
    const TrialChoice best = cheapest(options, in.tolerance, isMarch && in.chooses("steps"), errorOf);
    plan.chosen["method"] = best.option.method;
    if (plan.chosen.count("steps")) plan.chosen["steps"] = best.option.steps;
    plan.predictedCost = best.option.cost;
    const double edge = trials.at(0).atEdge(best.option.method, best.option.steps);
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
