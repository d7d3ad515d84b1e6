#include "gl/functions.hpp"

#include "error.hpp"

namespace brume {

GlFunctions loadGlFunctions(const std::function<GlProcAddress(const char*)>& getProcAddress) {
    GlFunctions gl;
    auto load = [&](auto& function, const char* name) {
        function = reinterpret_cast<std::decay_t<decltype(function)>>(getProcAddress(name));
        if (!function)
            failUsage("OpenGL: the driver has no ", name,
                      ": brume needs OpenGL 4.5 core; update the driver, or use --backend cpu");
    };
#define BRUME_GL_LOAD(name, upper) load(gl.name, "gl" #name);
    BRUME_GL_FUNCTIONS(BRUME_GL_LOAD)
#undef BRUME_GL_LOAD
    return gl;
}

}  // namespace brume
