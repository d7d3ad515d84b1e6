#include "gl/context.hpp"

#include <gtest/gtest.h>

#include "error.hpp"
#include "gl/functions.hpp"

namespace brume {
namespace {

float clearAndRead(GlContext& context, float value) {
    const GlFunctions& gl = context.functions();
    GLuint texture = 0;
    gl.CreateTextures(GL_TEXTURE_2D, 1, &texture);
    gl.TextureStorage2D(texture, 1, GL_R32F, 1, 1);
    gl.ClearTexImage(texture, 0, GL_RED, GL_FLOAT, &value);
    float read = -1;
    gl.GetTextureImage(texture, 0, GL_RED, GL_FLOAT, sizeof read, &read);
    gl.DeleteTextures(1, &texture);
    return read;
}

TEST(GlContext, ContextsOfBothPlatformsWorkSideBySide) {
    GlThread osmesa(GlPlatform::Osmesa), egl(GlPlatform::Egl), second(GlPlatform::Egl);
    EXPECT_NE(osmesa.describe().find("OSMesa: "), std::string::npos) << osmesa.describe();
    EXPECT_NE(egl.describe().find("EGL "), std::string::npos) << egl.describe();
    for (float value : {1.5f, 2.5f})
        for (GlThread* thread : {&osmesa, &egl, &second})
            thread->run([&](GlContext& context) {
                EXPECT_EQ(clearAndRead(context, value), value) << context.describe();
                GLint major = 0, minor = 0;
                context.functions().GetIntegerv(GL_MAJOR_VERSION, &major);
                context.functions().GetIntegerv(GL_MINOR_VERSION, &minor);
                EXPECT_GE(major * 10 + minor, 45);
            });
}

TEST(GlContext, ContextsComeAndGo) {
    for (int k = 0; k < 3; k++)
        for (GlPlatform platform : {GlPlatform::Osmesa, GlPlatform::Egl, GlPlatform::Auto}) {
            auto context = GlContext::create(platform);
            EXPECT_EQ(clearAndRead(*context, 3), 3);
        }
}

TEST(GlThread, RethrowsWhatAJobThrowsAndGoesOn) {
    GlThread thread(GlPlatform::Osmesa);
    EXPECT_THROW(thread.run([](GlContext&) { failUsage("no"); }), Error);
    int ran = 0;
    thread.run([&](GlContext&) { ran++; });
    EXPECT_EQ(ran, 1);
}

TEST(GlThread, PassesOnAContextThatCannotBeMade) {
    EXPECT_THROW(GlThread([]() -> std::unique_ptr<GlContext> { failUsage("no context"); }), Error);
}

TEST(GlFunctions, AMissingFunctionIsNamed) {
    try {
        loadGlFunctions([](const char*) { return GlProcAddress(nullptr); });
        FAIL();
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("glEnable"), std::string::npos) << e.what();
    }
}

}  // namespace
}  // namespace brume
