// Fog on every real pair of the game, the renderer and the sensor: what a person would check by eye,
// asserted.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>

#include "apply/apply.hpp"
#include "cpu/cpu_runner.hpp"
#include "effect/preset.hpp"
#include "frame/read.hpp"

using namespace brume;

namespace {

std::vector<std::string> pairs() {
    std::vector<std::string> found;
    std::string root = BRUME_CAPTURES;
    if (root.empty()) return found;
    for (const char* name : {"am_galmevish2", "czest1dm", "islandctf", "oa_shine", "wrackdm17"})
        found.push_back(root + "/openarena/" + name + ".png");
    for (const char* name : {"flat_clear", "flat_clear_blender_multilayer", "night_clear"})
        found.push_back(root + "/blender/" + name + ".exr");
    found.push_back(root + "/tum/color.png");
    return found;
}

class Captures : public testing::TestWithParam<std::string> {};

TEST_P(Captures, FogTakesHoldByDistanceAndLeavesNothingUndefined) {
    FramePair frame = readFrame(GetParam());
    Chain chain = readPreset("visibility_200", EffectRegistry::standard());
    auto runner = makeCpuRunner();
    RunResult result = applyChain(*runner, chain, frame, {"transmittance"});
    const cv::Mat &color = result.images.at("color"), &t = result.images.at("transmittance");
    ASSERT_EQ(color.size(), frame.color.size());
    EXPECT_TRUE(cv::checkRange(color)) << "every pixel finite";
    int surfaces = 0, sky = 0;
    for (int j = 0; j < t.rows; j++)
        for (int i = 0; i < t.cols; i++) {
            float z = frame.depth.at<float>(j, i), through = t.at<cv::Vec4f>(j, i)[1];
            if (std::isnan(z)) {
                EXPECT_GE(through, 0);
                EXPECT_LE(through, 1);
            } else if (std::isinf(z)) {
                sky++;
                EXPECT_EQ(through, 0) << "sky is fully fogged";
            } else {
                surfaces++;
                double distance = z * cv::norm(frame.camera.ray(i, j));
                EXPECT_NEAR(through, std::exp(std::log(.05) * distance / 200), 1e-5);
            }
        }
    EXPECT_GT(surfaces, t.rows * t.cols / 3) << "depth was understood";
    if (GetParam().find("islandctf") != std::string::npos) {
        EXPECT_GT(sky, 0);
    }
}

INSTANTIATE_TEST_SUITE_P(EveryPair, Captures, testing::ValuesIn(pairs()),
                         [](const auto& info) { return std::filesystem::path(info.param).stem().string(); });

TEST(CapturesFolder, IsThere) {
    if (pairs().empty()) GTEST_SKIP() << "set BRUME_CAPTURES to the folder of captured pairs";
    for (const auto& path : pairs()) EXPECT_TRUE(std::filesystem::exists(path)) << path;
}

}  // namespace

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(Captures);
