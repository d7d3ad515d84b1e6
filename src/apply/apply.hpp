// From a captured frame to finished images: what the chain, the plan and the runners come to. Plans may have
// the CPU make what arrives at a step, so this lies above both.
#pragma once

#include <string>
#include <vector>

#include "effect/runner.hpp"

namespace brume {

/// Resolves every "auto" and drops what cannot be seen; `decisions` (may be null) gets one entry a step.
Chain planChain(const Chain& chain, const FramePair& frame, Backend backend,
                const std::vector<std::string>& keep, std::vector<StepPlan>* decisions = nullptr);

/// Everything from a captured frame to finished images: resolves depth, plans, runs, restores.
RunResult applyChain(Runner& runner, const Chain& chain, const FramePair& captured,
                     const std::vector<std::string>& keep = {}, std::vector<StepPlan>* decisions = nullptr);

/// The same for a frame made ready before (by the chain's own policy), so that several chains can share that.
RunResult applyChain(Runner& runner, const Chain& chain, const ReadyFrame& ready,
                     const std::vector<std::string>& keep = {}, std::vector<StepPlan>* decisions = nullptr);

}  // namespace brume
