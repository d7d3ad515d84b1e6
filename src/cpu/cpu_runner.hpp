// Runs a chain on the CPU; neighbouring pointwise effects share one pass over memory.
#pragma once

#include <memory>

#include "effect/runner.hpp"

namespace brume {

/// `guarded` is for checks: images that a plugin is to write start as NaN and lie between guard rows; run
/// throws Error (CheckFailed) naming the step that wrote outside its output.
std::unique_ptr<Runner> makeCpuRunner(bool guarded = false);

}  // namespace brume
