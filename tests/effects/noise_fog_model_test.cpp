// noise_fog's models as MODELS.md prints them, by code of the test's own, where the noise is known: it is 1/2
// beyond 4096 cells. And, from the picture alone, that colour and density follow one noise.
#include "error.hpp"
#include "fog_fixture.hpp"
#include "gl/gl_runner.hpp"

namespace brume {
namespace {

std::vector<cv::Mat> onBoth(const FramePair& frame, const std::string& step,
                            const std::string& image = "color") {
    static const auto cpu = makeCpuRunner(), gl = makeGlRunner();
    const Chain chain = parsePreset("{\"effects\": [" + step + "]}", "test", EffectRegistry::standard());
    std::vector<cv::Mat> images;
    for (Runner* runner : {cpu.get(), gl.get()})
        images.push_back(runner->run(chain, frame, {"transmittance"}).images.at(image).clone());
    return images;
}

TEST(NoiseFogModel, EveryModelAndModeIsTheFormula) {
    FramePair frame = fogFrame({12, 8});
    cv::RNG(4).fill(frame.depth, cv::RNG::UNIFORM, 210, 500);
    frame.camera.worldFromCamera = Camera::standing(1.6, -3);
    const cv::Vec3d color(.6, .5, .4), high(.2, .9, .3), sunColor(1, .5, .2), sun(.48, .6, -.64);
    const double n = .5;
    for (const std::string model : {"exponential", "power"})
        for (const std::string mode : {"modulate", "ocean", "additive", "subtractive"})
            for (const cv::Mat& out : onBoth(
                     frame, text(R"({"effect": "noise_fog", "method": "procedural", "where": "at the surface",
                "size": 0.05, "low": 0.3, "high": 2, "strength": 0.8, "start": 150, "density": 0.004,
                "power_distance": 900, "power_exponent": 0.7, "max_opacity": 0.85, "color": [0.6, 0.5, 0.4],
                "color_high": [0.2, 0.9, 0.3], "sun_color": [1, 0.5, 0.2], "sun_direction": [0.48, 0.6, -0.64],
                "sun_exponent": 3, "model": ")",
                                 model, R"(", "mode": ")", mode, "\"}")))
                for (int k = 0; k < 96; k++) {
                    const cv::Vec3d ray = frame.camera.ray(k % 12, k / 12);
                    const double L = frame.depth.at<float>(k / 12, k % 12) * cv::norm(ray);
                    const cv::Vec3d d =
                        frame.camera.worldFromCamera.get_minor<3, 3>(0, 0) * ray * (1 / cv::norm(ray));
                    const double climb = d[1] * L, x = std::max(0., L - 150);
                    const double relative = mode == "modulate"   ? .3 * (1 - n) + 2 * n
                                            : mode == "ocean"    ? n * climb * climb / 2 + .001
                                            : mode == "additive" ? 1 + .8 * n
                                                                 : 1 - .8 * n;
                    const double opacity =
                        std::min(.85, model == "power" ? relative * std::pow(x / 900, .7)
                                                       : 1 - std::exp(-.004 * relative * x));
                    for (int c = 0; c < 3; c++) {
                        const double A = color[c] * (1 - n) + high[c] * n +
                                         sunColor[c] * std::pow(std::max(0., d.dot(sun)), 3);
                        const double C = frame.color.at<cv::Vec4f>(k / 12, k % 12)[c];
                        ASSERT_NEAR(out.at<cv::Vec4f>(k / 12, k % 12)[c], C * (1 - opacity) + A * opacity,
                                    3e-6)
                            << model << ", " << mode << " at " << k;  // measured: 8e-7
                    }
                }
}

// The noise n that transmittance tells, by each mode; the same noise mixes the colours.
TEST(NoiseFogModel, DensityAndColourFollowTheSameNoise) {
    FramePair frame = fogFrame({12, 8}, 50);
    frame.color.setTo(0);
    const std::string fog =
        R"({"effect": "noise_fog", "method": "procedural", "density": 0.02, "size": 10, "low": 0.5,
        "high": 2, "strength": 0.8, "color": [0, 0.5, 1], "color_high": [1, 0.5, 0], "mode": ")";
    const auto T = onBoth(frame, fog + "modulate\"}", "transmittance"),
               additive = onBoth(frame, fog + "additive\"}", "transmittance"),
               subtractive = onBoth(frame, fog + "subtractive\"}", "transmittance"),
               color = onBoth(frame, fog + "modulate\"}");
    double least = 1, most = 0;
    for (size_t half = 0; half < 2; half++)
        for (int k = 0; k < 96; k++) {
            auto at = [&](const cv::Mat& image, int c = 0) {
                return double(image.at<cv::Vec4f>(k / 12, k % 12)[c]);
            };
            const double L = 50 * cv::norm(frame.camera.ray(k % 12, k / 12));
            auto relative = [&](const cv::Mat& through) { return -std::log(at(through)) / (.02 * L); };
            const double n = (relative(T[half]) - .5) / 1.5, opacity = 1 - at(T[half]);
            least = std::min(least, n), most = std::max(most, n);
            EXPECT_NEAR(relative(additive[half]), 1 + .8 * n, 1e-5);
            EXPECT_NEAR(relative(subtractive[half]), 1 - .8 * n, 1e-5);
            EXPECT_NEAR(at(color[half], 0), n * opacity, 1e-5);
            EXPECT_NEAR(at(color[half], 2), (1 - n) * opacity, 1e-5);
        }
    EXPECT_LT(least, .4);
    EXPECT_GT(most, .6);
}

}  // namespace
}  // namespace brume
