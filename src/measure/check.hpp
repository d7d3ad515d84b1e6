// GLSL against CPU against reference, for any effect, on the same frames at default, extreme and random
// parameters.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "effect/runner.hpp"
#include "measure/compare.hpp"

namespace brume {

struct CheckFrame {
    std::string name;
    FramePair frame;
};
/// Random incl. HDR; 1×1, odd, narrow; every depth class; at most 64×48. Always the same.
std::vector<CheckFrame> checkFrames();

struct CheckOptions {
    uint32_t seed = 1;
    int randomSets = 4;
    std::string artefacts;  ///< folder for cpu.exr, gl.exr, difference.exr of failures; empty: none
    size_t referencePixels = 256;
};

struct CheckCase {
    std::string effect, frame, parameters;  ///< "default", "min", "max", "random 3", "method=recursive"
    Comparison parity;                      ///< GLSL against CPU; `compared` 0 where there is only one half
    Comparison reference;                   ///< CPU (or GLSL) against the reference
    std::string problem;  ///< NaN from finite input, not deterministic, wrong size, ...; empty: none
    bool passed() const { return parity.passed && reference.passed && problem.empty(); }
};

/// Checks one effect on both runners; `gl` may not be null. Calls `progress` after each case.
std::vector<CheckCase> checkEffect(const std::shared_ptr<const Effect>& effect, Runner& cpu, Runner& gl,
                                   const CheckOptions& options,
                                   const std::function<void(const CheckCase&)>& progress = {});

/// The parameter sets an effect is checked at: default, min, max, each choice of each VALUES parameter,
/// seeded random.
std::vector<std::pair<std::string, ParameterValues>> checkParameters(const EffectHeader& header,
                                                                     const CheckOptions& options);

}  // namespace brume
