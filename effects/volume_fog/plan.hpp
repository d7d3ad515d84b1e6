// What this frame needs of volume_fog (MODELS.md §9): methods and step counts are tried on some of its rays.
#pragma once

#include <cmath>
#include <map>
#include <opencv2/core/utility.hpp>

#include "effect/plan.hpp"
#include "error.hpp"
#include "volume_fog/trial.hpp"
#include "volume_fog/volume_fog.hpp"

namespace volume_fog {

// Bounds: every volume met for as long as it can be, every lamp at its brightest.
struct Bounds {
    double depth = 0, light = 0;
};
inline Bounds boundsOf(const Params& p, const brume::PlanInput& in) {
    const double reach =
        in.frame.skyShare > 0 ? p.max_distance : std::min(in.frame.maxDistance, double(p.max_distance));
    Bounds bounds;
    bounds.depth = p.density * reach;
    for (const Box& box : p.boxes)
        bounds.depth += box.density * std::min(reach, cv::norm(cv::Vec3d(box.size)));
    if (p.noise == Additive) bounds.depth *= 1 + p.noise_strength;
    const double g = std::abs(p.anisotropy);
    const double peak = p.phase == HenyeyGreenstein ? (1 + g) / std::pow(1 - g, 2)
                        : p.phase == Rayleigh       ? 1.5
                                                    : 1;
    for (int k = 0; k < 3; k++) {
        double light =
            double(p.ambient[k]) * p.ambient_intensity + .25 * peak * p.sun_color[k] * p.sun_intensity;
        for (const PointLight& l : p.point_lights)
            light += .25 * peak * l.color[k] * l.intensity / std::max(double(l.attenuation[0]), 1e-4);
        bounds.light = std::max(bounds.light, light);
    }
    return bounds;
}

// Frame copies on the CPU at 1280×720 with two threads. `lampShare`: of the rays, within lamps' ranges.
inline double costOf(const Params& p, int method, int steps, double lampShare) {
    const double volumes = double(p.density > 0) + double(p.boxes.size());
    double step = .3 + .3 * volumes + (method == Equiangular ? 1. : .5) * lampShare;
    if (p.noise != NoNoise)
        step += 2.3 * (method == SharedNoise ? .5 : method == GaussLegendre ? 1. : 1. / p.noise_every);
    return 3 + steps * step;
}

struct Option {
    int method, steps;
    double cost;
};
inline std::vector<Option> optionsOf(const Params& p, const brume::PlanInput& in, double lampShare) {
    std::vector<int> methods = {Midpoint, GaussLegendre};
    if (p.noise != NoNoise) methods.push_back(SharedNoise);
    if (lampShare > 0) methods.push_back(Equiangular);
    if (!in.chooses("method")) methods = {p.method};
    std::vector<int> numbers;
    for (double steps = 1; steps <= 512.5; steps = std::max(steps + 1, steps * std::pow(2., .25)))
        numbers.push_back(int(std::lround(steps)));
    numbers.push_back(512);
    std::vector<Option> options;
    for (int method : methods) {
        if (!in.chooses("steps")) {
            options.push_back({method, p.steps, costOf(p, method, p.steps, lampShare)});
            continue;
        }
        int last = 0;
        for (int steps : numbers) {
            if (method == GaussLegendre) steps = (steps + 3) / 4 * 4;  // whole panels
            if (steps == last) continue;
            options.push_back({method, steps, costOf(p, method, steps, lampShare)});
            last = steps;
        }
    }
    std::sort(options.begin(), options.end(),
              [](const Option& a, const Option& b) { return a.cost < b.cost; });
    return options;
}

inline const char* nameOf(int method) {
    const char* names[] = {"left",         "midpoint", "gauss_legendre", "jittered", "equiangular",
                           "shared_noise", "p2"};
    return names[method];
}

inline brume::Plan plan(const Params& p, const brume::PlanInput& in) {
    brume::Plan plan;
    const Bounds bounds = boundsOf(p, in);
    plan.output = in.input.mixedWith(0, bounds.light);
    plan.chosen["method"] = in.chooses("method") ? int(Midpoint) : p.method;
    plan.chosen["steps"] = p.steps;
    plan.predictedError = in.mixingShows(-std::expm1(-bounds.depth), 0, bounds.light);
    if (plan.predictedError <= in.tolerance && !in.transmittanceIsRead) {
        plan.skip = true;
        plan.why =
            brume::text("an optical depth of at most ", bounds.depth, " changes less than the tolerance");
        return plan;
    }
    if (p.method == P2 && !in.chooses("method")) {
        // Its sum does not tend to the integral: more steps only smooth it.
        if (in.chooses("steps")) plan.chosen["steps"] = 128;
        plan.predictedCost = costOf(p, P2, int(plan.chosen["steps"]), 1);
        plan.predictedError = 1;
        plan.why = "p2 is not the integral at any number of steps; 128 are the paper's own";
        return plan;
    }
    // A ray is one of many: the worst of all is taken for twice the worst of those tried, for four times
    // where noise is shared between steps (2.9 times was seen). Too few steps may hit by luck, and the next
    // number not: both have to.
    auto marginOf = [](int method) { return method == SharedNoise ? 4. : 2.; };
    Trial trial(p, in);
    const double lampShare = trial.lampShare();
    const std::vector<Option> options = optionsOf(p, in, lampShare);
    Option best{};
    double error = HUGE_VAL;
    std::map<int, std::pair<Option, double>>
        before;  // by method: the option tried last, where it did not show
    for (const Option& option : options) {
        const double margin = marginOf(option.method);
        const double own =
            margin * trial.error(option.method, option.steps, in.tolerance / margin) + trial.doubt();
        auto [last, isFirst] = before.insert({option.method, {option, own}});
        if (isFirst) {
            if (in.chooses("steps") || own > in.tolerance) continue;
            last->second = {option, own};
        }
        if (std::max(own, last->second.second) <= in.tolerance) {
            best = last->second.first;
            error = std::max(own, last->second.second);
            break;
        }
        last->second = {option, own};
    }
    const bool isUnseen = error <= in.tolerance;
    if (!isUnseen) {
        error = HUGE_VAL;
        int most = 0;
        for (const Option& option : options) most = std::max(most, option.steps);
        for (const Option& option : options) {
            if (option.steps != most) continue;
            const double margin = marginOf(option.method);
            const double own =
                margin * trial.error(option.method, option.steps, error / margin) + trial.doubt();
            if (own < error) error = own, best = option;
        }
    }
    plan.chosen["method"] = best.method;
    plan.chosen["steps"] = best.steps;
    plan.predictedError = error;
    plan.predictedCost = best.cost;
    plan.why = brume::text(nameOf(best.method), " in ", best.steps,
                           isUnseen ? " steps is the cheapest that does not show on the rays tried"
                                    : " steps is the most exact, and may show");
    return plan;
}

}  // namespace volume_fog
