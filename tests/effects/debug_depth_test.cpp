// Theorems of debug_depth.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "cpu/cpu_runner.hpp"
#include "effect/preset.hpp"

using namespace brume;

namespace {

cv::Vec4f shown(float depth, const std::vector<std::pair<std::string, std::string>>& parameters) {
    FramePair frame;
    frame.color = cv::Mat(1, 1, CV_32FC4, cv::Scalar(.2, .4, .6, .5));
    frame.depth = cv::Mat(1, 1, CV_32F, cv::Scalar(depth));
    frame.camera = Camera::withHorizontalView({1, 1}, 90);
    Chain chain = readPreset("debug_depth", EffectRegistry::standard());
    for (const auto& [name, value] : parameters) setParameter(chain, "debug_depth." + name, value);
    return makeCpuRunner()->run(chain, frame, {}).images["color"].at<cv::Vec4f>(0, 0);
}

TEST(DebugDepth, SkyIsWhiteAndAlphaPasses) { EXPECT_EQ(shown(HUGE_VALF, {}), cv::Vec4f(1, 1, 1, .5f)); }

TEST(DebugDepth, NoStrengthIsTheIdentity) {
    for (float depth : {0.f, 3.f, HUGE_VALF})
        EXPECT_EQ(shown(depth, {{"strength", "0"}}), cv::Vec4f(.2f, .4f, .6f, .5f));
}

TEST(DebugDepth, GreyFallsEvenlyWithEachOctave) {
    auto grey = [](float depth) {
        return shown(depth, {{"palette", "grey"}, {"nearest", "1"}, {"farthest", "1024"}})[0];
    };
    for (int octave = 0; octave <= 10; octave++)
        EXPECT_NEAR(grey(std::ldexp(1.f, octave)), 1 - octave / 10., 1e-6);
    EXPECT_EQ(grey(0), 1) << "nearer than the near end";
    EXPECT_EQ(grey(1e6f), 0) << "farther than the far end";
}

TEST(DebugDepth, TheSpectrumMeetsItsStops) {
    auto color = [](float depth) { return shown(depth, {{"nearest", "1"}, {"farthest", "16"}}); };
    const double stops[5][3] = {
        {.85, .10, .05}, {.85, .65, .05}, {.10, .55, .20}, {.05, .20, .75}, {.15, .03, .30}};
    for (int stop = 0; stop < 5; stop++)
        for (int n = 0; n < 3; n++) EXPECT_NEAR(color(std::ldexp(1.f, stop))[n], stops[stop][n], 1e-6);
}

}  // namespace
