#include "samples/capture/projection.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core/matx.hpp>
#include <random>

namespace {

using capture::perspectiveOf;

std::array<float, 16> columns(const cv::Matx44d& matrix) {
    std::array<float, 16> m;
    for (int k = 0; k < 16; k++) m[k] = float(matrix(k % 4, k / 4));
    return m;
}

// Normalised depth = offset + slope / Z with `low` at the near plane and 1 at the far one.
cv::Matx44d projection(double fx, double fy, double cx, double cy, double atNear, double atFar, double n,
                       double f) {
    const double slope = std::isinf(f) ? (atNear - atFar) * n : (atNear - atFar) * n * f / (f - n);
    const double offset = std::isinf(f) ? atFar : atFar - slope / f;
    return {fx, 0, -cx, 0, 0, fy, -cy, 0, 0, 0, -offset, slope, 0, 0, -1, 0};
}

cv::Matx44d randomView(std::mt19937& random, double scale) {
    std::normal_distribution<double> normal;
    cv::Vec3d a(normal(random), normal(random), normal(random)),
        b(normal(random), normal(random), normal(random));
    a = cv::normalize(a);
    b = cv::normalize(b - a * a.dot(b));
    const cv::Vec3d c = a.cross(b);
    return {scale * a[0],
            scale * a[1],
            scale * a[2],
            10 * normal(random),
            scale * b[0],
            scale * b[1],
            scale * b[2],
            10 * normal(random),
            scale * c[0],
            scale * c[1],
            scale * c[2],
            10 * normal(random),
            0,
            0,
            0,
            1};
}

}  // namespace

// Whatever view a projection is multiplied by, its planes, focal lengths and centre come back.
TEST(Projection, IsRecoveredUnderAnyView) {
    std::mt19937 random(7);
    const double inf = std::numeric_limits<double>::infinity();
    const struct {
        double low, atNear, atFar, n, f;
    } kinds[] = {{-1, -1, 1, .5, 200},
                 {0, 0, 1, .5, 200},
                 {0, 1, 0, .5, 200},
                 {0, 1, 0, .5, inf},
                 {-1, -1, 1, .5, inf}};
    for (const auto& kind : kinds) {
        for (double scale : {1., .01, 25.}) {
            const cv::Matx44d p = projection(1.3, 2.1, .2, -.1, kind.atNear, kind.atFar, kind.n, kind.f);
            const auto found = perspectiveOf(columns(p * randomView(random, scale)).data(), kind.low);
            ASSERT_TRUE(found);
            EXPECT_NEAR(found->focalX, 1.3, 1e-5);
            EXPECT_NEAR(found->focalY, 2.1, 1e-5);
            EXPECT_NEAR(found->centreX, .2, 1e-5);
            EXPECT_NEAR(found->centreY, -.1, 1e-5);
            // The view's float32 offsets, of size 10 here, are added to the slope of size n.
            EXPECT_NEAR(found->nearPlane, kind.n, 2e-5 * kind.n / .5);
            if (kind.f == inf)
                EXPECT_GT(found->farPlane, 1e5);
            else
                EXPECT_NEAR(found->farPlane, kind.f, .02 * kind.f);
            EXPECT_EQ(found->reversed, kind.atNear > kind.atFar);
            EXPECT_FALSE(found->isPure);
            EXPECT_TRUE(perspectiveOf(columns(p).data(), kind.low)->isPure);
        }
    }
}

TEST(Projection, WhatIsNoPerspectiveIsRefused) {
    std::mt19937 random(8);
    EXPECT_FALSE(perspectiveOf(columns(cv::Matx44d::eye()).data()));
    EXPECT_FALSE(perspectiveOf(columns(randomView(random, 3)).data()));
    EXPECT_FALSE(perspectiveOf(columns(cv::Matx44d::zeros()).data()));
    cv::Matx44d broken = projection(1, 1, 0, 0, -1, 1, .1, 100);
    broken(0, 0) = NAN;
    EXPECT_FALSE(perspectiveOf(columns(broken).data()));
    cv::Matx44d oblique = projection(1, 1, 0, 0, -1, 1, .1, 100);
    oblique(2, 0) = .4;
    EXPECT_FALSE(perspectiveOf(columns(oblique).data()));
    cv::Matx44d sheared = projection(1, 1, 0, 0, -1, 1, .1, 100);
    sheared(0, 1) = .5;
    EXPECT_FALSE(perspectiveOf(columns(sheared).data()));
}

TEST(Projection, KnowsAHud) {
    const cv::Matx44d hud(2. / 800, 0, 0, -1, 0, 2. / 600, 0, -1, 0, 0, -1, 0, 0, 0, 0, 1);
    EXPECT_TRUE(capture::isOrthographic(columns(hud).data()));
    EXPECT_FALSE(capture::isOrthographic(columns(projection(1, 1, 0, 0, -1, 1, .1, 100)).data()));
}
