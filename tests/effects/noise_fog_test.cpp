// Theorems of heterogeneous fog; parity and reference are driven by the registry (tests/measure).
#include <map>
#include <random>

#include "common/noise_reference.hpp"
#include "common/noise_volume.hpp"
#include "fog_fixture.hpp"
#include "noise_fog/methods.hpp"
#include "noise_fog/params.hpp"
#include "noise_fog/reference.hpp"

namespace brume {
using namespace noise_fog;
namespace {

std::string step(const std::string& parameters) {
    return R"({"effect": "noise_fog", "method": "procedural")" +
           (parameters.empty() ? "" : ", " + parameters) + "}";
}
const char* const everywhere[] = {R"("where": "at the surface")", R"("where": "along the ray")",
                                  R"("where": "as a product")"};

TEST(NoiseFog, NoDensityIsTheIdentityAlsoAtSky) {
    FramePair frame = fogFrame();
    frame.depth.at<float>(2, 3) = HUGE_VALF;
    frame.color.at<cv::Vec4f>(4, 5) = {HUGE_VALF, 65504, -1, 0};
    for (std::string where : everywhere)
        for (std::string model :
             {R"("density": 0)", R"("model": "power", "low": 0, "high": 0, "y_density": 0)"}) {
            auto result = runFog(frame, step(where + ", " + model));
            EXPECT_EQ(cv::countNonZero(result.images["color"].reshape(1) != frame.color.reshape(1)), 0)
                << where << model;
            EXPECT_EQ(cv::countNonZero(result.images["transmittance"].reshape(1) != 1), 0) << where << model;
        }
}

// Where noise changes nothing, it is depth_fog: at the surface, along the ray and as a product of constants.
TEST(NoiseFog, EvenDensityIsHomogeneousFog) {
    FramePair frame = fogFrame();
    frame.depth.at<float>(2, 3) = HUGE_VALF;
    const cv::Mat even =
        runFog(frame, R"({"effect": "depth_fog", "measure": "extinction", "extinction": 0.04, "start": 2})")
            .images["color"];
    for (std::string where : everywhere)
        EXPECT_LT(
            apart(even, runFog(frame, step(where + R"(, "density": 0.02, "low": 2, "high": 2, "start": 2,
                    "color_high": [0.6, 0.65, 0.7], "x_profile": "constant", "y_profile": "noise", "z_profile": "noise",
                    "x_density": 0.5)"))
                            .images["color"]),
            2e-6)
            << where;
    const cv::Mat power =
        runFog(
            frame,
            R"({"effect": "depth_fog", "model": "power", "power_distance": 90, "power_exponent": 0.55, "max_opacity": 0.5})")
            .images["color"];
    EXPECT_LT(apart(power, runFog(frame, step(R"("model": "power", "low": 1, "high": 1, "power_distance": 90,
        "power_exponent": 0.55, "max_opacity": 0.5, "color_high": [0.6, 0.65, 0.7])"))
                               .images["color"]),
              3e-6);
}

TEST(NoiseFog, OpacityStaysInRange) {
    FramePair frame = fogFrame();
    frame.depth.at<float>(2, 3) = HUGE_VALF;
    for (std::string where : everywhere)
        for (std::string model : {"exponential", "power"})
            for (std::string mode : {"modulate", "ocean", "additive", "subtractive"}) {
                const cv::Mat T = transmittanceOf(frame, step(where + R"(, "max_opacity": 0.9, "model": ")" +
                                                              model + R"(", "mode": ")" + mode + "\""));
                double low, high;
                cv::minMaxLoc(T.reshape(1), &low, &high);
                EXPECT_GE(low, .1 - 1e-6) << where << model << mode;
                EXPECT_LE(high, 1) << where << model << mode;
            }
}

// The line integral only grows with the way; noise at the surface need not.
TEST(NoiseFog, AlongTheRayOpacityGrowsWithDistance) {
    double last = 1;
    for (double depth = .1; depth < 400; depth *= 1.05) {
        const double T =
            transmittanceOf(
                fogFrame({1, 1}, depth),
                step(R"("where": "along the ray", "steps": 64, "low": 0, "octaves": 1, "range": 100)"))
                .at<cv::Vec4f>(0, 0)[0];
        ASSERT_LE(T, last + 1e-3) << depth;  // what 64 steps leave of an error
        last = T;
    }
    EXPECT_LT(last, .1);
}

// P3's product of an exponential in height and constants is exact: layered fog, also at the sky.
TEST(NoiseFog, ProductOfAnExponentialAndConstantsIsLayeredFog) {
    FramePair frame = fogFrame();
    for (int i = 0; i < frame.depth.cols; i++)
        for (int j : {1, 3, 20}) frame.depth.at<float>(j, i) = HUGE_VALF;
    const cv::Mat layered =
        transmittanceOf(frame, R"({"effect": "height_fog", "density": 0.03, "height": 2, "falloff": 0.25})");
    const cv::Mat product = transmittanceOf(
        frame,
        step(R"("where": "as a product", "density": 0.03, "x_profile": "constant", "y_profile": "exponential",
                       "y_origin": 2, "y_falloff": 0.25, "z_profile": "constant")"));
    EXPECT_LT(apart(layered, product), 2e-6);
}

// Where one axis' density grows without end, so does its mean: the sky there is hidden, and not seen again
// because the way is longer than the density's limit allows for.
TEST(NoiseFog, AProductDoesNotThinOutWithDistance) {
    for (float distance : {1e4f, 1e9f, 1e20f, HUGE_VALF}) {
        FramePair frame = fogFrame();
        frame.depth.setTo(distance);
        cv::Mat red;
        cv::extractChannel(
            transmittanceOf(
                frame,
                step(
                    R"("where": "as a product", "model": "power", "power_distance": 0.05, "power_exponent": 0.45,
                        "x_density": 0.0006, "y_density": 0.03, "y_profile": "constant", "max_opacity": 1,
                        "z_profile": "exponential", "z_density": 1e-6, "z_falloff": 0.5)")),
            red, 0);
        EXPECT_EQ(cv::countNonZero(red > 1e-6), 0) << distance;
    }
}

// Noise that drifts for t with the wind is noise seen from a camera moved by -wind·t.
TEST(NoiseFog, WindMovesTheNoiseAsTheCameraWould) {
    for (std::string where : everywhere) {
        const std::string fog = step(where + R"(, "wind": [2, -1, 0.5], "y_profile": "noise")");
        FramePair later = fogFrame(), moved = fogFrame();
        later.time = 16;
        for (int k = 0; k < 3; k++) moved.camera.worldFromCamera(k, 3) -= 16 * cv::Vec3d(2, -1, .5)[k];
        EXPECT_LT(apart(transmittanceOf(later, fog), transmittanceOf(moved, fog)), 1e-6) << where;
        EXPECT_GT(apart(transmittanceOf(later, fog), transmittanceOf(fogFrame(), fog)), .01) << where;
    }
}

// It repeats after tile·size metres, however far that is, procedural or baked.
TEST(NoiseFog, FarOriginsLoseNothing) {
    for (std::string method : {"procedural", "baked"})
        for (std::string where : everywhere)
            for (double far : {160., 1.6e6, -1.6e7}) {
                const std::string fog =
                    R"({"effect": "noise_fog", "x_profile": "noise", "y_profile": "constant", "resolution": "64", "method": ")" +
                    method + "\", " + where + "}";
                FramePair frame = fogFrame();
                for (int axis : {0, 2}) frame.camera.worldFromCamera(axis, 3) += far;
                EXPECT_LT(apart(transmittanceOf(frame, fog), transmittanceOf(fogFrame(), fog)), 1e-6)
                    << method << where << far;
            }
}

TEST(NoiseFog, GroundNoiseIsTheSameAtEveryHeight) {
    const std::string fog = step(R"("extent": "ground")");
    FramePair high = fogFrame();
    high.camera.worldFromCamera(1, 3) += 37.3;
    EXPECT_LT(apart(transmittanceOf(high, fog), transmittanceOf(fogFrame(), fog)), 1e-7);
    EXPECT_GT(apart(transmittanceOf(high, step("")), transmittanceOf(fogFrame(), step(""))), .01);
}

// P5: clear at the eye's height, denser above and below.
TEST(NoiseFog, OceanIsClearAtTheEyesHeight) {
    FramePair frame = fogFrame({9, 9}, 100);
    frame.camera.worldFromCamera = Camera::standing(20, 0);
    const cv::Mat T = transmittanceOf(frame, step(R"("mode": "ocean", "density": 0.02)"));
    EXPECT_NEAR(T.at<cv::Vec4f>(4, 4)[0], std::exp(-.02 * 100 * .001), 1e-5);
    EXPECT_LT(T.at<cv::Vec4f>(0, 4)[0], .1);
    EXPECT_LT(T.at<cv::Vec4f>(8, 4)[0], .1);
}

// --- methods

ReferenceNoise referenceNoise(const NoiseFog& p) { return {p, {1.3, 1.6, -.4}, 0}; }

TEST(NoiseFogMethods, MarchConvergesAtOrderTwo) {
    NoiseFog p;
    p.size = 20, p.octaves = 1, p.tile = 16;
    for (int kind : {0, 1}) {
        p.noise = kind;
        const ReferenceNoise noise = referenceNoise(p);
        std::vector<double> sizes, errors;
        for (int steps : {16, 32, 64, 128, 256}) {
            double squares = 0;
            for (int ray = 0; ray < 8; ray++) {
                const cv::Vec3d d = cv::normalize(cv::Vec3d(.3 * ray - 1, .2, -1));
                const double truth = noise.meanAlong(d, 60);
                const double mean =
                    midpointMean(60., steps, [&](double s) { return noise.at(noise.cells(d * s)); });
                squares += (mean - truth) * (mean - truth);
            }
            sizes.push_back(1. / steps), errors.push_back(std::sqrt(squares));
        }
        EXPECT_NEAR(fittedOrder(sizes, errors), 2, .15) << kind;
    }
}

// MODELS.md §4: 12 / 3.3 / .85 / .2 % of the noise's deviation at 4 / 8 / 16 / 32 texels a cell.
TEST(NoiseFogMethods, BakedNoiseErrsAsMeasured) {
    const std::map<int, double> expected = {{4, .12}, {8, .033}, {16, .0085}, {32, .002}};
    for (auto [texels, share] : expected) {
        const int tile = 4, edge = tile * texels;
        std::vector<float> volume;
        for (double v : bakeNoise(NoiseKind::Perlin, 1, tile, edge, 0, 5)) volume.push_back(float(v));
        std::mt19937 random(4);
        std::uniform_real_distribution<double> place(0, tile);
        double squares = 0, sum = 0, sumSquares = 0;
        const int samples = 20000;
        for (int k = 0; k < samples; k++) {
            const cv::Vec3d q(place(random), place(random), place(random));
            const double truth = reference::noise(NoiseKind::Perlin, q, 1, tile, 5);
            const cv::Vec3f t(q * double(texels));
            const double baked = volumeNoise(volume.data(), edge, t[0], t[1], t[2], 0, 0, 0);
            squares += (baked - truth) * (baked - truth), sum += truth, sumSquares += truth * truth;
        }
        const double deviation = std::sqrt(sumSquares / samples - sum * sum / samples / samples);
        EXPECT_NEAR(std::sqrt(squares / samples) / deviation, share, .25 * share) << texels;
    }
}

// The volume wraps without a seam, its texels are the noise, and Pascal's rows keep its mean and calm it.
TEST(NoiseFogMethods, VolumeTilesAndSmoothingKeepsItsMean) {
    const int edge = 32, tile = 8;
    std::vector<double> last;
    for (int smoothing : {0, 1, 2}) {
        const auto volume = bakeNoise(NoiseKind::Simplex, 2, tile, edge, smoothing, 9);
        double sum = 0, squares = 0;
        for (double v : volume) sum += v, squares += v * v;
        const double mean = sum / double(volume.size());
        const double variance = squares / double(volume.size()) - mean * mean;
        if (!last.empty()) {
            EXPECT_NEAR(mean, last[0], 1e-12);
            EXPECT_LT(variance, .9 * last[1]);
        }
        last = {mean, variance};
        const std::vector<float> floats(volume.begin(), volume.end());
        for (float x : {.2f, 7.9f, 31.5f})
            EXPECT_FLOAT_EQ(volumeNoise(floats.data(), edge, x, 3, 4, 0, 0, 0),
                            volumeNoise(floats.data(), edge, x - 32, 35, 4, 0, 0, 64));
    }
    const auto plain = bakeNoise(NoiseKind::Simplex, 2, tile, edge, 0, 9);
    EXPECT_NEAR(plain[(5 * edge + 7) * edge + 30],
                reference::noise(NoiseKind::Simplex, {30 * .25, 7 * .25, 5 * .25}, 2, tile, 9), 1e-12);
}

// P3's product of means is no line integral: in-phase cosines give 1 for a true 3/2, on average over whole
// periods.
TEST(NoiseFogMethods, ProductOfMeansIsNotTheLineIntegral) {
    double lineIntegral = 0, meanX = 0, meanZ = 0;
    const int steps = 1000;
    for (int k = 0; k < steps; k++) {
        const double factor = 1 + std::cos(2 * CV_PI * (k + .5) / steps);
        lineIntegral += factor * factor / steps, meanX += factor / steps, meanZ += factor / steps;
    }
    EXPECT_NEAR(lineIntegral, 1.5, 1e-9);
    EXPECT_NEAR(meanX * meanZ, 1, 1e-9);
    // and so for the effect's own axes: a ramp up and a ramp up, along the diagonal
    NoiseFog p;
    p.xProfile = p.zProfile = rampAxis;
    p.points = {{0, 0, 0}, {0, 10, 1}, {2, 0, 0}, {2, 10, 1}};
    const ReferenceProduct product(p, {0, 0, 0}, 0);
    EXPECT_NEAR(product.mean({std::sqrt(.5), 0, std::sqrt(.5)}, 10 * std::sqrt(2.)), .25, 1e-9);  // truly 1/3
}

// The check grants methods their own error; here they are held to themselves, in fp64.
TEST(NoiseFogMethods, InFp32AreThemselvesInFp64) {
    FramePair frame = fogFrame({32, 18});
    frame.time = 2.5;
    turn(frame.camera, 25, -8);
    double worst = 0;
    for (const std::string parameters :
         {R"("method": "baked", "resolution": "32", "smoothing": 2)",
          R"("method": "baked", "resolution": "64", "smoothing": 0, "noise": "simplex")",
          R"("method": "baked", "resolution": "32", "where": "along the ray", "steps": 7)",
          R"("method": "procedural", "resolution": "32", "smoothing": 1, "noise": "simplex")",
          R"("method": "procedural", "resolution": "32", "smoothing": 2)",
          R"("method": "procedural", "where": "along the ray", "steps": 5, "noise": "simplex")",
          R"("method": "procedural", "where": "along the ray", "steps": 9, "octaves": 2)"}) {
        const std::string fog =
            R"({"effect": "noise_fog", "density": 0.01, "size": 8, "wind": [1, 0.5, -2], )" + parameters +
            "}";
        const Chain chain = parsePreset("{\"effects\": [" + fog + "]}", "test", EffectRegistry::standard());
        const auto params = chain.steps[0].effect->plugin->makeParams(chain.steps[0].values);
        const NoiseFog& p = *static_cast<const NoiseFog*>(params.get());
        const ReferenceNoise noise{p, frame.camera.eye(), frame.time};
        const cv::Mat T = transmittanceOf(frame, fog);
        for (int k = 0; k < int(T.total()); k += 3) {
            const int i = k % T.cols, j = k / T.cols;
            const cv::Vec3d ray = frame.camera.ray(i, j);
            const double length = cv::norm(ray), L = double(frame.depth.at<float>(j, i)) * length;
            const auto& m = frame.camera.worldFromCamera;
            const cv::Vec3d d = m.get_minor<3, 3>(0, 0) * ray / length;
            const double reach = std::min(L, double(p.range)), share = reach / L;
            const double n = p.where == atTheSurface ? noise.byMethod(noise.cells(d * L))
                                                     : .5 + share * (noise.middleMean(d, reach) - .5);
            const double depth = p.density * L * relativeDensity(p, n, L * d[1]);
            worst = std::max(worst, std::abs(T.at<cv::Vec4f>(j, i)[0] - std::exp(-depth)));
        }
    }
    EXPECT_LT(worst, 2e-6);  // measured: 6.9e-7
}

}  // namespace
}  // namespace brume
