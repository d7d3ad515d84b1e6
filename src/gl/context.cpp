#include "gl/context.hpp"

#include <string_view>

#include "error.hpp"
#include "gl/functions.hpp"
#include "gl/platforms.hpp"

namespace brume {

namespace {

std::string glString(const GlContext& context, GLenum name) {
    const auto* found = reinterpret_cast<const char*>(context.functions().GetString(name));
    return found ? found : "unknown";
}

}  // namespace

std::string GlContext::describe() const {
    return text(platform(), ": ", glString(*this, GL_VENDOR), ", ", glString(*this, GL_RENDERER), ", ",
                glString(*this, GL_VERSION));
}

bool GlContext::isHardware() const {
    const std::string renderer = glString(*this, GL_RENDERER);
    for (std::string_view software : {"llvmpipe", "softpipe", "swrast", "Software Rasterizer", "SWR"})
        if (renderer.find(software) != std::string::npos) return false;
    return true;
}

std::unique_ptr<GlContext> GlContext::create(GlPlatform platform) {
    if (platform == GlPlatform::Osmesa) return makeOsmesaContext();
    if (platform == GlPlatform::Egl) return makeEglContext();
    std::string problems;
    try {
        auto context = makeEglContext();
        if (context->isHardware()) return context;
    } catch (const Error& e) {
        problems = e.what();
    }
    try {
        return makeOsmesaContext();
    } catch (const Error& e) {
        problems += text(problems.empty() ? "" : "; ", e.what());
    }
    try {
        return makeEglContext();
    } catch (const Error&) {
        throw Error(ErrorKind::Usage, problems);
    }
}

}  // namespace brume
