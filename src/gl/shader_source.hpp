// The text around an effect's own GLSL: what brume declares for it. One file a convention.
#pragma once

#include <string>
#include <vector>

#include "effect/chain.hpp"
#include "gl/program.hpp"

namespace brume {

/// The stages of one pass of a step. `transmittance`: the running transmittance is read by someone. Throws
/// Error (Usage) from expanding includes.
std::vector<ShaderText> passSource(const Step& step, size_t pass, bool transmittance);

/// The binding points of std430 buffers: list parameters, then DERIVED arrays, in the header's order.
std::vector<std::string> storageBuffers(const EffectHeader& header);

// passSource for effects of brume's own kind, and for foreign ISF files.
std::vector<ShaderText> linearPassSource(const Step& step, size_t pass, bool transmittance);
std::vector<ShaderText> isfPassSource(const Step& step, size_t pass);

}  // namespace brume
