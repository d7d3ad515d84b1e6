// Theorems of fog_blur; parity and reference over many frames are driven by the registry.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core/utility.hpp>

#include "apply/apply.hpp"
#include "cpu/cpu_runner.hpp"
#include "effect/preset.hpp"
#include "effects/blur_theorems.hpp"
#include "gl/gl_runner.hpp"

using namespace brume;
using blur_test::difference;
using blur_test::randomImage;

static cv::Mat constant(cv::Size size, float value) {
    return cv::Mat(size, CV_32FC4, cv::Scalar::all(value));
}

static cv::Mat blurOn(Runner& runner, const cv::Mat& image, const cv::Mat& transmittance,
                      const std::string& parameters, const cv::Mat& clear = {}) {
    FramePair frame;
    frame.color = image;
    frame.depth = cv::Mat(image.size(), CV_32F, cv::Scalar(10));
    frame.camera = Camera::withHorizontalView(image.size(), 90);
    frame.images["through"] = transmittance;
    frame.images["before"] = clear.empty() ? image : clear;
    Chain chain = parsePreset("{\"effects\": [{\"effect\": \"fog_blur\", " + parameters + "}]}", "test",
                              EffectRegistry::standard());
    chain.steps[0].values["transmittance"].text = "through";
    chain.steps[0].values["clear"].text = "before";
    chain = planChain(chain, frame, runner.backend(), {});
    return runner.run(chain, frame, {}).images["color"].clone();
}
static cv::Mat blurred(const cv::Mat& image, const cv::Mat& transmittance, const std::string& parameters,
                       const cv::Mat& clear = {}) {
    static auto runner = makeCpuRunner();
    return blurOn(*runner, image, transmittance, parameters, clear);
}

// The L1 norm of the difference to a Gaussian, of the response to an impulse under even fog.
static double errorUnderEvenFog(double radius, double share, const std::string& method, double opacity = -1,
                                const std::string& more = "") {
    const double sigma = radius * share;
    const int reach = int(6 * sigma) + 6, size = 2 * reach + 1;
    cv::Mat impulse = constant({size, size}, 0);
    impulse.at<cv::Vec4f>(reach, reach) = {1, 1, 1, 1};
    std::string parameters =
        "\"edges\": \"bleed\", \"method\": \"" + method + "\", \"radius\": " + std::to_string(radius) + more;
    cv::Mat response =
        blurred(impulse, constant({size, size}, float(1 - (opacity < 0 ? share : opacity))), parameters);
    double error = 0, sum = 0;
    auto weight = [&](int i, int j) {
        double x = i - reach, y = j - reach;
        return std::exp(-(x * x + y * y) / (2 * sigma * sigma));
    };
    for (int j = 0; j < size; j++)
        for (int i = 0; i < size; i++) sum += weight(i, j);
    for (int j = 0; j < size; j++)
        for (int i = 0; i < size; i++)
            error += std::abs(response.at<cv::Vec4f>(j, i)[0] - weight(i, j) / sum);
    return error;
}

TEST(FogBlur, LaddersAreNearAGaussianAtEveryStrength) {
    for (const auto& [rungs, most] :
         {std::pair("1", .02), std::pair("2", .004), std::pair("4", .001), std::pair("8", .001)}) {
        double worst = 0;
        for (double radius : {.3, 1., 3., 4., 8., 13.})
            for (double share = .03; share <= 1; share *= 1.13) {
                double error =
                    errorUnderEvenFog(radius, share, std::string("ladder\", \"rungs\": \"") + rungs);
                EXPECT_LE(error, most) << rungs << " " << radius << " " << share;
                worst = std::max(worst, error);
            }
        RecordProperty(std::string("rungs") + rungs, std::to_string(worst));
    }
}

TEST(FogBlur, GatherIsAGaussian) {
    for (double share : {.1, .5, 1.}) EXPECT_LE(errorUnderEvenFog(5, share, "gather"), 7e-4) << share;
}

// Weights of so wide a row did not fit what they were written to.
TEST(FogBlur, GatherTakesTheWidestBlur) {
    const cv::Mat image = constant({700, 3}, .25f), fog = constant(image.size(), 0);
    EXPECT_LE(difference(blurred(image, fog, R"("radius": 64, "method": "gather")"), image), 1e-5);
}

// σ = σmax·((α - α0)/(1 - α0))^p, MODELS.md §8.
TEST(FogBlur, StartAndFalloffShapeTheBlur) {
    for (double opacity : {.5, .8, 1.})
        for (const char* method : {"gather", "ladder"}) {
            const double share = std::pow((opacity - .3) / .7, 2);
            EXPECT_LE(errorUnderEvenFog(8, share, method, opacity, R"(, "start": 0.3, "falloff": 2)"),
                      method[0] == 'g' ? 7e-4 : .02)
                << method << opacity;
        }
}

TEST(FogBlur, WithoutFogNothingChanges) {
    cv::Mat image = randomImage({70, 40}, 1);
    for (const char* method : {"ladder", "gather", "ladder\", \"rungs\": \"4"})
        for (const char* order : {"separate", "single"}) {
            std::string parameters =
                std::string("\"radius\": 9, \"method\": \"") + method + "\", \"order\": \"" + order + "\"";
            cv::Mat out = blurred(image, constant(image.size(), 1), parameters);
            EXPECT_EQ(cv::countNonZero(out.reshape(1) != image.reshape(1)), 0) << method << order;
        }
}

TEST(FogBlur, ConstantsAreKeptUnderAnyFog) {
    cv::Mat image(50, 60, CV_32FC4, cv::Scalar(.3, 5, 1000, .5)), fog = randomImage(image.size(), 2) * .5;
    for (const char* edges : {"keep", "bleed"})
        for (const char* method : {"ladder", "gather", "ladder\", \"rungs\": \"4"}) {
            std::string parameters =
                std::string("\"radius\": 7, \"method\": \"") + method + "\", \"edges\": \"" + edges + "\"";
            EXPECT_LE(difference(blurred(image, fog, parameters), image), 1e-5) << edges << method;
        }
}

// A near wall without fog in front of a dark, foggy distance.
TEST(FogBlur, ANearSurfaceDoesNotBleedOverItsSilhouetteWhereEdgesAreKept) {
    cv::Mat image = constant({80, 40}, .1f), fog = constant({80, 40}, .2f);
    image.colRange(0, 40).setTo(cv::Scalar::all(1));
    fog.colRange(0, 40).setTo(cv::Scalar::all(1));
    for (const char* method : {"ladder", "gather", "ladder\", \"rungs\": \"4"}) {
        std::string parameters = std::string("\"radius\": 6, \"method\": \"") + method + "\", \"edges\": ";
        cv::Mat kept = blurred(image, fog, parameters + "\"keep\""),
                bled = blurred(image, fog, parameters + "\"bleed\"");
        EXPECT_LE(difference(kept, image), 2e-6) << method;
        EXPECT_GT(bled.at<cv::Vec4f>(20, 40)[0], .45) << method << ": half of the wall";
        EXPECT_NEAR(bled.at<cv::Vec4f>(20, 39)[0], 1, 1e-6) << "the wall itself is not in fog";
    }
}

TEST(FogBlur, LadderAndGatherAgreeOnAnUnevenFog) {
    cv::Mat image = randomImage({90, 60}, 3), fog(image.size(), CV_32FC4);
    for (int j = 0; j < fog.rows; j++)
        for (int i = 0; i < fog.cols; i++)
            fog.at<cv::Vec4f>(j, i) = cv::Vec4f::all(1 - float(i) / 90 * float(j) / 60);
    for (const char* edges : {"keep", "bleed"}) {
        std::string parameters = std::string("\"radius\": 8, \"edges\": \"") + edges + "\", \"method\": ";
        cv::Mat ladder = blurred(image, fog, parameters + "\"ladder\""),
                gather = blurred(image, fog, parameters + "\"gather\"");
        EXPECT_LE(difference(ladder, gather), .02) << edges;
    }
}

// single: fog over the blurred clear picture, whatever the fog's own light.
TEST(FogBlur, ASinglePassIsFogOverABlurredClearPicture) {
    cv::Mat clear = randomImage({60, 44}, 4), through = randomImage(clear.size(), 5) * .5, foggy, expected;
    cv::multiply(clear, through, foggy);
    cv::Mat airlight = (constant(clear.size(), 1) - through) * .7;
    foggy += airlight;
    cv::Mat single = blurred(foggy, through, R"("radius": 5, "order": "single")", clear);
    cv::Mat blurredClear = blurred(clear, through, R"("radius": 5, "order": "separate")");
    cv::multiply(blurredClear, through, expected);
    expected += airlight;
    cv::Mat separate = blurred(foggy, through, R"("radius": 5, "order": "separate")");
    cv::mixChannels({foggy}, {expected}, {3, 3});
    EXPECT_LE(difference(single, expected), 2e-6);
    EXPECT_GT(difference(separate, single), .01) << "the two orders are different operators";
}

TEST(FogBlur, OneBadPixelDoesNotSpread) {
    cv::Mat image = randomImage({41, 30}, 6), fog = constant(image.size(), 0), bounded = image.clone();
    image.at<cv::Vec4f>(15, 20)[0] = std::nanf("");
    bounded.at<cv::Vec4f>(15, 20)[0] = 0;
    image.at<cv::Vec4f>(3, 7)[1] = HUGE_VALF;
    bounded.at<cv::Vec4f>(3, 7)[1] = 65504;
    for (const char* method : {"ladder", "gather", "ladder\", \"rungs\": \"4"}) {
        std::string parameters = std::string("\"radius\": 4, \"method\": \"") + method + "\"";
        cv::Mat a = blurred(image, fog, parameters), b = blurred(bounded, fog, parameters);
        EXPECT_EQ(cv::norm(a.reshape(1), b.reshape(1), cv::NORM_INF), 0) << method;
    }
}

TEST(FogBlur, SameBitsOnAnyNumberOfThreads) {
    cv::Mat image = randomImage({401, 217}, 7), fog = randomImage(image.size(), 8) * .5, first;
    int threads = cv::getNumThreads();
    for (int n : {1, 2, 5}) {
        cv::setNumThreads(n);
        cv::Mat out = blurred(image, fog, R"("radius": 12)");
        if (first.empty()) first = out;
        EXPECT_EQ(cv::countNonZero(out.reshape(1) != first.reshape(1)), 0) << n;
    }
    cv::setNumThreads(threads);
}

TEST(FogBlur, GlslMatches) {
    cv::Mat image = randomImage({57, 33}, 9), fog = randomImage(image.size(), 10) * .5;
    auto gl = makeGlRunner(GlPlatform::Osmesa);
    for (const char* parameters : {R"("radius": 9)", R"("radius": 3, "edges": "bleed", "order": "single")",
                                   R"("radius": 2, "method": "gather")", R"("radius": 9, "rungs": "4")"}) {
        cv::Mat a = blurOn(*gl, image, fog, parameters), b = blurred(image, fog, parameters);
        EXPECT_LE(difference(a, b), 3e-5) << parameters;
    }
}

// Levels are made only where some pixel needs them: in parts of rows, of columns, or nowhere.
TEST(FogBlur, GlslMatchesWhereFogComesAndGoesInALargerPicture) {
    cv::Mat image = randomImage({391, 150}, 11), fog(image.size(), CV_32FC4);
    auto gl = makeGlRunner(GlPlatform::Osmesa);
    auto fill = [&](auto through) {
        for (int j = 0; j < fog.rows; j++)
            for (int i = 0; i < fog.cols; i++) fog.at<cv::Vec4f>(j, i) = cv::Vec4f::all(float(through(i, j)));
    };
    auto expectSame = [&](const char* what) {
        for (const char* parameters :
             {R"("radius": 24)", R"("radius": 5, "edges": "bleed")", R"("radius": 24, "rungs": "4")"}) {
            cv::Mat a = blurOn(*gl, image, fog, parameters), b = blurred(image, fog, parameters);
            EXPECT_LE(difference(a, b), 3e-5) << what << " " << parameters;
        }
    };
    fill([](int, int j) { return std::min(1., j / 75.); });
    expectSame("thins out downwards");
    fill([](int i, int) { return i < 140 ? 1. : i < 280 ? .8 : 0.; });
    expectSame("in columns");
    fill([](int i, int j) { return i > 250 && j > 60 && j < 70 ? 0. : 1.; });
    expectSame("in one patch");
}

// Half an 8-bit step is the whole of a chain's tolerance: the ladder's .02 shows beside a light.
TEST(FogBlur, AutoTakesTheCheapestWhoseErrorDoesNotShow) {
    const cv::Size size(64, 48);
    cv::Mat through(size, CV_32FC4);
    for (int i = 0; i < size.width; i++) through.col(i).setTo(cv::Scalar::all(i / 64.));
    auto lampIn = [&](double brightest) {
        cv::Mat image = constant(size, 0);
        image.at<cv::Vec4f>(24, 32) = cv::Vec4f::all(float(brightest));
        return image;
    };
    auto chosenFor = [&](const cv::Mat& image) {
        Chain chain = parsePreset(
            R"({"effects": [{"effect": "fog_blur", "method": "auto", "rungs": "auto", "radius": 8}]})",
            "test", EffectRegistry::standard());
        chain.steps[0].values["transmittance"].text = "through";
        FramePair frame;
        frame.color = image;
        frame.images["through"] = through;
        frame.depth = cv::Mat(size, CV_32F, cv::Scalar(10));
        frame.camera = Camera::withHorizontalView(size, 90);
        std::vector<StepPlan> decisions;
        planChain(chain, frame, Backend::Cpu, {}, &decisions);
        return decisions.at(0).plan.chosen;
    };
    auto shows = [&](const cv::Mat& image, const std::string& method) {
        const std::string radius = "\"radius\": 8, \"method\": ";
        cv::Mat tried = blurred(image, through, radius + method),
                exact = blurred(image, through, radius + "\"gather\"");
        double worst = 0;
        for (int j = 0; j < size.height; j++)
            for (int i = 0; i < size.width; i++)
                for (int n = 0; n < 3; n++)
                    worst = std::max(worst, PlanInput().visible(tried.at<cv::Vec4f>(j, i)[n],
                                                                exact.at<cv::Vec4f>(j, i)[n]));
        return worst * 510;
    };
    auto ladderOf = [](double rungs) {
        return "\"ladder\", \"rungs\": \"" + std::to_string(int(rungs)) + "\"";
    };
    int finer = 0;
    for (double brightest : {0., .004, .03, .1, .3, 1., 3., 10.}) {
        auto chosen = chosenFor(lampIn(brightest));
        const double rungs = chosen.at("rungs");
        if (brightest < .01) {
            EXPECT_EQ(chosen.at("method") + rungs, 1);
        }
        if (chosen.at("method") != 0) continue;
        EXPECT_LE(shows(lampIn(brightest), ladderOf(rungs)), 1) << brightest;
        if (rungs == 1) continue;
        EXPECT_GE(shows(lampIn(brightest), ladderOf(rungs / 2)), .8) << brightest;
        finer++;
    }
    EXPECT_GE(finer, 2);
}

// The fog says how bright it leaves what is dark; it counted as black, beside which everything shows.
TEST(FogBlur, AutoTakesTheLadderInADepthFog) {
    Chain chain = parsePreset(R"({"effects": [{"effect": "depth_fog", "color": [0.6, 0.65, 0.7]},
                                              {"effect": "fog_blur", "method": "auto", "radius": 16}]})",
                              "test", EffectRegistry::standard());
    FramePair frame;
    frame.color = randomImage({64, 48}, 1) * .1 + cv::Scalar(.5, .5, .5, 1);
    frame.depth = cv::Mat(frame.color.size(), CV_32F, cv::Scalar(100));
    frame.camera = Camera::withHorizontalView(frame.color.size(), 90);
    std::vector<StepPlan> decisions;
    planChain(chain, frame, Backend::Cpu, {}, &decisions);
    EXPECT_EQ(decisions.at(1).plan.chosen.at("method"), 0) << "gather";
}
