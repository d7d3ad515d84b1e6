// Which method this frame needs (MODELS.md §9).
#pragma once

#include <algorithm>
#include <cmath>

#include "common/blur_plan.hpp"
#include "error.hpp"
#include "fog_blur/trial.hpp"

namespace fog_blur {

inline std::string nameOf(const FogBlur& p) {
    return p.method == gatherMethod ? "gather" : brume::text("a ladder of ", p.rungs, " to the octave");
}

// Frame copies on the CPU; what rungs add is an estimate.
inline double costOf(const FogBlur& p, double largest) {
    const double across = 8 * largest + 1;
    if (p.method == gatherMethod) return 4 + .25 * across * across;
    return (8 + 1.4 * std::log2(std::max(1.f, p.radius))) * std::pow(p.rungs, .68);
}

// How a method's error likely shows, by what is known of the frame's lights. Pixels have blurs of every size
// up to the largest. These shares of the bound are estimates: with the ladder everywhere, 1800 random fogs
// over captured frames came to .34 of it at most where edges are kept (and what is left of the weight divides
// the error), to .08 where they bleed.
inline double estimateOf(const FogBlur& p, const brume::PlanInput& in) {
    const double largest = largestOf(p, in.scene);
    const double likely = p.method == gatherMethod ? blur::likelihood : p.edges == keep ? .4 : .1;
    double unseen = HUGE_VAL;
    for (double deviation : {largest, .5 * largest, .25 * largest, std::min(largest, 1.)})
        unseen = std::min(
            unseen, blur::likelihood * blur::Unseen(in, {deviation, 5, blur::gaussianDensity}).error(4));
    return likely * statedError(p) / std::max(unseen, 1e-30) * in.tolerance;
}

// The coarsest ladder whose error does not show where it is tried; or else gather, or what shows least.
inline void choose(FogBlur& p, brume::Plan& plan, const brume::PlanInput& in, bool isMethodFree,
                   bool areRungsFree) {
    // Pixels that were not tried may be worse than those that were.
    constexpr double margin = 1.1;
    LadderTrial trial(p, in);
    if (!trial.isPossible()) {
        if (areRungsFree) p.rungs = isMethodFree ? 1 : mostRungs;
        if (isMethodFree) p.method = gatherMethod;
        plan.predictedError = estimateOf(p, in);
        plan.why = brume::text(nameOf(p),
                               ": coarser, faster ladders might show beside this frame's brightest lights");
        return;
    }
    plan.takesWhatIsLeft = true;
    auto isEnough = [&](double error) {
        plan.predictedError = margin * error;
        return plan.predictedError <= in.toleranceLeft;
    };
    for (;; p.rungs *= 2) {
        const double error = trial.errorOf(p.rungs);
        if (isEnough(error)) {
            plan.why = brume::text(nameOf(p), " is the cheapest that does not show where it was tried");
            return;
        }
        if (p.rungs < mostRungs && areRungsFree) continue;
        plan.why = "no ladder, which are much faster, is unseen where they were tried";
        if (!isMethodFree) return;
        if (const double least = trial.gatherError(); least < error || isEnough(least)) {
            isEnough(least);
            p.method = gatherMethod;
            if (areRungsFree) p.rungs = 1;
        }
        return;
    }
}

inline brume::Plan plan(const FogBlur& asked, const brume::PlanInput& in) {
    FogBlur p = asked;
    brume::Plan plan;
    plan.output = brume::ImageBounds::anywhere(in.input.low, in.input.high);
    if (p.radius == 0) {
        plan.skip = true;
        plan.why = "a radius of 0 changes nothing";
        return plan;
    }
    const bool isMethodFree = in.chooses("method"), areRungsFree = in.chooses("rungs");
    if (isMethodFree) p.method = ladderMethod;
    if (areRungsFree) p.rungs = 1;
    plan.predictedError = estimateOf(p, in);
    plan.why = brume::text(nameOf(p), ", as asked");
    if (p.method == ladderMethod && (isMethodFree || areRungsFree)) {
        plan.why = brume::text(
            nameOf(p), ": by an estimate (no bound), its error does not show among this frame's lights");
        if (plan.predictedError > in.tolerance) choose(p, plan, in, isMethodFree, areRungsFree);
    }
    plan.chosen["method"] = p.method;
    plan.chosen["rungs"] = p.rungs;
    plan.predictedCost = costOf(p, largestOf(p, in.scene));
    return plan;
}

}  // namespace fog_blur
