// A list parameter's rows in the layout that GLSL's std430 gives the struct of its fields.
#pragma once

#include <cstddef>
#include <vector>

#include "effect/parameter.hpp"

namespace brume {

struct RowLayout {
    std::vector<size_t> offsets;  ///< bytes, one a field
    size_t stride = 0;            ///< bytes from row to row
};

RowLayout rowLayout(const std::vector<Parameter>& fields);

/// The rows packed; never empty, since OpenGL has no buffer of no bytes.
std::vector<std::byte> packRows(const Parameter& list, const ParameterValue& value);

/// GLSL's name of a parameter's type: "float", "vec4", ...
const char* glslType(ParameterType type);

}  // namespace brume
