// The ways to a context without a window; GlContext::create chooses among them.
#pragma once

#include <memory>

#include "gl/context.hpp"

namespace brume {

/// Mesa's off-screen software renderer. Throws Error (Usage).
std::unique_ptr<GlContext> makeOsmesaContext();

/// EGL without a surface: each GPU's device, then Mesa's surfaceless platform, then software devices; the
/// first that gives OpenGL 4.5 core. Throws Error (Usage) with what each answered.
std::unique_ptr<GlContext> makeEglContext();

}  // namespace brume
