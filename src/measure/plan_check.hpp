// Whether plans keep what they promise: the error they allow, measured against the fp64 reference, and the
// time of what they chose against that of every other method.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "effect/runner.hpp"

namespace brume {

/// One random parameter set of one effect.
struct PlanSet {
    int number = 0;
    Chain chain;         ///< CHART's BEFORE, then the effect with whatever may be "auto" so
    std::string effect;  ///< the last step's
    std::string values;  ///< of its parameters that differ from the default, JSON
};

/// Sets number `first` to `first + count - 1`, the effects in turn. A set depends only on its effect, its
/// number and the seed: pieces of a long run fit together. Numbers come from the ranges that user interfaces
/// offer, small ones as often as large where a range begins at 0; lists get up to three rows; choices are
/// even.
std::vector<PlanSet> planSets(const std::vector<std::shared_ptr<const Effect>>& effects, uint32_t seed,
                              int first, int count);

/// How large an error of the whole chain nobody sees (MODELS.md §9), after clipping and sRGB encoding.
inline constexpr double unseenError = 1. / 510;

struct PlanCheck {
    std::string effect, frame, values;
    int set = 0;
    std::string choice;  ///< "method = fir, tolerance = .002"; "skipped"
    bool isSkipped = false;
    double predicted = 0, measured = 0;  ///< errors, sRGB-encoded values of 0..1
    cv::Point worst;                     ///< the pixel where it was measured
    size_t compared = 0, leftOut = 0;
    std::string why;

    // Where methods were timed:
    bool isTimed = false;
    double planMs = 0;                ///< of planning the whole chain, once
    double chosenMs = 0, bestMs = 0;  ///< medians; the best of those whose measured error nobody sees
    std::string best;
    double ratio() const { return bestMs > 0 ? chosenMs / bestMs : 1; }
    /// The measured error is under the tolerance, or the plan said that it might not be.
    bool keptPromise() const { return measured <= unseenError || predicted > unseenError; }
};

/// A frame brought to another size by nearest pixels, its camera with it.
FramePair resizedFrame(const FramePair& frame, cv::Size size);

/// Plans and runs a set on the CPU, and compares at `pixels` pixels with the reference of the model as
/// stated. The frame's depth has been resolved. Throws Error where an effect has no reference.
PlanCheck checkPlan(Runner& cpu, const PlanSet& set, const FramePair& frame, size_t pixels);

/// The same, and times the choice against every method and knob of CHART that the plan may choose from. They
/// are tried on a small copy of the frame first: those that are slower there than the choice, or than the
/// fastest whose error nobody sees, are not timed further.
PlanCheck timePlan(Runner& cpu, const PlanSet& set, const FramePair& frame, size_t pixels);

}  // namespace brume
