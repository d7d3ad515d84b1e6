// What the tests of the GL runner share: both platforms, small frames, effects from texts.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>

#include "effect/runner.hpp"
#include "error.hpp"
#include "gl/gl_runner.hpp"

namespace brume {

/// Each test runs on OSMesa and on EGL; one thread a platform for the whole program.
class OnBothPlatforms : public ::testing::TestWithParam<GlPlatform> {
  protected:
    static std::shared_ptr<GlThread> thread() {
        static std::map<GlPlatform, std::weak_ptr<GlThread>> threads;
        static std::vector<std::shared_ptr<GlThread>> kept;
        auto& known = threads[GetParam()];
        if (auto thread = known.lock()) return thread;
        kept.push_back(std::make_shared<GlThread>(GetParam()));
        known = kept.back();
        return kept.back();
    }
    std::unique_ptr<Runner> runner() { return makeGlRunner(thread()); }
};

#define BOTH_PLATFORMS(Suite)                                              \
    INSTANTIATE_TEST_SUITE_P(                                              \
        Gl, Suite, ::testing::Values(GlPlatform::Osmesa, GlPlatform::Egl), \
        [](const auto& info) { return info.param == GlPlatform::Osmesa ? "Osmesa" : "Egl"; })

/// Four distinct corners: red top left, green top right, blue bottom left, white bottom right; grey
/// elsewhere.
inline FramePair probeFrame(int width = 6, int height = 4) {
    FramePair frame;
    frame.name = "probe";
    frame.color = cv::Mat(height, width, CV_32FC4, cv::Scalar(.25, .25, .25, 1));
    frame.color.at<cv::Vec4f>(0, 0) = {1, 0, 0, 1};
    frame.color.at<cv::Vec4f>(0, width - 1) = {0, 1, 0, 1};
    frame.color.at<cv::Vec4f>(height - 1, 0) = {0, 0, 1, 1};
    frame.color.at<cv::Vec4f>(height - 1, width - 1) = {1, 1, 1, 1};
    frame.depth = cv::Mat(height, width, CV_32F, cv::Scalar(10));
    frame.camera = Camera::withHorizontalView(frame.color.size(), 60);
    return frame;
}

/// Values from 0 to `scale`, the same each time.
inline cv::Mat randomImage(int width, int height, double scale = 1) {
    cv::Mat image(height, width, CV_32FC4);
    cv::RNG rng(7);
    rng.fill(image, cv::RNG::UNIFORM, 0., scale);
    return image;
}

/// An effect from text, as if read from a file in the test's own folder.
inline std::shared_ptr<Effect> effectFrom(const std::string& fileText,
                                          std::shared_ptr<const PluginEffect> plugin = nullptr) {
    auto effect = std::make_shared<Effect>();
    effect->header = parseHeader(BRUME_TEST_DATA "/gl/fixtures/test_effect.fs", fileText);
    effect->plugin = std::move(plugin);
    effect->includePath = {BRUME_TEST_DATA "/gl/fixtures", BRUME_SOURCE_DIR "/src/effect"};
    return effect;
}

/// Brume's own kind: `keys` are more JSON, `body` GLSL after the kit.
inline std::shared_ptr<Effect> linearEffect(const std::string& keys, const std::string& body,
                                            std::shared_ptr<const PluginEffect> plugin = nullptr) {
    return effectFrom(R"(/*{"SPACE": "linear", "DESCRIPTION": "a test")" + (keys.empty() ? "" : ", " + keys) +
                          "}*/\n#include \"kit/image.glsl\"\n#include \"kit/view.glsl\"\n" + body,
                      std::move(plugin));
}

/// A file of tests/gl/fixtures.
inline std::shared_ptr<const Effect> fixture(const std::string& name) {
    return loadEffect(BRUME_TEST_DATA "/gl/fixtures/" + name, "", {BRUME_TEST_DATA "/gl/fixtures"});
}

inline Step stepOf(std::shared_ptr<const Effect> effect) {
    Step step;
    step.id = effect->name();
    step.values = defaultValues(effect->header.parameters);
    step.effect = std::move(effect);
    return step;
}

inline Chain chainOf(std::vector<Step> steps) {
    Chain chain;
    chain.steps = std::move(steps);
    return chain;
}

inline const char* const inputOnly = R"("INPUTS": [{"NAME": "inputImage", "TYPE": "image"}])";

inline double largestDifference(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF); }

}  // namespace brume
