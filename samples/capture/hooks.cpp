// The functions that stand in front of the program's own. Programs reach OpenGL by linking it, by dlsym (SDL,
// GLFW, most games) or by glXGetProcAddress and its kin; all three lead here.
#include <dlfcn.h>

#include <cstring>

#include "real_gl.hpp"
#include "recorder.hpp"

#define HOOK extern "C" __attribute__((visibility("default")))

using capture::real;
using capture::Recorder;

namespace capture {

void* realDlsym(void* handle, const char* name) {
    using Dlsym = void* (*)(void*, const char*);
    static const Dlsym found = [] {
        void* symbol = nullptr;
        for (const char* version : {"GLIBC_2.34", "GLIBC_2.2.5", "GLIBC_2.17"})
            if (!symbol) symbol = dlvsym(RTLD_NEXT, "dlsym", version);
        return reinterpret_cast<Dlsym>(symbol);
    }();
    return found(handle, name);
}

void* realFunction(const char* name) {
    if (void* next = realDlsym(RTLD_NEXT, name)) return next;
    // A program may have opened its libGL privately; the same file opened again is the same library.
    for (const char* file : {"libGL.so.1", "libEGL.so.1", "libOpenGL.so.0"}) {
        static void* libraries[3] = {};
        void*& library = libraries[file[3] == 'G' ? 0 : file[3] == 'E' ? 1 : 2];
        if (!library) library = dlopen(file, RTLD_LAZY | RTLD_LOCAL);
        if (void* symbol = library ? realDlsym(library, name) : nullptr) return symbol;
    }
    using GetProcAddress = void* (*)(const char*);
    for (const char* getter : {"glXGetProcAddressARB", "eglGetProcAddress"}) {
        void* symbol = realDlsym(RTLD_NEXT, getter);
        if (void* found = symbol ? reinterpret_cast<GetProcAddress>(symbol)(name) : nullptr) return found;
    }
    return nullptr;
}

namespace {

// After the fixed-function projection changed.
void lookAtProjection() {
    static const auto getInteger = real<void (*)(GLenum, GLint*)>("glGetIntegerv");
    static const auto getFloat = real<void (*)(GLenum, GLfloat*)>("glGetFloatv");
    GLint mode = 0;
    getInteger(GL_MATRIX_MODE, &mode);
    if (mode != GL_PROJECTION) return;
    GLfloat matrix[16];
    getFloat(GL_PROJECTION_MATRIX, matrix);
    Recorder::instance().sawProjection(matrix);
}

void lookAtUniforms(GLsizei count, GLboolean transpose, const GLfloat* values) {
    for (GLsizei k = 0; k < count && k < 4; k++) {
        const GLfloat* m = values + 16 * k;
        GLfloat turned[16];
        if (transpose) {
            for (int i = 0; i < 16; i++) turned[i] = m[i % 4 * 4 + i / 4];
            m = turned;
        }
        if (m[3] != 0 || m[7] != 0 || m[11] != 0) Recorder::instance().sawUniform(m);
    }
}

}  // namespace
}  // namespace capture

HOOK void glXSwapBuffers(void* display, unsigned long drawable) {
    static const auto next = real<void (*)(void*, unsigned long)>("glXSwapBuffers");
    Recorder::instance().endFrame();
    next(display, drawable);
}

HOOK unsigned eglSwapBuffers(void* display, void* surface) {
    static const auto next = real<unsigned (*)(void*, void*)>("eglSwapBuffers");
    Recorder::instance().endFrame();
    return next(display, surface);
}

#define PROJECTION_HOOK(name, parameters, arguments)              \
    HOOK void name parameters {                                   \
        static const auto next = real<void(*) parameters>(#name); \
        next arguments;                                           \
        capture::lookAtProjection();                              \
    }

PROJECTION_HOOK(glFrustum, (GLdouble a, GLdouble b, GLdouble c, GLdouble d, GLdouble e, GLdouble f),
                (a, b, c, d, e, f))
PROJECTION_HOOK(glOrtho, (GLdouble a, GLdouble b, GLdouble c, GLdouble d, GLdouble e, GLdouble f),
                (a, b, c, d, e, f))
PROJECTION_HOOK(glLoadMatrixf, (const GLfloat* m), (m))
PROJECTION_HOOK(glLoadMatrixd, (const GLdouble* m), (m))
PROJECTION_HOOK(glMultMatrixf, (const GLfloat* m), (m))
PROJECTION_HOOK(glMultMatrixd, (const GLdouble* m), (m))
PROJECTION_HOOK(glLoadTransposeMatrixf, (const GLfloat* m), (m))
PROJECTION_HOOK(glPopMatrix, (), ())

#define PLACE_HOOK(name, parameters, arguments)                   \
    HOOK void name parameters {                                   \
        static const auto next = real<void(*) parameters>(#name); \
        next arguments;                                           \
        Recorder::instance().sawPlace();                          \
    }

PLACE_HOOK(glBindFramebuffer, (GLenum target, GLuint framebuffer), (target, framebuffer))
PLACE_HOOK(glBindFramebufferEXT, (GLenum target, GLuint framebuffer), (target, framebuffer))
PLACE_HOOK(glViewport, (GLint x, GLint y, GLsizei width, GLsizei height), (x, y, width, height))

HOOK void glUniformMatrix4fv(GLint location, GLsizei count, GLboolean transpose, const GLfloat* values) {
    static const auto next = real<PFNGLUNIFORMMATRIX4FVPROC>("glUniformMatrix4fv");
    next(location, count, transpose, values);
    capture::lookAtUniforms(count, transpose, values);
}

HOOK void glProgramUniformMatrix4fv(GLuint program, GLint location, GLsizei count, GLboolean transpose,
                                    const GLfloat* values) {
    static const auto next = real<PFNGLPROGRAMUNIFORMMATRIX4FVPROC>("glProgramUniformMatrix4fv");
    next(program, location, count, transpose, values);
    capture::lookAtUniforms(count, transpose, values);
}

namespace {

void* hookNamed(const char* name) {
    static const struct {
        const char* name;
        void* function;
    } hooks[] = {
#define ENTRY(function) {#function, reinterpret_cast<void*>(function)}
        ENTRY(glXSwapBuffers),    ENTRY(eglSwapBuffers),       ENTRY(glFrustum),
        ENTRY(glOrtho),           ENTRY(glLoadMatrixf),        ENTRY(glLoadMatrixd),
        ENTRY(glMultMatrixf),     ENTRY(glMultMatrixd),        ENTRY(glLoadTransposeMatrixf),
        ENTRY(glBindFramebuffer), ENTRY(glBindFramebufferEXT), ENTRY(glViewport),
        ENTRY(glPopMatrix),       ENTRY(glUniformMatrix4fv),   ENTRY(glProgramUniformMatrix4fv),
#undef ENTRY
    };
    for (const auto& hook : hooks)
        if (std::strcmp(hook.name, name) == 0) return hook.function;
    return nullptr;
}

void* throughGetter(const char* getter, const char* name) {
    if (void* hook = hookNamed(name)) return hook;
    using GetProcAddress = void* (*)(const char*);
    const auto next = real<GetProcAddress>(getter);
    return next ? next(name) : nullptr;
}

}  // namespace

HOOK void* glXGetProcAddress(const char* name) { return throughGetter("glXGetProcAddress", name); }
HOOK void* glXGetProcAddressARB(const char* name) { return throughGetter("glXGetProcAddressARB", name); }
HOOK void* eglGetProcAddress(const char* name) { return throughGetter("eglGetProcAddress", name); }

HOOK void* dlsym(void* handle, const char* name) {
    if (name[0] == 'g' || name[0] == 'e') {
        // Only where the library has the function: programs ask in order to find out.
        if (void* hook = hookNamed(name); hook && capture::realDlsym(handle, name)) return hook;
        for (const char* getter : {"glXGetProcAddress", "glXGetProcAddressARB", "eglGetProcAddress"})
            if (std::strcmp(name, getter) == 0 && capture::realDlsym(handle, name))
                return reinterpret_cast<void*>(getter[0] == 'e'            ? eglGetProcAddress
                                               : std::strlen(getter) == 17 ? glXGetProcAddress
                                                                           : glXGetProcAddressARB);
    }
    return capture::realDlsym(handle, name);
}
