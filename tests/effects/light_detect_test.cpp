// Theorems of light_detect; parity and reference over many frames are driven by the registry.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "cpu/cpu_runner.hpp"
#include "effect/preset.hpp"
#include "effects/blur_theorems.hpp"
#include "gl/gl_runner.hpp"

using namespace brume;

static FramePair frameOf(const cv::Mat& color, float depth = 10) {
    FramePair frame;
    frame.color = color;
    frame.depth = cv::Mat(color.size(), CV_32F, cv::Scalar(depth));
    frame.camera = Camera::withHorizontalView(color.size(), 90);
    return frame;
}
static cv::Mat detect(Runner& runner, const FramePair& frame, const std::string& parameters) {
    std::string preset =
        "{\"effects\": [{\"effect\": \"light_detect\", \"output\": \"lights\", " + parameters + "}]}";
    Chain chain = parsePreset(preset, "test", EffectRegistry::standard());
    return runner.run(chain, frame, {"lights"}).images["lights"].clone();
}
static cv::Mat detect(const FramePair& frame, const std::string& parameters) {
    return detect(*makeCpuRunner(), frame, parameters);
}
static cv::Vec4f detectOne(cv::Vec4f color, float depth, const std::string& parameters) {
    return detect(frameOf(cv::Mat(1, 1, CV_32FC4, cv::Scalar(color)), depth), parameters).at<cv::Vec4f>(0, 0);
}

static double encoded(double x) { return x <= .0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - .055; }

TEST(LightDetect, AHardThresholdKeepsWhatIsBrighterAndNothingElse) {
    cv::Mat image = blur_test::randomImage({97, 41}, 1);
    for (const char* luminance : {"encoded 601", "linear 709"}) {
        cv::Mat lights =
            detect(frameOf(image), std::string("\"threshold\": 0.9, \"luminance\": \"") + luminance + "\"");
        int kept = 0;
        for (int j = 0; j < image.rows; j++)
            for (int i = 0; i < image.cols; i++) {
                cv::Vec4f c = image.at<cv::Vec4f>(j, i), light = lights.at<cv::Vec4f>(j, i);
                double b = luminance[0] == 'e'
                               ? .299 * encoded(c[0]) + .587 * encoded(c[1]) + .114 * encoded(c[2])
                               : .2126 * c[0] + .7152 * c[1] + .0722 * c[2];
                if (std::abs(b - .9) <= 2e-6) continue;
                for (int n = 0; n < 3; n++) ASSERT_NEAR(light[n], b > .9 ? c[n] : 0, 1e-6) << b;
                kept += b > .9;
            }
        EXPECT_GT(kept, 100);
    }
}

TEST(LightDetect, ASoftKneeIsContinuousGrowsAndMeetsBothEnds) {
    float last = 0;
    for (float value = .2f; value < 2; value *= 1.001f) {
        float light = detectOne({value, value, value, 1}, 5,
                                R"("luminance": "linear 709", "threshold": 0.8, "knee": 0.3)")[0];
        EXPECT_GE(light, last);
        EXPECT_LE(light - last, .004f) << value;
        if (value < .499f) {
            EXPECT_EQ(light, 0);
        }
        if (value > 1.101f) {
            EXPECT_NEAR(light, value - .8f, 1e-6);
        }
        last = light;
    }
}

// weight max(s²/4k, B - t)/B with s = clamp(B - t + k, 0, 2k), MODELS.md §7: a quarter of the knee at the
// threshold.
TEST(LightDetect, TheKneeIsTheModelsParabola) {
    for (float value : {.55f, .7f, .8f, .9f, 1.05f}) {
        const double s = value - .8 + .3;
        EXPECT_NEAR(detectOne({value, value, value, 1}, 5,
                              R"("luminance": "linear 709", "threshold": 0.8, "knee": 0.3)")[0],
                    s * s / (4 * .3), 1e-6)
            << value;
    }
}

TEST(LightDetect, DistanceDimsAndDepthRangeCuts) {
    const float infinity = std::numeric_limits<float>::infinity();
    cv::Vec4f lamp(2, 1.5f, 1, 1);
    EXPECT_NEAR(detectOne(lamp, 10, R"("attenuation": 0.1)")[0], 2 * std::exp(-1), 1e-6);
    EXPECT_NEAR(detectOne(lamp, 10, R"("attenuation": 0.1, "curve": 2)")[0], 2 * std::exp(-2), 1e-6);
    // Attenuation is along the ray: at the edge of a view of 90 degrees that is longer than the depth.
    const FramePair wide = frameOf(cv::Mat(1, 9, CV_32FC4, cv::Scalar(lamp)), 10);
    EXPECT_NEAR(detect(wide, R"("attenuation": 0.1)").at<cv::Vec4f>(0, 0)[0],
                2 * std::exp(-std::sqrt(1 + 64. / 81)), 1e-6);
    EXPECT_EQ(detectOne(lamp, 10, R"("near": 10.1)")[0], 0);
    EXPECT_EQ(detectOne(lamp, 10, R"("far": 9.9)")[0], 0);
    EXPECT_EQ(detectOne(lamp, 10, R"("near": 9.9, "far": 10.1)")[0], 2);
    EXPECT_EQ(detectOne(lamp, infinity, R"("attenuation": 0)")[0], 2)
        << "the sky's lights, where nothing dims";
    EXPECT_LT(detectOne(lamp, infinity, R"("attenuation": 1e-6)")[0], 1e-30);
    EXPECT_EQ(detectOne(lamp, infinity, R"("far": 1e7)")[0], 0);
}

TEST(LightDetect, SaturationIntensityAndLimitShapeTheLight) {
    cv::Vec4f lamp(2, 1, .5f, .25f);
    auto grey = detectOne(lamp, 1, R"("saturation": 0)");
    double luminance = .2126 * 2 + .7152 * 1 + .0722 * .5;
    for (int n = 0; n < 3; n++) EXPECT_NEAR(grey[n], luminance, 1e-6);
    EXPECT_NEAR(detectOne(lamp, 1, R"("intensity": 3)")[1], 3, 1e-6);
    auto limited = detectOne(lamp, 1, R"("limit": 1)");
    EXPECT_NEAR(limited[0], 1, 1e-6);
    EXPECT_NEAR(limited[1], .5, 1e-6);
    EXPECT_EQ(detectOne(lamp, 1, R"("threshold": 5)"), cv::Vec4f(0, 0, 0, .25f)) << "alpha is the picture's";
}

TEST(LightDetect, BadPixelsAreDarkOrBounded) {
    const float infinity = std::numeric_limits<float>::infinity();
    EXPECT_EQ(detectOne({std::nanf(""), 0, 0, 1}, 1, R"("threshold": 0.1)"), cv::Vec4f(0, 0, 0, 1));
    EXPECT_EQ(detectOne({infinity, 0, 0, 1}, 1, R"("threshold": 0.1)"), cv::Vec4f(65504, 0, 0, 1));
    EXPECT_EQ(detectOne({-infinity, 0, 0, 1}, 1, R"("threshold": 0.1)"), cv::Vec4f(0, 0, 0, 1));
}

TEST(LightDetect, AReducedResolutionIsTheAreaMean) {
    cv::Mat image = blur_test::randomImage({64, 40}, 2),
            full = detect(frameOf(image), R"("reduction": "full")"), mean;
    for (auto [name, factor] : {std::pair("half", 2), std::pair("quarter", 4), std::pair("eighth", 8)}) {
        cv::Mat reduced = detect(frameOf(image), std::string("\"reduction\": \"") + name + "\"");
        cv::resize(full, mean, {64 / factor, 40 / factor}, 0, 0, cv::INTER_AREA);
        ASSERT_EQ(reduced.size(), mean.size());
        EXPECT_LE(blur_test::difference(reduced, mean), 1e-6);
    }
    for (cv::Size odd :
         {cv::Size(1, 1), cv::Size(3, 50), cv::Size(97, 41)}) {  // nothing is lost at odd sizes
        cv::Mat constant(odd, CV_32FC4, cv::Scalar(1, 2, 3, 1));
        cv::Mat reduced = detect(frameOf(constant), R"("reduction": "quarter")");
        for (int j = 0; j < reduced.rows; j++)
            for (int i = 0; i < reduced.cols; i++)
                EXPECT_EQ(reduced.at<cv::Vec4f>(j, i), cv::Vec4f(1, 2, 3, 1));
    }
}

// One bilinear tap a quarter pixel would miss most positions of a small light.
TEST(LightDetect, ASmallLightGivesTheSameLightWhereverItLies) {
    for (int y = 0; y < 4; y++)
        for (int x = 0; x < 4; x++) {
            cv::Mat image(16, 16, CV_32FC4, cv::Scalar(0, 0, 0, 1));
            image.at<cv::Vec4f>(4 + y, 8 + x) = {16, 8, 4, 1};
            cv::Mat lights = detect(frameOf(image), R"("reduction": "quarter")");
            EXPECT_EQ(lights.at<cv::Vec4f>(1, 2), cv::Vec4f(1, .5f, .25f, 1));
        }
}

// A light that only one side sees would spread over a whole blur: the CPU's lights go through both.
TEST(LightDetect, BlursOfTheCpusLightsAgree) {
    const cv::Mat lights =
        detect(frameOf(blur_test::randomImage({61, 35}, 3)), R"("threshold": 0.8, "intensity": 8)");
    for (const char* effect : {"bessel_blur", "gaussian_blur"})
        for (double radius : {1.5, 5., 12.}) {
            const blur_test::Blur blur{effect, "auto", radius};
            const cv::Mat gl = blur_test::onGl(blur, lights), cpu = blur_test::onCpu(blur, lights);
            double worst = 0;
            for (int j = 0; j < cpu.rows; j++)
                for (int i = 0; i < 4 * cpu.cols; i++) {
                    const double a = gl.ptr<float>(j)[i], b = cpu.ptr<float>(j)[i];
                    worst = std::max(worst, std::abs(a - b) / (2e-6 + 3e-5 * std::abs(b)));
                }
            EXPECT_LE(worst, 1) << effect << " " << radius;
        }
}

TEST(LightDetect, GlslAgreesAboutEveryLightNotOnTheThreshold) {
    cv::Mat image = blur_test::randomImage({61, 35}, 3);
    auto gl = makeGlRunner(GlPlatform::Osmesa);
    auto cpu = makeCpuRunner();
    for (const char* parameters :
         {R"("threshold": 0.8)", R"("threshold": 0.8, "knee": 0.2, "reduction": "half")"}) {
        cv::Mat a = detect(*gl, frameOf(image), parameters), b = detect(*cpu, frameOf(image), parameters);
        for (int j = 0; j < b.rows; j++)
            for (int i = 0; i < b.cols; i++) {
                cv::Vec4f c = image.at<cv::Vec4f>(j, i);
                double brightness = .299 * encoded(c[0]) + .587 * encoded(c[1]) + .114 * encoded(c[2]);
                if (a.size() == image.size() && std::abs(brightness - .8) <= 2e-6) continue;
                for (int n = 0; n < 4; n++) {
                    double x = a.at<cv::Vec4f>(j, i)[n], y = b.at<cv::Vec4f>(j, i)[n];
                    ASSERT_LE(std::abs(x - y), 2e-6 + 3e-5 * std::abs(y))
                        << parameters << " " << i << " " << j;
                }
            }
    }
}

// Images larger than the caches are written past them, and stretches with a value below 0, above 128 or no
// number are measured by the whole of sRGB's curve.
TEST(LightDetect, APixelsLightIsItsOwnInLargeImagesAndBesideSpecialPixels) {
    const cv::Mat part = blur_test::randomImage({1030, 64}, 8);
    cv::Mat whole, special = part.clone();
    cv::repeat(part, 17, 1, whole);
    const char* parameters = R"("threshold": 0.4, "knee": 0.3)";
    const cv::Mat lights = detect(frameOf(part), parameters), many = detect(frameOf(whole), parameters);
    for (int k = 0; k < 17; k++)
        ASSERT_EQ(cv::norm(many.rowRange(64 * k, 64 * k + 64), lights, cv::NORM_INF), 0) << k;
    const cv::Rect place(7, 0, 1, 64);
    for (float value : {-1.f, 500.f, std::numeric_limits<float>::quiet_NaN()}) {
        special(place).setTo(cv::Scalar(value, .5, .5, 1));
        cv::Mat besides = detect(frameOf(special), parameters);
        lights(place).copyTo(besides(place));
        EXPECT_LE(blur_test::difference(besides, lights), 1e-6) << value;  // measured: 3e-7
    }
}
