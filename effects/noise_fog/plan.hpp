// What noise_fog can leave out, and which noise is cheapest.
#pragma once

#include <algorithm>
#include <cmath>

#include "effect/plugin.hpp"
#include "noise_fog/params.hpp"

namespace brume::noise_fog {

// Octaves whose cells span two pixels on the nearest surface; finer ones only alias. The angle of a pixel is
// not among the statistics; the spread of the rays' climb over the image's height bounds it.
inline int octavesSeen(const NoiseFog& p, const FrameStatistics& frame) {
    const double spread =
        std::asin(std::clamp(frame.maxRayUp, -1., 1.)) - std::asin(std::clamp(frame.minRayUp, -1., 1.));
    const double footprint = frame.minDistance * spread / std::max(1, frame.size.height);
    int octaves = 1;
    while (octaves < 5 && p.size * std::pow(.5, octaves) > 2 * footprint) octaves++;
    return octaves;
}

// Largest error of the baked noise, four deviations (MODELS.md §4: 12 % of the deviation at 4 texels a cell,
// falling with the square; a deviation of about .13).
inline double bakedError(const NoiseFog& p, int octaves) {
    double error = 0, total = 0;
    for (int octave = 0; octave < octaves; octave++) {
        const double texels = double(p.edge()) / p.tile / std::pow(2., octave);
        error += std::pow(.5, octave) * .13 * std::min(1., .12 * std::pow(4 / texels, 2));
        total += std::pow(.5, octave);
    }
    return 4 * error / total;
}

inline Plan plan(const NoiseFog& p, const PlanInput& in) {
    Plan plan;
    const int octaves = p.octaves > 0 ? p.octaves : octavesSeen(p, in.frame);
    plan.chosen["octaves"] = octaves;
    double airlight = 0;
    for (int n = 0; n < 3; n++)
        airlight = std::max(airlight, double(std::max(p.color[n], p.colorHigh[n])) + p.sunColor[n]);
    plan.maxOutput = std::max(in.maxInput, airlight);

    // Opacity swings by at most this over the noise's range (τ·exp(-τ) ≤ .37), and the picture with it.
    double most = std::max(p.low, p.high), least = std::min(p.low, p.high);
    if (p.mode == additive) most = 1 + p.strength, least = 1;
    if (p.mode == subtractive) most = 1, least = std::max(0.f, 1 - p.strength);
    if (p.mode == ocean) {
        const double dy = std::max(std::abs(in.frame.maxHeight - in.frame.eyeHeight),
                                   std::abs(in.frame.minHeight - in.frame.eyeHeight));
        most = dy * dy / 2 + .001, least = .001;
    }
    const double steepest = 12.92 * std::max(1., plan.maxOutput);  // of the sRGB curve
    const double swing = most > 0 ? .37 * (most - least) / std::max(least, .37 * most) : 0;
    const double error = bakedError(p, octaves) * std::min(1., swing) * steepest;
    // Measured on the CPU, in frame copies: an octave of noise, eight texels gathered, and the rest.
    const double octaveCost = 2.1, volumeCost = 3.1, rest = 2.5;
    const double samples = p.where == alongTheRay ? p.steps : 1;
    const bool needsVolume = p.smoothing > 0 && p.where == atTheSurface;
    const bool volumeServes = error <= in.tolerance && volumeCost < octaveCost * octaves;
    plan.chosen["method"] = needsVolume || volumeServes ? baked : procedural;
    plan.predictedCost =
        rest + samples * (plan.chosen["method"] == baked ? volumeCost : octaveCost * octaves);
    plan.predictedError = plan.chosen["method"] == baked && !needsVolume ? error : 0;
    plan.why = needsVolume    ? "baked: smoothed noise exists only as a volume"
               : volumeServes ? "baked: cheaper, and off by less than the tolerance"
                              : "procedural: a volume of this resolution would be off by more than the "
                                "tolerance, or costs more";

    if (p.where == asAProduct || in.frame.skyShare > 0 || in.transmittanceIsRead) return plan;
    const double x = std::max(0., in.frame.maxDistance - p.start);
    const double opacity = p.model == exponential
                               ? -std::expm1(-double(p.density) * x * most)
                               : most * std::pow(x / p.powerDistance, double(p.powerExponent));
    const double change = std::min(opacity, double(p.maxOpacity)) * steepest;
    if (change <= in.tolerance) {
        plan.skip = true;
        plan.predictedError = change;
        plan.predictedCost = 0;
        plan.maxOutput = in.maxInput;
        plan.why = "skipped: even the farthest surface at its densest changes by less than the tolerance";
    }
    return plan;
}

}  // namespace brume::noise_fog
