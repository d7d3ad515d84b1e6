#include <array>

#include "error.hpp"
#include "gl/functions.hpp"
#include "gl/platforms.hpp"

// After glcorearb.h: osmesa.h brings gl.h, which would keep it from declaring the function types.
#include <GL/osmesa.h>

namespace brume {

namespace {

class OsmesaContext final : public GlContext {
  public:
    OsmesaContext() {
        const int attributes[] = {OSMESA_FORMAT,
                                  OSMESA_RGBA,
                                  OSMESA_PROFILE,
                                  OSMESA_CORE_PROFILE,
                                  OSMESA_CONTEXT_MAJOR_VERSION,
                                  4,
                                  OSMESA_CONTEXT_MINOR_VERSION,
                                  5,
                                  0,
                                  0};
        context_ = OSMesaCreateContextAttribs(attributes, nullptr);
        if (!context_)
            failUsage(
                "OSMesa: no OpenGL 4.5 core context; install Mesa 20 or newer (libosmesa6), use EGL, or ",
                "use --backend cpu");
        try {
            if (!OSMesaMakeCurrent(context_, framebuffer_.data(), GL_UNSIGNED_BYTE, 1, 1))
                failUsage("OSMesa: the context could not be made current; is another one current here?");
            functions_ = loadGlFunctions([](const char* name) { return OSMesaGetProcAddress(name); });
        } catch (...) {
            OSMesaDestroyContext(context_);
            throw;
        }
    }
    ~OsmesaContext() override {
        if (OSMesaGetCurrentContext() == context_) OSMesaMakeCurrent(nullptr, nullptr, 0, 0, 0);
        OSMesaDestroyContext(context_);
    }
    OsmesaContext(const OsmesaContext&) = delete;
    OsmesaContext& operator=(const OsmesaContext&) = delete;

    const GlFunctions& functions() const override { return functions_; }
    std::string platform() const override { return "OSMesa"; }

  private:
    OSMesaContext context_ = nullptr;
    std::array<unsigned char, 4> framebuffer_{};  // OSMesa wants one, though everything is drawn to textures
    GlFunctions functions_;
};

}  // namespace

std::unique_ptr<GlContext> makeOsmesaContext() { return std::make_unique<OsmesaContext>(); }

}  // namespace brume
