// What plans know of a frame, against the plain sums over its pixels: of a camera that is tilted and rolled,
// in a frame whose edges cut tiles.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <random>

#include "effect/chain.hpp"

namespace brume {
namespace {

constexpr int tile = ImageBounds::tile;

// Looks ahead and turned by three angles, 3 m above the ground.
cv::Matx44d turned() {
    const auto turn = [](int a, int b, double angle) {
        cv::Matx44d m = cv::Matx44d::eye();
        m(a, a) = m(b, b) = std::cos(angle);
        m(b, a) = std::sin(angle), m(a, b) = -m(b, a);
        return m;
    };
    cv::Matx44d pose = turn(2, 0, .8) * turn(1, 2, -.3) * turn(0, 1, .2);
    pose(0, 3) = -7, pose(1, 3) = 3, pose(2, 3) = 11;
    return pose;
}

FramePair tiltedFrame(cv::Size size) {
    FramePair frame;
    frame.camera = Camera::withHorizontalView(size, 70);
    frame.camera.fy *= 1.1;
    frame.camera.worldFromCamera = turned();
    frame.color.create(size, CV_32FC4);
    frame.depth.create(size, CV_32F);
    std::mt19937 random(5);
    const auto unit = [&] { return float(random() >> 8) / 0x1p24f; };
    for (int j = 0; j < size.height; j++)
        for (int i = 0; i < size.width; i++) {
            frame.color.at<cv::Vec4f>(j, i) = {unit(), 2 * unit(), unit() - .25f, 1};
            frame.depth.at<float>(j, i) = unit() < .125f ? HUGE_VALF : 2 + 200 * unit();
        }
    return frame;
}

cv::Vec3d worldRay(const FramePair& frame, cv::Point pixel) {
    const cv::Vec3d ray = frame.camera.ray(pixel.x, pixel.y);
    const cv::Vec4d turned = frame.camera.worldFromCamera * cv::Vec4d(ray[0], ray[1], ray[2], 0);
    return {turned[0], turned[1], turned[2]};
}

class Statistics : public testing::Test {
  protected:
    const FramePair frame = tiltedFrame({75, 43});
    const FrameStatistics s = measureFrame(frame);
};

TEST_F(Statistics, ExtremesAndSkyAreThoseOfAllPixels) {
    double nearest = HUGE_VAL, farthest = 0, lowest = HUGE_VAL, highest = -HUGE_VAL;
    int sky = 0;
    for (int j = 0; j < 43; j++)
        for (int i = 0; i < 75; i++) {
            const float z = frame.depth.at<float>(j, i);
            if (std::isinf(z)) {
                sky++;
                continue;
            }
            const cv::Vec3d ray = worldRay(frame, {i, j});
            nearest = std::min(nearest, z * cv::norm(ray)), farthest = std::max(farthest, z * cv::norm(ray));
            lowest = std::min(lowest, 3 + z * ray[1]), highest = std::max(highest, 3 + z * ray[1]);
        }
    EXPECT_NEAR(s.minDistance, nearest, 1e-6 * nearest);
    EXPECT_NEAR(s.maxDistance, farthest, 1e-6 * farthest);
    EXPECT_NEAR(s.minHeight, lowest, 1e-6 * farthest);
    EXPECT_NEAR(s.maxHeight, highest, 1e-6 * farthest);
    EXPECT_EQ(s.eyeHeight, 3);
    EXPECT_DOUBLE_EQ(s.skyShare, sky / (75. * 43));
    EXPECT_DOUBLE_EQ(s.radiansPerPixel, 1 / frame.camera.fy);
}

TEST_F(Statistics, ProbesLookWhereTheirPixelsDo) {
    ASSERT_GT(s.probes.size(), 586u);
    for (const Probe& probe : s.probes) {
        ASSERT_TRUE(cv::Rect(0, 0, 75, 43).contains(probe.pixel)) << probe.pixel;
        const cv::Vec3d ray = worldRay(frame, probe.pixel);
        EXPECT_LT(cv::norm(probe.direction - ray / cv::norm(ray)), 1e-12) << probe.pixel;
        const float z = frame.depth.at<float>(probe.pixel);
        if (std::isinf(z))
            EXPECT_EQ(probe.distance, HUGE_VAL);
        else
            EXPECT_NEAR(probe.distance, z * cv::norm(ray), 1e-12 * probe.distance);
        const cv::Vec4f color = frame.color.at<cv::Vec4f>(probe.pixel);
        EXPECT_EQ(probe.low, cv::Vec3d(color[0], color[1], color[2]));
        EXPECT_EQ(probe.high, probe.low);
    }
    EXPECT_NEAR(s.probes[0].distance, s.minDistance, 1e-6 * s.minDistance);
    EXPECT_NEAR(s.probes[1].distance, s.maxDistance, 1e-6 * s.maxDistance);
    EXPECT_NEAR(3 + s.probes[2].distance * s.probes[2].direction[1], s.minHeight, 1e-6 * s.maxDistance);
    EXPECT_NEAR(3 + s.probes[3].distance * s.probes[3].direction[1], s.maxHeight, 1e-6 * s.maxDistance);
}

TEST_F(Statistics, TilesHoldTheirPixelsAndTheRingWhatEdgesRepeat) {
    ASSERT_EQ(s.color.lowest.size(), cv::Size(5 + 2, 3 + 2));
    for (int row = 0; row < 5; row++)
        for (int column = 0; column < 7; column++) {
            // Beyond an edge lie its own pixels.
            const auto span = [](int place, int places, int length) {
                if (place == 0) return cv::Range(0, 1);
                if (place == places - 1) return cv::Range(length - 1, length);
                return cv::Range((place - 1) * tile, std::min(place * tile, length));
            };
            const cv::Mat part = frame.color(span(row, 5, 43), span(column, 7, 75));
            cv::Vec3d mean(0, 0, 0), low = cv::Vec3d::all(HUGE_VAL), high = -low;
            for (int j = 0; j < part.rows; j++)
                for (int i = 0; i < part.cols; i++)
                    for (int n = 0; n < 3; n++) {
                        const double x = part.at<cv::Vec4f>(j, i)[n];
                        low[n] = std::min(low[n], x), high[n] = std::max(high[n], x);
                        mean[n] += x / double(part.total());
                    }
            SCOPED_TRACE(testing::Message() << row << ", " << column);
            EXPECT_EQ(cv::Vec3d(s.color.lowest.at<cv::Vec3f>(row, column)), low);
            EXPECT_EQ(cv::Vec3d(s.color.highest.at<cv::Vec3f>(row, column)), high);
            EXPECT_LT(cv::norm(cv::Vec3d(s.color.leastMean.at<cv::Vec3f>(row, column)) - mean), 2e-6);
        }
}

}  // namespace
}  // namespace brume
