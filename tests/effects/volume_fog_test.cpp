// Theorems of marched fog; parity and reference over all parameters are driven by the registry
// (tests/measure).
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <random>

#include "apply/apply.hpp"
#include "cpu/cpu_runner.hpp"
#include "effect/preset.hpp"
#include "error.hpp"
#include "measure/compare.hpp"

namespace brume {
namespace {

const float infinity = std::numeric_limits<float>::infinity();
const char* const physicalMethods[] = {"left",     "midpoint",    "gauss_legendre",
                                       "jittered", "equiangular", "shared_noise"};

FramePair frame(cv::Size size = {48, 27}, double nearest = 1, double farthest = 200) {
    FramePair pair;
    pair.color.create(size, CV_32FC4);
    pair.depth.create(size, CV_32F);
    cv::RNG random(5);
    random.fill(pair.color, cv::RNG::UNIFORM, 0, 2);
    random.fill(pair.depth, cv::RNG::UNIFORM, nearest, farthest);
    pair.camera = Camera::withHorizontalView(size, 90);
    return pair;
}

FramePair pixel(float depth, cv::Vec4f color = {.5f, .5f, .5f, .25f}) {
    auto pair = frame({1, 1});
    pair.depth.at<float>(0, 0) = depth;
    pair.color.at<cv::Vec4f>(0, 0) = color;
    return pair;
}

RunResult fog(const FramePair& pair, const std::string& parameters) {
    const std::string step = "{\"effect\": \"volume_fog\", " + parameters + "}";
    const Chain chain = parsePreset("{\"effects\": [" + step + "]}", "test", EffectRegistry::standard());
    std::vector<StepPlan> decisions;
    const Chain planned = planChain(chain, pair, Backend::Cpu, {"transmittance"}, &decisions);
    return makeCpuRunner()->run(planned, pair, {"transmittance"});
}

cv::Vec4f only(const FramePair& pair, const std::string& parameters, const std::string& image = "color") {
    return fog(pair, parameters).images[image].at<cv::Vec4f>(0, 0);
}

double distanceOf(const FramePair& pair, cv::Point p) {
    return pair.depth.at<float>(p) * cv::norm(pair.camera.ray(p.x, p.y));
}

std::string withMethod(const std::string& method, int steps, const std::string& rest) {
    return "\"method\": \"" + method + "\", \"steps\": " + std::to_string(steps) + ", " + rest;
}

// Every kind of density at once, lit evenly.
const std::string mixedFog =
    R"("density": 0.004, "height_falloff": "linear", "height_start": 1, "height_distance": 30, "sun_intensity": 0,
       "noise": "additive", "noise_size": 7, "shadow_strength": 0,
       "boxes": [{"center": [0, 0, -30], "size": [60, 40, 30], "density": 0.03, "height_falloff": "exponential",
                  "height_start": 10, "height_distance": 25, "edge_falloff": "linear"},
                 {"center": [10, 5, -40], "size": [30, 30, 60], "density": 0.02, "edge_falloff": "exponential"}])";

TEST(VolumeFog, NoDensityIsTheIdentityEvenAtSky) {
    auto pair = frame();
    pair.depth.at<float>(2, 3) = infinity;
    pair.color.at<cv::Vec4f>(4, 5) = {infinity, 65504, -1, 0};
    for (const char* method :
         {"left", "midpoint", "gauss_legendre", "jittered", "equiangular", "shared_noise", "p2"}) {
        auto result = fog(pair, withMethod(method, 4, R"("density": 0)"));
        EXPECT_EQ(cv::countNonZero(result.images["color"].reshape(1) != pair.color.reshape(1)), 0) << method;
        EXPECT_EQ(cv::countNonZero(result.images["transmittance"].reshape(1) != 1), 0) << method;
    }
}

TEST(VolumeFog, UniformSceneIsBeerLambertAtAnyStepCount) {
    auto pair = frame();
    pair.depth.at<float>(0, 0) = infinity;  // ends at max_distance
    for (const char* method : physicalMethods)
        for (int steps : {1, 3, 32}) {
            auto result = fog(pair, withMethod(method, steps, R"("density": 0.03, "albedo": [1, 0.5, 0.25],
                "ambient": [0.6, 0.7, 0.8], "sun_intensity": 0, "max_distance": 150, "early_stop": false)"));
            for (int j = 0; j < pair.color.rows; j++)
                for (int i = 0; i < pair.color.cols; i++) {
                    const double t = std::exp(-double(.03f) * std::min(150., distanceOf(pair, {i, j})));
                    const double airlight[3] = {.6, .5 * .7, .25 * .8};
                    const auto out = result.images["color"].at<cv::Vec4f>(j, i);
                    for (int k = 0; k < 3; k++) {
                        const double truth = pair.color.at<cv::Vec4f>(j, i)[k] * t + airlight[k] * (1 - t);
                        ASSERT_NEAR(out[k], truth, 1.5e-6)
                            << method << " " << steps << " at " << i << ", " << j;
                    }
                }
        }
}

TEST(VolumeFog, UniformBoxesAreExactInDepth) {
    std::mt19937 random(7);
    auto draw = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    const auto pair = frame({64, 36});
    for (int trial = 0; trial < 12; trial++) {
        const char* method = physicalMethods[trial % 6];
        std::string boxes;
        struct Box {
            float centre[3], size[3], density;
        };
        std::vector<Box> drawn;
        for (int k = 0; k < 1 + trial % 5; k++) {
            Box b;
            // In sixteenths and thousandths: the preset's text then holds them exactly.
            for (int n = 0; n < 3; n++)
                b.centre[n] = float(std::round(draw(-960, 320))) / 16,
                b.size[n] = float(std::round(draw(16, 1280))) / 16;
            b.density = float(std::round(draw(1, 50)) / 1000);
            drawn.push_back(b);
            boxes += text(k ? "," : "", "{\"center\": [", b.centre[0], ",", b.centre[1], ",", b.centre[2],
                          "], \"size\": [", b.size[0], ",", b.size[1], ",", b.size[2],
                          "], \"density\": ", b.density, "}");
        }
        auto result =
            fog(pair, withMethod(method, 1 + 3 * trial,
                                 "\"density\": 0, \"early_stop\": false, \"boxes\": [" + boxes + "]"));
        for (int j = 0; j < pair.color.rows; j++)
            for (int i = 0; i < pair.color.cols; i++) {
                const cv::Vec3d ray = pair.camera.ray(i, j) / cv::norm(pair.camera.ray(i, j)),
                                eye = pair.camera.eye();
                double depth = 0;
                for (const Box& b : drawn) {
                    double enter = 0, leave = distanceOf(pair, {i, j});
                    for (int n = 0; n < 3; n++) {
                        const double one = (b.centre[n] - .5 * b.size[n] - eye[n]) / ray[n],
                                     other = (b.centre[n] + .5 * b.size[n] - eye[n]) / ray[n];
                        enter = std::max(enter, std::min(one, other));
                        leave = std::min(leave, std::max(one, other));
                    }
                    depth += std::max(0., leave - enter) * b.density;
                }
                ASSERT_NEAR(result.images["transmittance"].at<cv::Vec4f>(j, i)[0], std::exp(-depth), 2e-6)
                    << method << " " << trial << " at " << i << ", " << j;
            }
    }
}

TEST(VolumeFog, TheOrderOfBoxesDoesNotShow) {
    const std::string boxes[3] = {
        R"({"center": [0, 0, -30], "size": [60, 40, 30], "density": 0.03, "albedo": [1, 0, 0], "edge_falloff": "linear"})",
        R"({"center": [10, 5, -40], "size": [30, 30, 60], "density": 0.02, "albedo": [0, 1, 0]})",
        R"({"center": [-10, 5, -20], "size": [30, 30, 30], "density": 0.05, "albedo": [0, 0, 1],
            "height_falloff": "exponential", "height_distance": 10})"};
    const auto pair = frame();
    cv::Mat first;
    const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    for (const auto& order : orders) {
        const std::string list = boxes[order[0]] + "," + boxes[order[1]] + "," + boxes[order[2]];
        const cv::Mat out = fog(pair, withMethod("midpoint", 16, "\"density\": 0, \"boxes\": [" + list + "]"))
                                .images["color"];
        if (first.empty()) first = out.clone();
        EXPECT_EQ(cv::countNonZero(out.reshape(1) != first.reshape(1)), 0);
    }
}

TEST(VolumeFog, SixteenBoxesOfOneDensityAreOneOfTheirSum) {
    const auto pair = frame();
    std::string boxes;
    for (int k = 0; k < 16; k++)
        boxes +=
            std::string(k ? "," : "") + R"({"center": [0, 0, -30], "size": [60, 40, 30], "density": 0.0078125,
            "height_falloff": "linear", "height_start": 5, "height_distance": 20})";
    const auto many = fog(pair, withMethod("midpoint", 16, "\"density\": 0, \"boxes\": [" + boxes + "]"));
    const auto one = fog(pair, withMethod("midpoint", 16, R"("density": 0, "boxes": [{"center": [0, 0, -30],
        "size": [60, 40, 30], "density": 0.125, "height_falloff": "linear", "height_start": 5, "height_distance": 20}])"));
    EXPECT_TRUE(compareImages(many.images.at("color"), one.images.at("color"), 2e-6, 1e-6).passed);
}

// A furnace: what is as bright as the light everywhere stays so, whatever fog is between.
TEST(VolumeFog, EvenLightNeitherGainsNorLoses) {
    auto pair = frame();
    pair.color = cv::Scalar(.7, .7, .7, 1);
    pair.depth.at<float>(1, 1) = infinity;
    for (const char* method : physicalMethods)
        for (int steps : {1, 7, 32, 400}) {
            const cv::Mat out =
                fog(pair, withMethod(method, steps, mixedFog + R"(, "ambient": [0.7, 0.7, 0.7])"))
                    .images["color"];
            double low, high;
            cv::minMaxLoc(out.reshape(1, 1).colRange(0, 3), &low, &high);
            for (int j = 0; j < out.rows; j++)
                for (int i = 0; i < out.cols; i++)
                    for (int k = 0; k < 3; k++)
                        ASSERT_NEAR(out.at<cv::Vec4f>(j, i)[k], .7f, 3e-6) << method << steps;
        }
}

TEST(VolumeFog, TransmittanceFallsWithDistance) {
    for (const char* method : {"midpoint", "gauss_legendre", "p2"}) {
        float last = 1;
        for (float depth = .5f; depth < 900; depth *= 1.3f) {
            const float t = only(pixel(depth), withMethod(method, 200, mixedFog), "transmittance")[0];
            EXPECT_LE(t, last + 2e-3f) << method << " at " << depth;  // samples move with the surface
            EXPECT_GE(t, 0);
            last = t;
        }
    }
}

TEST(VolumeFog, TurningTheCameraDoesNotChangeWhatAPointLetsThrough) {
    // One world point, seen by cameras at one place that look elsewhere.
    const cv::Vec3d point(12, 9, -60), eye(0, 1.6, 0);
    for (double yaw : {-30., -11., 0., 17., 33.})
        for (double pitch : {-20., 0., 12.}) {
            auto pair = frame({640, 360});
            pair.depth = cv::Scalar(1);
            cv::Matx44d pose = Camera::standing(1.6, pitch);
            const double c = std::cos(yaw * CV_PI / 180), s = std::sin(yaw * CV_PI / 180);
            pair.camera.worldFromCamera = cv::Matx44d(c, 0, s, 0, 0, 1, 0, 1.6, -s, 0, c, 0, 0, 0, 0, 1) *
                                          cv::Matx44d(1, 0, 0, 0, 0, 1, 0, -1.6, 0, 0, 1, 0, 0, 0, 0, 1) *
                                          pose;
            const cv::Matx33d rotation = pair.camera.worldFromCamera.get_minor<3, 3>(0, 0);
            const cv::Vec3d local = rotation.t() * (point - eye);
            // Put the pixel's centre on the point.
            const double column = local[0] / -local[2] * pair.camera.fx + pair.camera.cx,
                         row = -local[1] / -local[2] * pair.camera.fy + pair.camera.cy;
            if (column < 1 || row < 1 || column > 638 || row > 358) continue;
            pair.camera.cx += std::floor(column) + .5 - column;
            pair.camera.cy += std::floor(row) + .5 - row;
            const cv::Point at{int(column), int(row)};
            pair.depth.at<float>(at) = float(-local[2]);
            const float t =
                fog(pair, withMethod("midpoint", 8, mixedFog)).images["transmittance"].at<cv::Vec4f>(at)[0];
            static const float first = t;
            EXPECT_NEAR(t, first, 1e-5) << yaw << " " << pitch;
        }
}

TEST(VolumeFog, RaysAlongInsideAndOnTheFacesOfABox) {
    // The middle ray of an odd frame looks exactly along -z from (0, 1.6, 0).
    auto pair = frame({3, 3});
    pair.depth = cv::Scalar(100);
    auto middle = [&](const std::string& centre, const std::string& size) {
        const auto out =
            fog(pair, withMethod("midpoint", 8,
                                 "\"density\": 0, \"early_stop\": false, \"boxes\": [{\"center\": " + centre +
                                     ", \"size\": " + size + ", \"density\": 0.01}]"));
        for (int k = 0; k < 9; k++)
            for (const char* image : {"color", "transmittance"})
                EXPECT_TRUE(cv::checkRange(out.images.at(image))) << image << centre;
        return -std::log(out.images.at("transmittance").at<cv::Vec4f>(1, 1)[0]) / .01f;
    };
    EXPECT_NEAR(middle("[0, 1.6, -50]", "[10, 10, 20]"), 20, 1e-3);  // through, parallel to four faces
    EXPECT_NEAR(middle("[0, 1.6, 0]", "[10, 10, 20]"), 10, 1e-3);    // from inside
    EXPECT_NEAR(middle("[0, 1.6, -200]", "[10, 10, 20]"), 0, 1e-6);  // behind the surface
    EXPECT_NEAR(middle("[0, 1.6, 50]", "[10, 10, 20]"), 0, 1e-6);    // behind the eye
    EXPECT_NEAR(middle("[20, 1.6, -50]", "[10, 10, 20]"), 0, 1e-6);  // parallel, outside
    EXPECT_NEAR(middle("[5, 1.6, -50]", "[10, 10, 20]"), 20, 1e-3);  // in its low face: inside
    EXPECT_NEAR(middle("[-5, 1.6, -50]", "[10, 10, 20]"), 0, 1e-6);  // in its high face: outside, so that
    EXPECT_NEAR(middle("[0, 1.6, -50]", "[10, 10, 0]"), 0,
                1e-6);  // neighbours never count twice; flat: nothing
}

TEST(VolumeFog, FullFogIsItsOwnLightEvenBeforeInfiniteColour) {
    for (float color : {0.f, 65504.f, infinity, std::numeric_limits<float>::quiet_NaN()})
        for (const char* method : {"midpoint", "gauss_legendre"}) {
            const std::string rest =
                R"("density": 1, "sun_intensity": 0, "ambient": [0.1, 0.2, 0.3], "early_stop": false)";
            auto out = only(pixel(infinity, {color, color, color, .25f}), withMethod(method, 64, rest));
            for (int k = 0; k < 3; k++) EXPECT_NEAR(out[k], .1f * float(k + 1), 1e-6) << color;
            EXPECT_EQ(out[3], .25f);
        }
}

float encoded(float x) {
    x = std::clamp(x, 0.f, 1.f);
    return x <= .0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - .055f;
}

TEST(VolumeFog, StoppingEarlyCostsLessThanHalfAnEightBitStep) {
    const auto pair = frame({48, 27}, 1, 900);
    for (const char* method : {"midpoint", "gauss_legendre"}) {
        const std::string rest = R"("density": 0.05, "sun_color": [4, 3, 2], "phase": "henyey-greenstein")";
        const cv::Mat on = fog(pair, withMethod(method, 128, rest)).images["color"];
        const cv::Mat off =
            fog(pair, withMethod(method, 128, rest + R"(, "early_stop": false)")).images["color"];
        for (int j = 0; j < on.rows; j++)
            for (int i = 0; i < on.cols; i++)
                for (int k = 0; k < 3; k++)
                    ASSERT_LE(
                        std::abs(encoded(on.at<cv::Vec4f>(j, i)[k]) - encoded(off.at<cv::Vec4f>(j, i)[k])),
                        1 / 510.);
    }
}

// The wind carries the noise: a camera that drifts along sees it stand still.
TEST(VolumeFog, NoiseDriftsWithTheWind) {
    auto still = frame();
    auto moved = still;
    moved.time = 12.5;
    for (int k = 0; k < 3; k++) moved.camera.worldFromCamera(k, 3) += 12.5 * std::array{3., .5, -1.}[k];
    const std::string rest =
        R"("density": 0.02, "noise": "subtractive", "noise_size": 9, "wind": [3, 0.5, -1])";
    const auto a = fog(still, withMethod("midpoint", 32, rest)),
               b = fog(moved, withMethod("midpoint", 32, rest));
    EXPECT_TRUE(compareImages(a.images.at("color"), b.images.at("color"), 3e-6, 1e-5).passed);
    moved.time = 0;
    const auto c = fog(moved, withMethod("midpoint", 32, rest));
    EXPECT_FALSE(compareImages(a.images.at("color"), c.images.at("color"), 1e-3, 1e-3).passed);
}

TEST(VolumeFog, FarFromTheOriginIsTheSameFog) {
    auto near = frame();
    auto far = near;
    for (int k : {0, 2}) far.camera.worldFromCamera(k, 3) += 65536;  // whole in fp32, whole in noise cells
    auto at = [](double x) {
        return withMethod("midpoint", 24,
                          text(R"("density": 0.003, "noise": "additive", "noise_size": 8, "noise_seed": 3,
            "wind": [0, 0, 0], "max_distance": 300, "boxes": [{"center": [)",
                               x, ", 5, ", x - 40, R"(], "size": [30, 30, 60],
            "density": 0.02, "edge_falloff": "exponential"}], "point_lights": [{"position": [)",
                               x, ", 4, ", x - 20, "]}]"));
    };
    const auto a = fog(near, at(0)), b = fog(far, at(65536));
    EXPECT_TRUE(compareImages(a.images.at("color"), b.images.at("color"), 2e-6, 1e-5).passed);
}

// --- the report's own numbers
TEST(VolumeFogP2, WhiteOnWhiteDipsToThreeQuarters) {
    // α = .5 at half the saturation distance; colour is multiplied by α twice: .5 + .5·.5.
    const std::string rest = R"("density": 0.0299573227, "sun_color": [1, 1, 1], "ambient_intensity": 0)";
    const auto out = only(pixel(50, {1, 1, 1, 1}), withMethod("p2", 100, rest));
    for (int k = 0; k < 3; k++) EXPECT_NEAR(out[k], .75, 1e-5);
}

TEST(VolumeFogP2, SaturatesAtItsDistanceWhereThePhysicalFogLeavesFivePercent) {
    const std::string rest = R"("density": 0.0299573227, "sun_color": [1, 1, 1], "ambient_intensity": 0)";
    EXPECT_NEAR(only(pixel(100), withMethod("p2", 128, rest), "transmittance")[0], 0, 1e-5);
    EXPECT_NEAR(only(pixel(25), withMethod("p2", 128, rest), "transmittance")[0], .75, 1e-5);
    EXPECT_NEAR(only(pixel(100), withMethod("midpoint", 128, rest), "transmittance")[0], .05, 1e-6);
}

TEST(VolumeFogP2, ExponentialHeightFalloffEndsAtItsPrintedRate) {
    // A level ray at the falloff's end sees density·exp(-7.5) everywhere.
    auto pair = pixel(100);
    pair.camera.worldFromCamera(1, 3) = 300;
    const std::string rest =
        R"("density": 10, "height_falloff": "exponential", "height_start": 100, "height_distance": 200)";
    const float t = only(pair, withMethod("midpoint", 4, rest), "transmittance")[0];
    EXPECT_NEAR(t, std::exp(-10 * 100 * std::exp(-7.5)), 1e-5);
}

TEST(VolumeFogP2, LampsReplaceTheSunUpToFully) {
    // Within P2's attenuation of .1 the lamp's share is 1 (it reaches 10): the fog there is the lamp's colour
    // alone.
    const std::string rest =
        R"("density": 0.0299573227, "sun_color": [1, 0, 0], "ambient_intensity": 0, "point_lights":
        [{"position": [0, 1.6, 0], "color": [0, 1, 0], "range": 150, "attenuation": [0.1, 0.00005, 0.0005]}])";
    const auto out = only(pixel(30, {0, 0, 0, 1}), withMethod("p2", 64, rest));
    EXPECT_NEAR(out[0], 0, 1e-6);
    EXPECT_NEAR(out[1], .3 * .3, 1e-5);
}

}  // namespace
}  // namespace brume
