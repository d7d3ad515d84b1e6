// GLSL against CPU against reference, for any effect, on the same frames at default, extreme and random
// parameters.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "effect/runner.hpp"
#include "measure/compare.hpp"

namespace brume {

struct CheckFrame {
    std::string name;
    FramePair frame;          ///< depth without NaN, as effects get it
    bool finiteColor = true;  ///< no NaN or infinite colour: no output may be NaN
};
/// Random incl. HDR; 1×1, rows, columns, odd, narrow; every depth class; silhouettes; greys at thresholds;
/// several cameras; at most 64×48. Always the same.
std::vector<CheckFrame> checkFrames();

struct CheckOptions {
    uint32_t seed = 1;
    int randomSets = 4;
    std::string artefacts;         ///< folder for cpu.exr, gl.exr, difference.exr of failures; empty: none
    size_t referencePixels = 256;  ///< a frame, besides those where GLSL and CPU differ
};

/// The pixel where a comparison came closest to its bound, or passed it.
struct WorstPixel {
    std::string image = "color";  ///< or "transmittance"
    cv::Point place;
    int channel = 0;
    std::optional<double> gl, cpu, reference;  ///< those that exist
};

struct CheckCase {
    std::string effect, frame, parameters;  ///< "default", "min", "max", "random 3", "method=recursive"
    Comparison parity;                      ///< GLSL against CPU; `compared` 0 where there is only one half
    Comparison reference;                   ///< CPU (or GLSL) against the reference
    WorstPixel parityWorst, referenceWorst;
    std::string problem;    ///< NaN from finite input, not deterministic, wrong size, ...; empty: none
    std::string artefacts;  ///< folder where this failure's images are, or empty
    bool passed() const { return parity.passed && reference.passed && problem.empty(); }
};

/// The largest share of an effect's pixels that may be left out because a comparison within a few ulp decides
/// them: of all pixels between the halves, and of those spread evenly that the reference is asked about.
inline constexpr double maxAmbiguousShare = 1e-3;

/// Checks one effect on both runners: one case a frame and parameter set, and one named "all frames" if too
/// many pixels were ambiguous. Calls `progress` after each case. Deterministic. Errors of the effect (a
/// shader that does not compile, a plugin that throws) become a case's `problem`.
std::vector<CheckCase> checkEffect(const std::shared_ptr<const Effect>& effect, Runner& cpu, Runner& gl,
                                   const CheckOptions& options,
                                   const std::function<void(const CheckCase&)>& progress = {});

/// The parameter sets an effect is checked at: default, min, max, each choice of each VALUES parameter and
/// each bool (others at their default, and others random), each list full, seeded random. "auto" is never
/// among the values. Choices change one at a time, so that few shaders are compiled.
std::vector<std::pair<std::string, ParameterValues>> checkParameters(const EffectHeader& header,
                                                                     const CheckOptions& options);

}  // namespace brume
