// What a plan decided, in words for people: apply --explain and the preview say the same.
#pragma once

#include <string>

#include "effect/chain.hpp"

namespace brume {

/// "method = box; steps = 12", choices by their labels; "skipped"; "as written" where nothing was to decide.
std::string choiceWords(const Chain& chain, const StepPlan& step);

/// "off by 0.04 of an 8-bit step (0.5 allowed), for the time of 3.1 frame copies", or "off by 16 8-bit
/// steps"; empty where nothing was predicted.
std::string predictionWords(const StepPlan& step);

}  // namespace brume
