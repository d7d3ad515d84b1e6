// Evaluates GLSL functions over millions of inputs in a compute shader, to test twins against each other.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "gl/context.hpp"

namespace brume {

/// Runs `body` once an input: it sees `vec4 in0, in1` and sets `vec4 result`. `functions` is GLSL placed
/// before main (e.g. the text of an include). inputs0/inputs1/result: 4 floats each an item; inputs1 may be
/// empty.
std::vector<float> probeGlsl(GlThread& gl, const std::string& functions, const std::string& body,
                             std::span<const float> inputs0, std::span<const float> inputs1 = {});

}  // namespace brume
