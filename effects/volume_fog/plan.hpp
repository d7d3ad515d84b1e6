// What this frame needs of volume_fog (MODELS.md §9): methods and step counts are tried on some of its rays.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>

#include "effect/plan.hpp"
#include "error.hpp"
#include "volume_fog/trial.hpp"
#include "volume_fog/volume_fog.hpp"

namespace volume_fog {

// Bounds: every volume met for as long as it can be, every lamp at its brightest. p2 spreads no light over
// the sphere: it mixes sun, ambient and lamps as they are.
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
        if (p.method == P2 && !in.chooses("method")) {
            bounds.light =
                std::max({bounds.light, double(p.sun_color[k]) * p.sun_intensity, double(p.ambient[k])});
            for (const PointLight& l : p.point_lights)
                bounds.light = std::max(bounds.light, double(l.color[k]));
            continue;
        }
        double light =
            double(p.ambient[k]) * p.ambient_intensity + .25 * peak * p.sun_color[k] * p.sun_intensity;
        for (const PointLight& l : p.point_lights)
            light += .25 * peak * l.color[k] * l.intensity / std::max(double(l.attenuation[0]), 1e-4);
        bounds.light = std::max(bounds.light, light);
    }
    return bounds;
}

// Frame copies on the CPU at 1280×720 with two threads, as `brume bench volume_fog --backend cpu` has them.
// `lampShare`: of the rays, within lamps' ranges.
inline double costOf(const Params& p, int method, int steps, double lampShare, bool hasShadow) {
    const double volumes = double(p.density > 0) + double(p.boxes.size());
    const double lamp = (method == Equiangular ? 1.3 : .25) + (p.phase != Isotropic ? .5 : 0);
    double step = .3 + .3 * volumes + lamp * lampShare + (hasShadow ? .5 : 0);
    if (method == GaussLegendre) step += .6;
    if (p.noise != NoNoise) {
        const bool isInterpolated = method == Midpoint || method == Equiangular;
        const int every = isInterpolated ? p.noise_every : 1;
        step += method == SharedNoise ? .8 : 1.6 / every + (every > 1 ? .55 : 0);
    }
    return 5 + steps * step;
}

inline std::vector<brume::TrialOption> optionsOf(const Params& p, const brume::PlanInput& in,
                                                 double lampShare) {
    const bool hasShadow = p.shadow_strength > 0 && p.sun_intensity > 0 && shadowLight(in.scene.extras);
    std::vector<int> methods = {Midpoint, GaussLegendre};
    if (p.noise != NoNoise) methods.push_back(SharedNoise);
    if (lampShare > 0) methods.push_back(Equiangular);
    if (!in.chooses("method")) methods = {p.method};
    std::vector<int> numbers = {p.steps};
    if (in.chooses("steps")) numbers = brume::trialSteps(512);
    std::vector<brume::TrialOption> options;
    for (int method : methods) {
        int last = 0;
        for (int steps : numbers) {
            if (method == GaussLegendre && in.chooses("steps")) steps = (steps + 3) / 4 * 4;  // whole panels
            if (steps != last)
                options.push_back({method, steps, costOf(p, method, steps, lampShare, hasShadow)});
            last = steps;
        }
    }
    return options;
}

inline const char* nameOf(int method) {
    const char* names[] = {"left",         "midpoint", "gauss_legendre", "jittered", "equiangular",
                           "shared_noise", "p2"};
    return names[method];
}

// The method that tends to the truth.
constexpr int exactly = -1;

// A method of the march on rays.
inline brume::Trial::Fog fogOn(const Params& p, const brume::PlanInput& in,
                               const std::vector<brume::Probe>& rays) {
    auto march = std::make_shared<const RayMarch>(p, in, rays);
    return [&p, march](int tile, int method, int steps, brume::TrialOutcome& outcome) {
        Params tried = p;
        tried.method = method, tried.steps = steps;
        if (method == exactly) {
            tried.method = p.point_lights.empty() ? Midpoint : Equiangular;
            tried.noise_every = 1;
        }
        (*march)(tile, tried, outcome);
    };
}

// Methods against the truth on some rays.
class RayTrial {
  public:
    RayTrial(const Params& p, const brume::PlanInput& in, std::vector<brume::Probe> rays)
        : rays_(brume::Trial::filled(std::move(rays))),
          trial_(in, rays_, fogOn(p, in, rays_), exactly, 64, 4096) {}
    double error(int method, int steps, double enough) { return trial_.error(method, steps, enough); }
    double doubt() const { return trial_.doubt(); }

  private:
    std::vector<brume::Probe> rays_;
    brume::Trial trial_;
};

// What stopping early leaves out, as it shows: as much at any number of steps; on other rays a little more.
inline double stoppingError(const Params& p, const brume::PlanInput& in,
                            const std::vector<brume::Probe>& rays) {
    if (!p.early_stop) return 0;
    Params unstopped = p;
    unstopped.early_stop = false;
    const auto stopped = fogOn(p, in, rays), whole = fogOn(unstopped, in, rays);
    double most = 0;
    for (size_t first = 0; first < rays.size(); first += brume::trialWidth) {
        brume::TrialOutcome a, b;
        const int tile = int(first / brume::trialWidth);
        stopped(tile, Midpoint, 64, a), whole(tile, Midpoint, 64, b);
        for (int x = 0; x < brume::trialWidth; x++)
            most = brume::differenceAt(in, rays[first + size_t(x)], a, b, x, most);
    }
    return 1.25 * most;
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
        plan.predictedCost = costOf(p, P2, int(plan.chosen["steps"]), 1, true);
        plan.predictedError = 1;
        plan.why = "p2 is not the integral at any number of steps; 128 are the paper's own";
        return plan;
    }
    const auto few = Rays(p, in).all();
    // Some 57600 pixels, or all.
    const int apart = std::max(1, int(std::lround(std::sqrt(in.scene.size.area() / 57600.))));
    using Screen = brume::Screen<RayTrial>;
    auto trialOf = [&](std::vector<brume::Probe> rays) {
        return std::make_unique<RayTrial>(p, in, std::move(rays));
    };
    brume::TrialLevels<Screen> trials({{0, 20}, {apart, 1.25}}, [&](int each) {
        return std::make_unique<Screen>(
            in, each, exactly, each ? std::vector<brume::Probe>() : few, trialOf,
            [&](const std::vector<brume::Probe>& rays) { return fogOn(p, in, rays); });
    });
    auto errorOf = [&](const brume::TrialOption& option, double enough) {
        return trials.error(option, enough);
    };
    const auto options = optionsOf(p, in, RayMarch(p, in, few).lampShare());
    // No number of steps mends it: they have what it leaves, or half.
    const double stopping = stoppingError(p, in, few),
                 allowed = std::max(in.tolerance - stopping, in.tolerance / 2);
    const brume::TrialChoice best = brume::cheapest(options, allowed, in.chooses("steps"), errorOf);
    plan.chosen["method"] = best.option.method;
    plan.chosen["steps"] = best.option.steps;
    plan.predictedError = best.error + stopping;
    plan.predictedCost = best.option.cost;
    plan.why =
        brume::text(nameOf(best.option.method), " in ", best.option.steps,
                    !best.isUnseen ? " steps is the most exact, and may show"
                    : plan.predictedError > in.tolerance
                        ? " steps is the cheapest that does not show, but what stopping early leaves out may"
                        : " steps is the cheapest that does not show on the rays tried");
    return plan;
}

}  // namespace volume_fog
