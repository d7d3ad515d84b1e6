// What noise_fog can leave out, and which noise is cheapest.
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "effect/plugin.hpp"
#include "error.hpp"
#include "noise_fog/params.hpp"
#include "noise_fog/reference.hpp"

namespace brume::noise_fog {

// Octaves whose cells span two pixels on the nearest surface; finer ones only alias.
inline int octavesSeen(const NoiseFog& p, const FrameStatistics& frame) {
    const double footprint = frame.minDistance * frame.radiansPerPixel;
    int octaves = 1;
    while (octaves < 5 && p.size * std::pow(.5, octaves) > 2 * footprint) octaves++;
    return octaves;
}

// Largest error of the baked noise, four deviations (MODELS.md §4: 12 % of the deviation at 4 texels a cell,
// falling with the square; a deviation of about .13).
inline double bakedError(const NoiseFog& p) {
    double error = 0, total = 0;
    for (int octave = 0; octave < p.octaves; octave++) {
        const double texels = double(p.edge()) / p.tile / std::pow(2., octave);
        error += std::pow(.5, octave) * .13 * std::min(1., .12 * std::pow(4 / texels, 2));
        total += std::pow(.5, octave);
    }
    return 4 * error / total;
}

// The noise at the frame's probes, and what an error in it comes to.
class Trial {
  public:
    Trial(const NoiseFog& p, const PlanInput& in) : p_(p), in_(in) {
        // fp64 means of noise are dear: every fourth of the frame's probes, and the extremes, which come
        // first.
        for (size_t k = 0; k < in.frame.probes.size(); k++)
            if (k < 6 || k % 4 == 0) probes_.push_back(in.frame.probes[k]);
        const ReferenceNoise noise{p_, in.scene.camera.eye(), in.scene.time};
        truth_.resize(probes_.size());
        cv::parallel_for_({0, int(truth_.size())}, [&](const cv::Range& range) {
            for (int k = range.start; k < range.end; k++) {
                const Probe& probe = probes_[k];
                if (p_.where == atTheSurface) {
                    const bool isNoisy = probe.distance / p_.size <= 4096;
                    truth_[k] = isNoisy ? noise.smoothed(noise.cells(probe.direction * probe.distance)) : .5;
                } else {
                    truth_[k] = .5 + share(probe) * (noise.meanAlong(probe.direction, reach(probe)) - .5);
                }
            }
        });
    }

    /// As visible as noise that is off by `error` can be.
    double offBy(double error) const {
        double most = 0;
        for (size_t k = 0; k < truth_.size(); k++)
            for (double sign : {-1., 1.})
                most = std::max(most,
                                shows(probes_[k], truth_[k], std::clamp(truth_[k] + sign * error, 0., 1.)));
        return most;
    }
    /// Along the ray in so many steps; gives up where it exceeds `enough`.
    double inSteps(int steps, double enough) {
        NoiseFog marched = p_;
        marched.steps = steps;
        const ReferenceNoise noise{marched, in_.scene.camera.eye(), in_.scene.time};
        double most = 0;
        for (size_t n = 0; n < truth_.size() && most <= enough; n++) {
            const size_t k = (n + worst_) % truth_.size();
            const Probe& probe = probes_[k];
            const double mean = .5 + share(probe) * (noise.middleMean(probe.direction, reach(probe)) - .5);
            const double error = shows(probe, truth_[k], mean);
            if (error > most) most = error, worst_ = k;
        }
        return most;
    }

  private:
    NoiseFog p_;
    const PlanInput& in_;
    std::vector<Probe> probes_;
    std::vector<double> truth_;
    size_t worst_ = 0;  // the probe that the last method failed at: the next one starts there

    double reach(const Probe& probe) const { return std::min(probe.distance, double(p_.range)); }
    double share(const Probe& probe) const {
        return probe.distance > p_.range ? p_.range / probe.distance : 1;
    }

    double shows(const Probe& probe, double truth, double noise) const {
        const double dy = std::min(probe.distance, 1e15) * probe.direction[1];
        const cv::Vec3d sun(p_.sunDirection);
        const double cosine = cv::norm(sun) > 0 ? probe.direction.dot(sun) / cv::norm(sun) : 0;
        double most = 0;
        for (const cv::Vec3d& color : {probe.low, probe.high}) {
            const cv::Vec4f scene(cv::Vec4d(color[0], color[1], color[2], 1));
            const Outcome a =
                outcomeOf(p_, scene, probe.distance, relativeDensity(p_, truth, dy), truth, cosine);
            const Outcome b =
                outcomeOf(p_, scene, probe.distance, relativeDensity(p_, noise, dy), noise, cosine);
            for (int n = 0; n < 3; n++) most = std::max(most, in_.visible(a.color[n], b.color[n]));
        }
        return most;
    }
};

// Frame copies on the CPU at 1280×720 with two threads: of `samples` places of noise.
inline double costOf(const NoiseFog& p, int method, int samples) {
    if (p.where == asAProduct) return 6;
    return 2.5 + samples * (method == baked ? 3.1 : 2.1 * p.octaves);
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

// The fewest steps that do not show, by the probes; their predicted error.
inline int marchOf(const NoiseFog& p, const PlanInput& in, Trial& trial, double& error) {
    // A probe is one pixel of many: the worst of all is taken for twice the worst of the probes. Too few
    // steps may hit by luck, and the next number not: both have to.
    constexpr double margin = 2;
    if (!in.chooses("steps")) {
        error = margin * trial.inSteps(p.steps, HUGE_VAL);
        return p.steps;
    }
    constexpr int numbers[] = {1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56, 64};
    double before = HUGE_VAL;
    int fewest = numbers[0];
    for (int steps : numbers) {
        error = margin * trial.inSteps(steps, in.tolerance / margin);
        if (std::max(error, before) <= in.tolerance) {
            error = std::max(error, before);
            return fewest;
        }
        before = error, fewest = steps;
    }
    return fewest;
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
    plan.output = in.input.mixedWith(std::min(0., darkest), brightest);
    const bool needsVolume = p.smoothing > 0 && p.where == atTheSurface;
    plan.chosen["method"] = needsVolume ? baked : procedural;
    plan.chosen["steps"] = p.steps;
    if (isUnseen(p, in, darkest, brightest, plan)) return plan;
    plan.predictedError = 0;

    if (p.where == asAProduct) {
        plan.why = "one closed form, nothing cheaper";
    } else {
        p.method = in.chooses("method") ? int(plan.chosen["method"]) : p.method;
        Trial trial(p, in);
        const bool isMarch = p.where == alongTheRay;
        if (isMarch) plan.chosen["steps"] = p.steps = marchOf(p, in, trial, plan.predictedError);
        const int samples = isMarch ? p.steps : 1;
        const double texels = trial.offBy(bakedError(p));
        const bool isExact = plan.predictedError + texels <= in.tolerance;
        if (in.chooses("method") && isExact && costOf(p, baked, samples) < costOf(p, procedural, samples))
            plan.chosen["method"] = p.method = baked;
        if (p.method == baked) plan.predictedError += texels;
        // How far a smoothed volume is from smoothed noise has no bound here: nothing is promised.
        if (needsVolume) plan.predictedError = std::max(plan.predictedError, 2 * in.tolerance);
        plan.why = needsVolume ? "baked: smoothed noise exists only as a volume, whose error may show"
                   : p.method == procedural ? isExact ? "procedural: cheaper than a volume for so few octaves"
                                                      : "procedural: a volume of this resolution may show"
                   : isExact                ? "baked: cheaper, and off by less than the tolerance"
                                            : "baked: a volume of this resolution may show";
        if (isMarch)
            plan.why += plan.predictedError <= in.tolerance
                            ? text("; ", p.steps, " steps are the fewest that do not show")
                            : text("; ", p.steps, " steps may show");
    }
    plan.predictedCost = costOf(p, int(plan.chosen["method"]), p.where == alongTheRay ? p.steps : 1);
    return plan;
}

}  // namespace brume::noise_fog
