// The OpenGL functions that the recorder calls itself, from the program's libGL.
#pragma once

#include <GL/gl.h>
#include <GL/glext.h>

namespace capture {

/// dlsym of the C library, not of the hooks.
void* realDlsym(void* handle, const char* name);
/// The function as the program would have got it without the hooks, or null.
void* realFunction(const char* name);

template <class Function>
Function real(const char* name) {
    return reinterpret_cast<Function>(realFunction(name));
}

}  // namespace capture
