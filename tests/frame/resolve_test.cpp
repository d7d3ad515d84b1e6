#include "frame/resolve.hpp"

#include "frame_fixture.hpp"

namespace brume {
namespace {

constexpr float inf = std::numeric_limits<float>::infinity();

/// Left half a red wall at 2 m, right half a blue one at 20 m.
FramePair twoWalls(cv::Size size = {64, 48}) {
    FramePair frame;
    frame.color.create(size, CV_32FC4);
    frame.depth.create(size, CV_32F);
    for (int j = 0; j < size.height; ++j)
        for (int i = 0; i < size.width; ++i) {
            const bool left = i < size.width / 2;
            frame.color.at<cv::Vec4f>(j, i) =
                left ? cv::Vec4f(.8f, .1f, .1f, 1) : cv::Vec4f(.1f, .1f, .8f, 1);
            frame.depth.at<float>(j, i) = left ? 2 : 20;
        }
    frame.camera = Camera::withHorizontalView(size, 60);
    return frame;
}

TEST(ResolveDepth, LeavesACompleteFrameAlone) {
    const FramePair frame = twoWalls();
    const ReadyFrame ready = resolveDepth(frame, {});
    EXPECT_EQ(ready.frame.depth.data, frame.depth.data) << "shares memory";
    EXPECT_TRUE(ready.restore.empty());
}

TEST(ResolveDepth, FillStaysOnItsSideOfAnEdge) {
    FramePair frame = twoWalls();
    cv::Mat hole = frame.depth(cv::Rect(26, 10, 12, 20));  // across the edge
    hole.setTo(NAN);
    const ReadyFrame ready = resolveDepth(frame, {});
    for (int j = 10; j < 30; ++j)
        for (int i = 26; i < 38; ++i) {
            const float z = ready.frame.depth.at<float>(j, i);
            EXPECT_NEAR(z, i < 32 ? 2 : 20, i < 32 ? .02 : 1) << i << " " << j;
        }
    EXPECT_EQ(ready.frame.depth.at<float>(0, 0), 2) << "known depth is not touched";
    EXPECT_TRUE(std::isnan(frame.depth.at<float>(15, 30))) << "nor the captured frame";
}

TEST(ResolveDepth, FillReachesAcrossAnyHole) {
    // One known pixel, in a picture whose edges stop every weight.
    FramePair frame = twoWalls({400, 300});
    for (int j = 0; j < 300; ++j)
        for (int i = 0; i < 400; ++i)
            frame.color.at<cv::Vec4f>(j, i) =
                (i / 3 + j / 3) % 2 ? cv::Vec4f(1, 1, 1, 1) : cv::Vec4f(0, 0, 0, 1);
    frame.depth.setTo(NAN);
    frame.depth.at<float>(5, 7) = 12.5f;
    const ReadyFrame ready = resolveDepth(frame, {});
    double low, high;
    cv::minMaxLoc(ready.frame.depth, &low, &high);
    EXPECT_NEAR(low, 12.5, 1e-3);
    EXPECT_NEAR(high, 12.5, 1e-3);
}

TEST(ResolveDepth, HolesInTheSkyAreSky) {
    FramePair frame = twoWalls();
    frame.depth(cv::Rect(32, 0, 32, 48)).setTo(inf);
    frame.depth(cv::Rect(45, 10, 6, 6)).setTo(NAN);
    const ReadyFrame ready = resolveDepth(frame, {});
    EXPECT_GT(ready.frame.depth.at<float>(12, 47), 1e4f);
}

TEST(ResolveDepth, PoliciesForUnknownAndSky) {
    FramePair frame = twoWalls();
    frame.depth.at<float>(3, 4) = NAN;
    frame.depth.at<float>(3, 50) = inf;
    DepthPolicy policy;
    policy.unknown = UnknownDepth::Far;
    EXPECT_EQ(resolveDepth(frame, policy).frame.depth.at<float>(3, 4), inf);
    EXPECT_TRUE(resolveDepth(frame, policy).restore.empty());

    policy.unknown = UnknownDepth::Keep;
    policy.sky = SkyPolicy::AtDistance;
    policy.skyDistance = 500;
    const ReadyFrame ready = resolveDepth(frame, policy);
    EXPECT_NEAR(ready.frame.depth.at<float>(3, 50) * cv::norm(frame.camera.ray(50, 3)), 500, 1e-3);
    EXPECT_EQ(ready.restore.at<uchar>(3, 4), 1);
    EXPECT_EQ(cv::countNonZero(ready.restore), 1);
    for (int j = 0; j < 48; ++j)
        for (int i = 0; i < 64; ++i) ASSERT_FALSE(std::isnan(ready.frame.depth.at<float>(j, i)));
}

TEST(RestorePixels, GivesBackWhatWasCaptured) {
    FramePair frame = twoWalls();
    frame.depth.at<float>(3, 4) = NAN;
    frame.depth.at<float>(3, 50) = inf;
    DepthPolicy policy;
    policy.unknown = UnknownDepth::Keep;
    policy.sky = SkyPolicy::Untouched;
    const ReadyFrame ready = resolveDepth(frame, policy);
    cv::Mat fogged(frame.size(), CV_32FC4, cv::Scalar(.5, .5, .5, 1));
    cv::Mat transmittance(frame.size(), CV_32FC4, cv::Scalar(.3, .3, .3, .3));
    restorePixels(ready, fogged, transmittance);
    EXPECT_EQ(fogged.at<cv::Vec4f>(3, 4), frame.color.at<cv::Vec4f>(3, 4));
    EXPECT_EQ(fogged.at<cv::Vec4f>(3, 50), frame.color.at<cv::Vec4f>(3, 50));
    EXPECT_EQ(fogged.at<cv::Vec4f>(3, 5)[0], .5f);
    EXPECT_TRUE(std::isnan(transmittance.at<cv::Vec4f>(3, 4)[0]));
    EXPECT_EQ(transmittance.at<cv::Vec4f>(3, 50)[1], 1);
    EXPECT_EQ(transmittance.at<cv::Vec4f>(3, 5)[1], .3f);
    cv::Mat none;
    restorePixels(ready, fogged, none);
    EXPECT_TRUE(none.empty());
}

}  // namespace
}  // namespace brume
