// Runs a chain on the CPU; neighbouring pointwise effects share one pass over memory.
#pragma once

#include <memory>

#include "effect/runner.hpp"

namespace brume {

std::unique_ptr<Runner> makeCpuRunner();

}  // namespace brume
