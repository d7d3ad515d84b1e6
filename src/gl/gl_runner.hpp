// Runs a chain in GLSL.
#pragma once

#include <memory>

#include "effect/runner.hpp"
#include "gl/context.hpp"

namespace brume {

/// A runner on a context thread of its own.
std::unique_ptr<Runner> makeGlRunner(GlPlatform platform = GlPlatform::Auto);
/// Shares a context's thread with others.
std::unique_ptr<Runner> makeGlRunner(std::shared_ptr<GlThread> thread);

/// The complete source of one pass as the compiler gets it, for --dump-shader.
std::string shaderSource(const Step& step, size_t pass);

}  // namespace brume
