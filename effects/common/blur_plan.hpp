// Which way of blurring is the cheapest that nobody can tell from the truth on this frame (MODELS.md §9).
#pragma once

#include <algorithm>
#include <vector>

#include "common/blur_unseen.hpp"
#include "error.hpp"

namespace blur {

/// Whether the last would be chosen if it did not show: what a trial is for.
inline bool isCheapest(const std::vector<Choice>& choices) {
    return std::none_of(choices.begin(), choices.end() - 1, [&](const Choice& other) {
        return other.share >= 0 && other.share <= 1 && other.cost <= choices.back().cost;
    });
}

/// Fills choice, prediction and reason: the cheapest of `choices` whose error does not show, or else the most
/// exact. Where a tolerance was asked for, the cheapest that keeps it.
inline void choose(brume::Plan& plan, const brume::PlanInput& in, const Unseen& unseen,
                   const std::vector<Choice>& choices) {
    const bool isAsked = !in.chooses("tolerance");
    const Choice *best = nullptr, *safest = nullptr;
    double bestShare = 0, safestShare = HUGE_VAL;
    for (const Choice& choice : choices) {
        const bool isKept = isAsked && choice.error <= 1.001 * choice.tolerance + 1e-6;
        const double share = choice.share >= 0 ? choice.share : unseen.share(choice);
        if (!safest || share < safestShare) safest = &choice, safestShare = share;
        if ((isKept || share <= 1) && (!best || choice.cost < best->cost)) best = &choice, bestShare = share;
    }
    const char* why = !best            ? " is the most exact; its error, "
                      : bestShare <= 1 ? " is the cheapest whose error, "
                                       : " is the cheapest that keeps the tolerance asked for; its error, ";
    if (!best) best = safest, bestShare = safestShare;
    plan.chosen["method"] = best->method;
    plan.chosen["tolerance"] = best->tolerance;
    plan.predictedError = bestShare * in.tolerance;
    plan.predictedCost = best->cost;
    plan.why = brume::text(best->name, why, best->error, " of the kernel, ",
                           bestShare <= 1 ? "does not show among this frame's lights"
                                          : "may show beside this frame's brightest lights");
}

}  // namespace blur
