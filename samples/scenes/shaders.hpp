// The scenes' GLSL, from shaders/, complete with version and the defines that specialise it.
#pragma once

#include <string>

#include "scene.hpp"

namespace scenes {

struct ShaderPair {
    std::string vertex, fragment;
};

/// Texels along a side of the shadow map that covers the whole scene.
constexpr int wideShadowSize = 2048;

ShaderPair surfaceShader(const Scene& scene, Material material);
ShaderPair skyShader(const Scene& scene);
/// Depth alone, for the captured depth and the sun's map.
ShaderPair depthShader();

}  // namespace scenes
