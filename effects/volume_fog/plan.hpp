// What this frame needs of volume_fog (MODELS.md §9): methods and step counts are tried in fp64 on some of
// its rays.
#pragma once

#include <cmath>
#include <map>
#include <opencv2/core/utility.hpp>

#include "effect/plan.hpp"
#include "error.hpp"
#include "volume_fog/integral.hpp"
#include "volume_fog/replay.hpp"
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

// Rays of the frame with their true integrals.
class Trial {
  public:
    Trial(const Params& p, const brume::PlanInput& in) : p_(p), in_(in) {
        context_.camera = in.scene.camera;
        context_.frameSize = in.scene.frameSize;
        context_.time = in.scene.time;
        context_.extras = in.scene.extras;
        for (const auto& [name, image] : in.captured) context_.images[name] = image;
        places_ = in.frame.probes;
        addLamps();
        truth_.resize(places_.size());
        const truth::Scene scene(p_, context_);
        cv::parallel_for_({0, int(places_.size())}, [&](const cv::Range& range) {
            for (int k = range.start; k < range.end; k++) {
                const truth::Ray ray = rayOf(scene, places_[k]);
                truth_[k] = truth::Integrator(ray).over(truth::breaks(ray));
            }
        });
    }

    /// True where a ray passes through the range of a lamp.
    bool meetsLamps() const {
        const truth::Scene scene(p_, context_);
        for (const brume::Probe& place : places_) {
            const truth::Ray ray = rayOf(scene, place);
            for (const PointLight& lamp : p_.point_lights) {
                const auto [enter, leave] = ray.inRange(lamp);
                if (lamp.intensity > 0 && leave > std::max(enter, 0.) && enter < ray.far) return true;
            }
        }
        return false;
    }
    /// The worst visible error of a method; gives up where it exceeds `enough`.
    double error(int method, int steps, double enough) {
        Params p = p_;
        p.method = method;
        p.steps = steps;
        const truth::Scene scene(p, context_);
        double most = 0;
        for (size_t n = 0; n < places_.size() && most <= enough; n++) {
            const size_t k = (n + worst_) % places_.size();
            const brume::Probe& place = places_[k];
            const truth::Ray ray = rayOf(scene, place);
            const double transmittance = std::exp(-truth_[k].depth);
            double error = 0;
            for (const cv::Vec3d& color : {place.low, place.high}) {
                const cv::Vec4f arriving(cv::Vec4d(color[0], color[1], color[2], 1));
                const truth::Replayed got =
                    truth::Replay(ray, arriving, place.pixel, in_.scene.frameIndex, in_.scene.seed).run();
                for (int c = 0; c < 3; c++)
                    error = std::max(error, in_.visible(color[c] * transmittance + truth_[k].scattered[c],
                                                        color[c] * got.transmittance + got.scattered[c]));
            }
            if (error > most) most = error, worst_ = k;
        }
        return most;
    }

  private:
    Params p_;
    const brume::PlanInput& in_;
    brume::ReferenceContext context_;
    std::vector<brume::Probe> places_;
    std::vector<truth::Integral> truth_;
    size_t worst_ = 0;  // the ray that the last method failed at: the next one starts there

    truth::Ray rayOf(const truth::Scene& scene, const brume::Probe& place) const {
        return {scene, place.direction, std::min(place.distance, double(p_.max_distance))};
    }
    // Rays that pass lamps at some px, as far as anything is: there steps count most.
    void addLamps() {
        const auto& camera = in_.scene.camera;
        const double farthest = in_.frame.skyShare > 0 ? HUGE_VAL : in_.frame.maxDistance;
        for (const PointLight& lamp : p_.point_lights) {
            const cv::Vec3d way = cv::Vec3d(lamp.position) - camera.eye();
            const auto& m = camera.worldFromCamera;
            cv::Vec3d v;  // as the camera sees it
            for (int n = 0; n < 3; n++) v[n] = m(0, n) * way[0] + m(1, n) * way[1] + m(2, n) * way[2];
            if (!(v[2] < 0)) continue;
            const double x = camera.cx - camera.fx * v[0] / v[2], y = camera.cy + camera.fy * v[1] / v[2];
            for (double beside : {.5, 3., 12., 40.}) {
                brume::Probe place;
                place.pixel = {int(x + beside), int(y)};
                if (!cv::Rect({}, in_.scene.size).contains(place.pixel)) continue;
                const cv::Vec3d ray = camera.ray(place.pixel.x, place.pixel.y);
                for (int n = 0; n < 3; n++)
                    place.direction[n] =
                        (m(n, 0) * ray[0] + m(n, 1) * ray[1] + m(n, 2) * ray[2]) / cv::norm(ray);
                place.distance = farthest;
                place.low = place.high =
                    cv::Vec3d::all(std::clamp(0., in_.input.low, std::max(in_.input.low, 0.)));
                places_.push_back(place);
            }
        }
    }
};

// Frame copies on the CPU at 1280×720 with two threads.
inline double costOf(const Params& p, int method, int steps) {
    const double volumes = double(p.density > 0) + double(p.boxes.size());
    double step = .3 + .3 * volumes + .5 * double(p.point_lights.size());
    if (method == Equiangular) step += .5 * double(p.point_lights.size());
    if (p.noise != NoNoise) step += method == SharedNoise ? .5 : 1.;
    return 3 + steps * step;
}

struct Option {
    int method, steps;
    double cost;
};
inline std::vector<Option> optionsOf(const Params& p, const brume::PlanInput& in, bool meetsLamps) {
    std::vector<int> methods = {Midpoint, GaussLegendre};
    if (p.noise != NoNoise) methods.push_back(SharedNoise);
    // A lamp's glow may be narrower than the gaps between the rays tried; equal steps miss it there.
    if (meetsLamps) methods = {Equiangular};
    if (!in.chooses("method")) methods = {p.method};
    std::vector<Option> options;
    for (int method : methods)
        for (int steps : {4,  6,  8,  10,  12,  16,  20,  24,  28,  32,  40,  48,  56,
                          64, 80, 96, 112, 128, 160, 192, 224, 256, 320, 384, 448, 512}) {
            if (!in.chooses("steps")) steps = p.steps;
            if (method == GaussLegendre && in.chooses("steps") && steps % 4) continue;  // whole panels
            options.push_back({method, steps, costOf(p, method, steps)});
            if (!in.chooses("steps")) break;
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
        plan.predictedCost = costOf(p, P2, int(plan.chosen["steps"]));
        plan.predictedError = 1;
        plan.why = "p2 is not the integral at any number of steps; 128 are the paper's own";
        return plan;
    }
    // A ray is one of many: the worst of all is taken for three times the worst of those tried. Too few steps
    // may hit by luck, and the next number not: both have to.
    auto marginOf = [](int method) { return method == SharedNoise ? 5. : 3.; };
    Trial trial(p, in);
    const std::vector<Option> options = optionsOf(p, in, trial.meetsLamps());
    Option best{};
    double error = HUGE_VAL;
    std::map<int, std::pair<Option, double>>
        before;  // by method: the option tried last, where it did not show
    for (const Option& option : options) {
        const double margin = marginOf(option.method);
        const double own = margin * trial.error(option.method, option.steps, in.tolerance / margin);
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
            const double own = margin * trial.error(option.method, option.steps, error / margin);
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
