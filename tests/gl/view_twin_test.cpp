// kit/view.glsl and kit/view.hpp against each other, over a million pixels of four cameras.
#include <bit>
#include <sstream>

#include "effect/kit/view.hpp"
#include "gl_fixture.hpp"
#include "measure/probe.hpp"

namespace brume {
namespace {

using ViewTwins = OnBothPlatforms;
BOTH_PLATFORMS(ViewTwins);

std::string fileText(const std::string& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::string bits(float value) { return text("uintBitsToFloat(", std::bit_cast<uint32_t>(value), "u)"); }

// What the runner would declare, as constants.
std::string declarations(const View& view) {
    std::ostringstream out;
    out << "#define BRUME_COMPUTE 1\nlayout(rgba32f, binding = 0) writeonly uniform image2D brume_target;\n"
        << "uniform sampler2D depthImage;\nconst ivec2 passSize = ivec2(" << view.width << ", " << view.height
        << ");\nconst ivec2 view_size = passSize, view_frameSize = ivec2(" << view.frameWidth << ", "
        << view.frameHeight << ");\nconst vec2 view_inverseFocal = vec2(" << bits(view.inverseFx) << ", "
        << bits(view.inverseFy) << "), view_origin = vec2(" << bits(view.originX) << ", "
        << bits(view.originY)
        << ");\nconst vec3 view_eye = vec3(0.0);\nconst mat3 view_worldFromView = transpose(mat3(";
    for (int k = 0; k < 9; k++) out << (k ? ", " : "") << bits(view.worldFromView.val[k]);
    out << "));\n";
    return out.str() + fileText(BRUME_SOURCE_DIR "/src/effect/kit/image.glsl") +
           fileText(BRUME_SOURCE_DIR "/src/effect/kit/view.glsl");
}

Camera turned(cv::Size size, double degrees, double yaw, double pitch) {
    Camera camera = Camera::withHorizontalView(size, degrees);
    const cv::Matx44d yawed(std::cos(yaw), 0, std::sin(yaw), 0, 0, 1, 0, 0, -std::sin(yaw), 0, std::cos(yaw),
                            0, 0, 0, 0, 1);
    camera.worldFromCamera = Camera::standing(1.6, pitch) * yawed;
    return camera;
}

TEST_P(ViewTwins, AgreeOverAMillionPixels) {
    struct Case {
        cv::Size size, frame;
        double degrees, yaw, pitch;
    };
    const Case cases[] = {{{1920, 1080}, {1920, 1080}, 60, 0, 0},
                          {{480, 270}, {1920, 1080}, 90, .7, -20},
                          {{7680, 4320}, {7680, 4320}, 110, 2.9, 35},
                          {{333, 777}, {999, 2331}, 10, -1.3, 89}};
    const size_t count = 250'000;
    double rayError = 0, lengthError = 0, directionError = 0;
    cv::RNG rng(11);
    for (const Case& c : cases) {
        View view = View::of(turned(c.frame, c.degrees, c.yaw, c.pitch), c.size.width, c.size.height,
                             c.frame.width, c.frame.height);
        std::vector<float> pixels;
        for (size_t k = 0; k < count; k++) {
            const int i = rng.uniform(0, c.size.width), j = rng.uniform(0, c.size.height);
            pixels.insert(pixels.end(), {float(i), float(j), 0, 0});
        }
        const std::string functions = declarations(view);
        const auto rays =
            probeGlsl(*thread(), functions,
                      "vec3 ray = rayOf(ivec2(in0.xy)); result = vec4(ray, rayLength(ray));", pixels);
        const auto directions = probeGlsl(
            *thread(), functions, "result = vec4(directionOf(rayOf(ivec2(in0.xy))), pixelScale());", pixels);
        for (size_t k = 0; k < count; k++) {
            const float x = view.rayX(int(pixels[4 * k])), y = view.rayY(int(pixels[4 * k + 1]));
            const float length = View::rayLength(x, y);
            const cv::Vec3f direction = view.direction(x, y);
            rayError = std::max(
                {rayError, std::abs(double(rays[4 * k]) - x), std::abs(double(rays[4 * k + 1]) - y)});
            EXPECT_EQ(rays[4 * k + 2], -1);
            lengthError = std::max(lengthError, std::abs(double(rays[4 * k + 3]) - length) / length);
            for (int n = 0; n < 3; n++)
                directionError =
                    std::max(directionError, std::abs(double(directions[4 * k + n]) - direction[n]));
            ASSERT_EQ(directions[4 * k + 3], view.pixelScale());
        }
    }
    std::cout << "worst: ray " << rayError << ", length " << lengthError << " relative, direction "
              << directionError << "\n";
    EXPECT_EQ(rayError, 0) << "the ray is `precise`: the same bits";
    // llvmpipe gives the same bits here too; GLSL allows sqrt 2.5 ulp, and division and products of three as
    // much.
    EXPECT_LE(lengthError, 3e-7);
    EXPECT_LE(directionError, 5e-7);
}

TEST_P(ViewTwins, TheProbeSaysWhatDoesNotCompile) {
    const float one[] = {1, 2, 3, 4};
    try {
        probeGlsl(*thread(), "float f(float x) { return x; }\nfloat g() { return y; }\n",
                  "result.x = f(1.0);", one);
        FAIL();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("the probe's functions:2: "), std::string::npos)
            << error.what();
    }
}

TEST_P(ViewTwins, TheProbeGivesEachInputItsOwnResult) {
    std::vector<float> first(4 * 1000), second(4 * 1000);
    for (size_t k = 0; k < first.size(); k++) first[k] = float(k), second[k] = float(2 * k);
    const auto sums = probeGlsl(*thread(), "", "result = in0 + in1;", first, second);
    for (size_t k = 0; k < first.size(); k++) ASSERT_EQ(sums[k], float(3 * k));
}

}  // namespace
}  // namespace brume
