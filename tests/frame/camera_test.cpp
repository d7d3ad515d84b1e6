#include "frame/camera.hpp"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

namespace brume {
namespace {

TEST(Camera, PitchIsPositiveUpward) {
    Camera camera = Camera::withHorizontalView({640, 480}, 90);
    camera.worldFromCamera = Camera::standing(1.7, 30);
    const cv::Vec4d forward = camera.worldFromCamera * cv::Vec4d(0, 0, -1, 0);
    EXPECT_NEAR(forward[1], .5, 1e-15);  // sin 30°
    EXPECT_NEAR(forward[2], -std::sqrt(.75), 1e-15);
    EXPECT_EQ(camera.eye(), cv::Vec3d(0, 1.7, 0));
}

TEST(Camera, HorizontalViewReachesTheImagesEdges) {
    const Camera camera = Camera::withHorizontalView({1280, 720}, 90);
    EXPECT_NEAR(camera.ray(-.5, 0)[0], -1, 1e-12);
    EXPECT_NEAR(camera.ray(1279.5, 0)[0], 1, 1e-12);
    EXPECT_GT(camera.ray(0, 0)[1], 0) << "the first row looks up";
}

TEST(Camera, ResizedSeesTheSameRays) {
    Camera camera = Camera::withHorizontalView({1920, 1080}, 70);
    camera.cx = 941.5;
    const Camera half = camera.resized({1920, 1080}, {480, 540});
    // The centre of a small pixel is the middle of the pixels it covers.
    const cv::Vec3d large = camera.ray(4 * 100 + 1.5, 2 * 50 + .5), small = half.ray(100, 50);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(large[k], small[k], 1e-12);
}

}  // namespace
}  // namespace brume
