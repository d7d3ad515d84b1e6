// Theorems of homogeneous fog; parity and reference are driven by the registry (tests/measure).
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <random>

#include "cpu/cpu_runner.hpp"
#include "effect/kit/gather.hpp"
#include "effect/kit/math.hpp"
#include "effect/preset.hpp"
#include "frame/read.hpp"
#include "measure/compare.hpp"

using namespace brume;

static FramePair frame(cv::Size size = {64, 36}) {
    FramePair pair;
    pair.color.create(size, CV_32FC4);
    pair.depth.create(size, CV_32F);
    cv::RNG random(3);
    random.fill(pair.color, cv::RNG::UNIFORM, 0, 2);
    random.fill(pair.depth, cv::RNG::UNIFORM, 1, 400);
    pair.camera = Camera::withHorizontalView(size, 90);
    return pair;
}

static Chain chainOf(const std::string& parameters) {
    std::string step = "{\"effect\": \"depth_fog\"" + (parameters.empty() ? "" : ", " + parameters) + "}";
    return parsePreset("{\"effects\": [" + step + "]}", "test", EffectRegistry::standard());
}
static RunResult fog(const FramePair& pair, const std::string& parameters) {
    return makeCpuRunner()->run(chainOf(parameters), pair, {"transmittance"});
}
static cv::Vec4f only(const FramePair& pair, const std::string& parameters,
                      const std::string& image = "color") {
    return fog(pair, parameters).images[image].at<cv::Vec4f>(0, 0);
}
static FramePair pixel(float depth, cv::Vec4f color = {.5f, .5f, .5f, .25f}) {
    auto pair = frame({1, 1});
    pair.depth.at<float>(0, 0) = depth;
    pair.color.at<cv::Vec4f>(0, 0) = color;
    return pair;
}
const float infinity = std::numeric_limits<float>::infinity();

TEST(Kit, GatheringFindsWhatOneByOneDoes) {
    std::vector<float> table(5000), found(64);
    std::vector<int32_t> index(64);
    for (size_t k = 0; k < table.size(); k++) table[k] = float(k) * .5f;
    for (size_t k = 0; k < index.size(); k++) index[k] = int32_t(k * k * 1237 % 4000);
    auto expectFound = [&](auto way) {
        std::fill(found.begin(), found.end(), 0.f);
        way(table.data() + 1000, index.data(), found.data(), 48);
        for (size_t k = 0; k < index.size(); k++) {
            const float wanted = k < 48 ? table[size_t(index[k]) + 1000] : 0;
            EXPECT_EQ(found[k], wanted) << k;
        }
    };
    expectFound(gather);
    expectFound(gatherOneByOne);
#ifdef BRUME_GATHERS
    if (__builtin_cpu_supports("avx512f")) expectFound(gatherAtOnce);
#endif
}

// The worst, 7.7e-7, is where the mantissa's guess is; from the least normal number to what lamps reach.
TEST(Kit, TheFastSquareRootIsOneToEightInTenMillion) {
    EXPECT_EQ(sqrtFast(0.0f), 0.0f);
    double worst = 0;
    for (float x = 1.2e-38f; x < 1e38f; x *= 1.00037f)
        worst = std::max(worst, std::abs(sqrtFast(x) / std::sqrt(double(x)) - 1));
    EXPECT_LT(worst, 8e-7);
    EXPECT_GT(worst, 1e-8);  // it is not the exact one that is tried
}

TEST(DepthFog, NoDensityIsTheIdentityEvenAtSky) {
    auto pair = frame();
    pair.depth.at<float>(2, 3) = infinity;
    pair.color.at<cv::Vec4f>(4, 5) = {infinity, 65504, -1, 0};
    auto result = fog(pair, R"("measure": "extinction", "extinction": 0)");
    EXPECT_EQ(cv::countNonZero(result.images["color"].reshape(1) != pair.color.reshape(1)), 0);
    EXPECT_EQ(cv::countNonZero(result.images["transmittance"].reshape(1) != 1), 0);
}

TEST(DepthFog, FullFogIsTheAirlightEvenBeforeInfiniteColour) {
    for (float depth : {infinity, 1e30f, 3e38f})
        for (float color : {0.f, 65504.f, infinity, std::numeric_limits<float>::quiet_NaN()}) {
            auto out = only(pixel(depth, {color, color, color, .25f}), R"("color": [0.1, 0.2, 0.3])");
            EXPECT_EQ(out, cv::Vec4f(.1f, .2f, .3f, .25f)) << depth << " " << color;
        }
}

TEST(DepthFog, TheThinnestFogHidesSky) {
    for (const char* extinction : {"1e-37", "2e-38", "1e-41"})
        for (const char* model : {"exponential", "exponential squared"}) {
            const std::string parameters =
                std::string(R"("measure": "extinction", "color": [0.1, 0.2, 0.3], "model": ")") + model +
                R"(", "extinction": )" + extinction;
            EXPECT_EQ(only(pixel(infinity, {1, 1, 1, 1}), parameters), cv::Vec4f(.1f, .2f, .3f, 1))
                << parameters;
            EXPECT_EQ(only(pixel(1e20f, {1, 1, 1, 1}), parameters), cv::Vec4f(1, 1, 1, 1)) << parameters;
        }
}

TEST(DepthFog, OpacityGrowsWithDistanceAndStaysInItsRange) {
    for (const char* model : {"exponential", "exponential squared", "linear", "power"}) {
        float last = 1;
        for (float depth = 1e-6f; depth < 1e9f; depth *= 1.7f) {
            std::string parameters =
                std::string(R"("max_opacity": 0.9, "power_exponent": 0.5, "model": ")") + model + "\"";
            float t = only(pixel(depth), parameters, "transmittance")[0];
            EXPECT_LE(t, last) << model << depth;
            EXPECT_GE(t, .1f - 1e-7f);
            last = t;
        }
        EXPECT_NEAR(last, .1f, 1e-7);
    }
}

TEST(DepthFog, TwiceIsOnceWithTheSum) {
    auto pair = frame();
    auto once = fog(pair, R"("measure": "extinction", "extinction": 0.03)");
    auto first = fog(pair, R"("measure": "extinction", "extinction": 0.01)");
    auto between = pair;
    between.color = first.images["color"];
    auto twice = fog(between, R"("measure": "extinction", "extinction": 0.02)");
    EXPECT_LT(cv::norm(once.images["color"], twice.images["color"], cv::NORM_INF), 5e-7);
}

TEST(DepthFog, VisibilityIsWhereContrastFallsToItsThreshold) {
    // One pixel looking straight ahead: distance along the ray is the depth.
    EXPECT_NEAR(only(pixel(200), R"("visibility": 200)", "transmittance")[1], .05, 1e-7);
    EXPECT_NEAR(
        only(pixel(200), R"("visibility": 200, "measure": "meteorological range")", "transmittance")[1], .02,
        1e-7);
    EXPECT_NEAR(only(pixel(200), R"("visibility": 200, "tint": [1, 2, 0])", "transmittance")[1], .0025, 1e-7);
    EXPECT_EQ(only(pixel(200), R"("visibility": 200, "tint": [1, 2, 0])", "transmittance")[2], 1);
}

TEST(DepthFog, TurningTheCameraChangesNoWorldPointsTransmittance) {
    const cv::Vec3d point(3, 4, -60);  // from the eye, world
    float first = 0;
    for (double yaw : {0., .2, .4, -.5}) {
        for (double pitch : {0., -.3, .35}) {
            auto pair = frame({201, 201});
            cv::Matx33d aboutY(std::cos(yaw), 0, std::sin(yaw), 0, 1, 0, -std::sin(yaw), 0, std::cos(yaw));
            cv::Matx33d aboutX(1, 0, 0, 0, std::cos(pitch), -std::sin(pitch), 0, std::sin(pitch),
                               std::cos(pitch));
            cv::Matx33d rotation = aboutY * aboutX;
            cv::Vec3d seen = rotation.t() * point;
            // Put the principal point so that the point falls on a pixel's centre.
            pair.camera.cx = 100.5 - seen[0] / -seen[2] * pair.camera.fx;
            pair.camera.cy = 100.5 + seen[1] / -seen[2] * pair.camera.fy;
            pair.depth.at<float>(100, 100) = float(-seen[2]);
            float t = fog(pair, R"("visibility": 90)").images["transmittance"].at<cv::Vec4f>(100, 100)[0];
            if (first == 0) first = t;
            EXPECT_NEAR(t, first, 1e-5);
        }
    }
    EXPECT_NEAR(first, std::exp(std::log(.05) / 90 * cv::norm(point)), 1e-6);
}

TEST(DepthFog, PlanarDistanceErrsAsMuchAsTheModelsSay) {
    // 110° horizontal view, 16:9: the corner's T is wrong by up to .236 (MODELS.md §0).
    auto pair = frame({160, 90});
    pair.camera = Camera::withHorizontalView(pair.size(), 110);
    double worst = 0;
    for (float depth = 1; depth < 1000; depth *= 1.05f) {
        pair.depth.setTo(depth);
        auto ray = fog(pair, R"("visibility": 200)"),
             planar = fog(pair, R"("visibility": 200, "distance_along": "planar")");
        worst = std::max(worst,
                         cv::norm(ray.images["transmittance"], planar.images["transmittance"], cv::NORM_INF));
    }
    EXPECT_NEAR(worst, .236, .006);
}

TEST(DepthFog, StartAndCutOff) {
    EXPECT_EQ(only(pixel(10), R"("start": 10)", "transmittance")[0], 1);
    EXPECT_LT(only(pixel(std::nextafter(1e3f, 2e3f)),
                   R"("start": 1000, "measure": "extinction", "extinction": 1000)", "transmittance")[0],
              1);
    float cut = only(pixel(100), R"("start": 10)", "transmittance")[0];
    EXPECT_EQ(only(pixel(infinity), R"("start": 10, "cutoff": 100)", "transmittance")[0], cut);
}

TEST(DepthFog, SpiritFogsFormula) {
    // near .1, far 1000: l = (Z - near)/(far - near); clamp(sat(l - start)·curve, 0, max)
    auto t = [](float depth) {
        return only(
            pixel(depth),
            R"("model": "linear", "near": 0, "far": 1000, "linear_start": 0.1, "curve": 2, "max_opacity": 0.8)",
            "transmittance")[0];
    };
    EXPECT_EQ(t(50), 1);
    EXPECT_NEAR(t(300), 1 - .4, 1e-6);
    EXPECT_NEAR(t(900), 1 - .8, 1e-6);
    EXPECT_NEAR(t(infinity), 1 - .8, 1e-6);
    EXPECT_EQ(only(pixel(5), R"("model": "linear", "near": 10, "far": 10)", "transmittance")[0], 1)
        << "no range: a step";
    EXPECT_EQ(only(pixel(15), R"("model": "linear", "near": 10, "far": 10)", "transmittance")[0], 0);
}

TEST(DepthFog, TheSunLobePeaksTowardsTheSunAndHenyeyGreensteinIntegratesToOne) {
    auto pair = frame({101, 101});
    pair.depth.setTo(infinity);
    auto peak = [&](const std::string& sun) {
        return fog(pair, sun + R"(, "color": [0, 0, 0], "sun_color": [1, 1, 1], "sun_direction": [0, 0, -1])")
            .images["color"];
    };
    for (const char* sun : {R"("sun": "power")", R"("sun": "henyey-greenstein")"}) {
        cv::Mat channel;
        cv::extractChannel(peak(sun), channel, 0);
        cv::Point place;
        cv::minMaxLoc(channel, nullptr, nullptr, nullptr, &place);
        EXPECT_EQ(place, cv::Point(50, 50)) << sun;
    }
    EXPECT_NEAR(peak(R"("sun": "power")").at<cv::Vec4f>(50, 50)[0], 1, 1e-6);
    for (int i : {10, 60, 95}) {  // max(0, cos)^exponent
        const double x = (i - 50) / 50.5;
        EXPECT_NEAR(peak(R"("sun": "power", "sun_exponent": 5)").at<cv::Vec4f>(50, i)[0],
                    std::pow(1 + x * x, -2.5), 1e-6);
    }
    // ∫ HG dω over the sphere, by looking at the sun from many angles: one straight-ahead pixel, sun turned.
    for (std::string g : {"-0.6", "0", "0.5", "0.85"}) {
        auto one = pixel(infinity);
        double integral = 0;
        const int n = 1600;
        for (int k = 0; k < n; k++) {
            double cosine = -1 + (k + .5) * 2 / n, sine = std::sqrt(1 - cosine * cosine);
            auto out = only(
                one,
                R"("sun": "henyey-greenstein", "color": [0,0,0], "sun_color": [1,1,1], "sun_anisotropy": )" +
                    g + ", \"sun_direction\": [" + std::to_string(sine) + ", 0, " + std::to_string(-cosine) +
                    "]");
            integral += out[0] * 2 * CV_PI * 2 / n;
        }
        EXPECT_NEAR(integral, 1, 2e-3) << g;
    }
    EXPECT_EQ(only(pixel(infinity),
                   R"("sun": "henyey-greenstein", "color": [0.5,0.5,0.5], "sun_direction": [0,0,0])")[0],
              .5f);
}

TEST(DepthFog, EncodedMixingMixesEncodedValues) {
    auto enc = [](double x) { return x <= .0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - .055; };
    auto out = only(pixel(200, {.2f, .2f, .2f, 1}),
                    R"("visibility": 200, "color": [0.7, 0.7, 0.7], "mixing": "encoded")");
    EXPECT_NEAR(enc(out[0]), enc(.2) * .05 + enc(.7) * .95, 1e-6);
}

TEST(KitMath, ElementaryFunctionsHoldTheirStatedAccuracy) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> exponent(-87, 88), small(-20, 2), mantissa(0.5f, 2);
    double worstExp = 0, worstOpacity = 0, worstTransmittance = 0, worstPow = 0;
    for (int k = 0; k < 1000000; k++) {
        float x = exponent(random);
        worstExp = std::max(worstExp, std::abs(expFast(x) / std::exp(double(x)) - 1));
        float tau = std::pow(10.f, small(random) * .5f);
        Extinction e = extinctionOf(tau);
        worstOpacity = std::max(worstOpacity, std::abs(e.opacity / -std::expm1(-double(tau)) - 1));
        if (tau < 80)
            worstTransmittance =
                std::max(worstTransmittance, std::abs(e.transmittance / std::exp(-double(tau)) - 1));
        float base = std::ldexp(mantissa(random), int(random() % 100) - 60), y = mantissa(random);
        worstPow = std::max(worstPow, std::abs(powFast(base, y) / std::pow(double(base), double(y)) - 1));
    }
    EXPECT_LT(worstExp, 2e-7);
    EXPECT_LT(worstOpacity, 2e-7) << "no cancellation, down to τ = 1e-10";
    EXPECT_LT(worstTransmittance, 3e-7);
    EXPECT_LT(worstPow, 3e-7);
    for (float tau = 1e-8f; tau < .345f; tau *= 1.0001f)  // what thin steps leave out changes no bit
        ASSERT_EQ(0.0f - expm1Small(-tau), extinctionOf(tau).opacity) << tau;
    EXPECT_EQ(extinctionOf(infinity).transmittance, 0);
    EXPECT_EQ(extinctionOf(0).opacity, 0);
    EXPECT_EQ(extinctionOf(0).transmittance, 1);
    EXPECT_EQ(powFast(0, .5f), 0);
    EXPECT_EQ(powFast(infinity, .5f), infinity);
    EXPECT_TRUE(isNan(std::numeric_limits<float>::quiet_NaN()) && !isNan(infinity) && isInf(-infinity));
}

TEST(DepthFog, AnIndependentPathTracerAgrees) {
    std::string captures = BRUME_CAPTURES;
    if (captures.empty()) GTEST_SKIP() << "set BRUME_CAPTURES to the folder of captured pairs";
    auto clear = readFrame(captures + "/blender/flat_clear.exr");
    auto truth = readImage(captures + "/blender/flat_fog.exr");
    std::string parameters = R"("measure": "extinction", "extinction": 0.02, "color": [0.6, 0.65, 0.7])";
    EXPECT_GE(psnrEncoded(fog(clear, parameters).images["color"], truth), 54.2);
    EXPECT_LE(psnrEncoded(fog(clear, parameters + R"(, "distance_along": "planar")").images["color"], truth),
              43);
}
