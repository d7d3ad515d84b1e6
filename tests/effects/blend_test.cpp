// Theorems of blend.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "cpu/cpu_runner.hpp"
#include "effect/preset.hpp"

using namespace brume;

namespace {

// One pixel `a` blended with `b`.
cv::Vec4f blend(cv::Vec4f a, cv::Vec4f b, const std::string& mode, float strength) {
    FramePair frame;
    frame.color = cv::Mat(1, 1, CV_32FC4, cv::Scalar(a));
    frame.depth = cv::Mat(1, 1, CV_32F, cv::Scalar(1));
    frame.camera = Camera::withHorizontalView({1, 1}, 90);
    frame.images["other"] = cv::Mat(1, 1, CV_32FC4, cv::Scalar(b));
    Chain chain = readPreset("blend", EffectRegistry::standard());
    chain.steps[0].values["second"].text = "other";
    setParameter(chain, "blend.mode", mode);
    setParameter(chain, "blend.strength", std::to_string(strength));
    return makeCpuRunner()->run(chain, frame, {}).images["color"].at<cv::Vec4f>(0, 0);
}

const cv::Vec4f a(.2f, .5f, 3, .25f), b(.4f, 0, 2, .75f);

TEST(Blend, NoStrengthIsTheIdentityWhateverTheSecondImage) {
    const float inf = HUGE_VALF;
    for (const char* mode : {"mix", "add", "screen", "multiply"})
        EXPECT_EQ(blend(a, {inf, std::nanf(""), 1, 1}, mode, 0), a) << mode;
}

TEST(Blend, FullMixIsTheSecondImageWithTheFirstOnesAlpha) {
    EXPECT_EQ(blend({HUGE_VALF, .5f, 3, .25f}, b, "mix", 1), cv::Vec4f(b[0], b[1], b[2], .25f));
}

TEST(Blend, NeutralElements) {
    EXPECT_EQ(blend(a, {1, 1, 1, 1}, "multiply", 1), a);
    EXPECT_EQ(blend(a, {0, 0, 0, 1}, "add", 1), a);
    cv::Vec4f screened = blend(a, {0, 0, 0, 1}, "screen", 1);
    for (int n = 0; n < 3; n++) EXPECT_NEAR(screened[n], a[n], 1e-6);
}

// The formulas in numbers: a = (.2, .5, 3), b = (.4, 0, 2).
TEST(Blend, EachModeIsItsFormula) {
    const struct {
        const char* mode;
        float strength;
        double wanted[3];
    } cases[] = {{"mix", 1, {.4, 0, 2}},       {"mix", .25, {.25, .375, 2.75}},  {"add", 1, {.6, .5, 5}},
                 {"add", 2.5, {1.2, .5, 8}},   {"screen", 1, {.52, .5, 3}},  // 1 - .8·.6; above 1 the larger
                 {"multiply", 1, {.08, 0, 6}}, {"multiply", .5, {.14, .25, 4.5}}};
    for (const auto& [mode, strength, wanted] : cases) {
        const cv::Vec4f out = blend(a, b, mode, strength);
        for (int n = 0; n < 3; n++) EXPECT_NEAR(out[n], wanted[n], 1e-6) << mode << " " << strength;
        EXPECT_EQ(out[3], a[3]);
    }
}

TEST(Blend, ScreenNeverDarkensAndCommutes) {
    for (float x : {0.f, .3f, 1.f, 2.f, 50.f})
        for (float y : {0.f, .6f, 1.f, 3.f, 40.f}) {
            float screened = blend({x, x, x, 1}, {y, y, y, 1}, "screen", 1)[0];
            EXPECT_GE(screened, std::max(x, y) - 1e-5f * std::max(x, y)) << x << " " << y;
            EXPECT_EQ(screened, blend({y, y, y, 1}, {x, x, x, 1}, "screen", 1)[0]);
        }
}

TEST(Blend, HalfStrengthLiesHalfway) {
    for (const char* mode : {"mix", "screen", "multiply"}) {
        cv::Vec4f none = blend(a, b, mode, 0), half = blend(a, b, mode, .5f), full = blend(a, b, mode, 1);
        for (int n = 0; n < 3; n++) EXPECT_NEAR(half[n], (none[n] + full[n]) / 2, 1e-6) << mode;
    }
    EXPECT_NEAR(blend(a, b, "add", 2)[2], a[2] + 2 * b[2], 1e-6);
}

}  // namespace
