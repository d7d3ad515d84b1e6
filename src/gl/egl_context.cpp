#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <string_view>
#include <vector>

#include "error.hpp"
#include "gl/functions.hpp"
#include "gl/platforms.hpp"

namespace brume {

namespace {

bool listed(const char* extensions, std::string_view wanted) {
    for (std::string_view rest = extensions ? extensions : ""; !rest.empty();) {
        const size_t end = std::min(rest.find(' '), rest.size());
        if (rest.substr(0, end) == wanted) return true;
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return false;
}

std::string eglError() { return text("EGL error 0x", std::hex, eglGetError()); }

struct Candidate {
    std::string name;
    EGLDisplay display;
};

// GPUs first, so that a machine with one uses it.
std::vector<Candidate> displays() {
    const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    auto getPlatformDisplay =
        reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
    auto queryDevices = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
    auto queryDevice =
        reinterpret_cast<PFNEGLQUERYDEVICESTRINGEXTPROC>(eglGetProcAddress("eglQueryDeviceStringEXT"));
    std::vector<Candidate> found, software;
    if (getPlatformDisplay && queryDevices && queryDevice && listed(client, "EGL_EXT_platform_device")) {
        EGLDeviceEXT devices[16];
        EGLint count = 0;
        if (!queryDevices(16, devices, &count)) count = 0;
        for (EGLint k = 0; k < count; k++) {
            const bool isSoftware =
                listed(queryDevice(devices[k], EGL_EXTENSIONS), "EGL_MESA_device_software");
            (isSoftware ? software : found)
                .push_back({text("EGL device ", k),
                            getPlatformDisplay(EGL_PLATFORM_DEVICE_EXT, devices[k], nullptr)});
        }
    }
    if (getPlatformDisplay && listed(client, "EGL_MESA_platform_surfaceless"))
        found.push_back({"EGL surfaceless",
                         getPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr)});
    found.insert(found.end(), software.begin(), software.end());
    return found;
}

class EglContext final : public GlContext {
  public:
    explicit EglContext(const Candidate& candidate) : platform_(candidate.name), display_(candidate.display) {
        // A display is never terminated: other contexts of this process may share it.
        if (display_ == EGL_NO_DISPLAY || !eglInitialize(display_, nullptr, nullptr))
            failUsage(platform_, ": cannot be opened (", eglError(), ")");
        if (!listed(eglQueryString(display_, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context"))
            failUsage(platform_, ": cannot work without a window");
        if (!eglBindAPI(EGL_OPENGL_API)) failUsage(platform_, ": offers OpenGL ES only");
        const EGLint wanted[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0, EGL_NONE};
        EGLConfig config = nullptr;
        EGLint count = 0;
        if (!eglChooseConfig(display_, wanted, &config, 1, &count) || count == 0)
            failUsage(platform_, ": has no OpenGL configuration");
        const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION,
                                     4,
                                     EGL_CONTEXT_MINOR_VERSION,
                                     5,
                                     EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                     EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                     EGL_NONE};
        context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, attributes);
        if (context_ == EGL_NO_CONTEXT)
            failUsage(platform_, ": no OpenGL 4.5 core context (", eglError(), ")");
        try {
            if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
                failUsage(platform_, ": the context could not be made current (", eglError(), ")");
            functions_ = loadGlFunctions(eglGetProcAddress);
        } catch (...) {
            eglDestroyContext(display_, context_);
            throw;
        }
    }
    ~EglContext() override {
        if (eglGetCurrentContext() == context_)
            eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        eglDestroyContext(display_, context_);
        eglReleaseThread();
    }
    EglContext(const EglContext&) = delete;
    EglContext& operator=(const EglContext&) = delete;

    const GlFunctions& functions() const override { return functions_; }
    std::string platform() const override { return platform_; }

  private:
    std::string platform_;
    EGLDisplay display_;
    EGLContext context_ = EGL_NO_CONTEXT;
    GlFunctions functions_;
};

}  // namespace

std::unique_ptr<GlContext> makeEglContext() {
    std::string problems;
    for (const Candidate& candidate : displays()) try {
            return std::make_unique<EglContext>(candidate);
        } catch (const Error& e) {
            problems += text(problems.empty() ? "" : "; ", e.what());
        }
    failUsage("EGL: no way to OpenGL 4.5 core without a window (",
              problems.empty() ? "neither devices nor Mesa's surfaceless platform" : problems,
              "); install the GPU's driver or libegl1 with libgl1-mesa-dri, or use --backend cpu");
}

}  // namespace brume
