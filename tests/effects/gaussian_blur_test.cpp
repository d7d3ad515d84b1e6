// Theorems and error bounds of gaussian_blur; parity and reference over many frames are driven by the
// registry.
#include <gtest/gtest.h>

#include <cmath>

#include "effects/blur_theorems.hpp"

using namespace blur_test;

static const char* const methods[] = {"fir",    "recursive",   "decimated", "box",
                                      "pascal", "dual_filter", "auto"};

static Blur gaussian(const std::string& method, double radius) { return {"gaussian_blur", method, radius}; }

static Kernel trueGaussian(double sigma, int reach) {
    Kernel kernel;
    double sum = 0;
    for (int d = -reach; d <= reach; d++) sum += kernel.emplace_back(std::exp(-.5 * d * d / (sigma * sigma)));
    for (double& w : kernel) w /= sum;
    return kernel;
}
static int reachOf(double sigma) { return int(8 * sigma) + 8; }

// The factor of a decimation, by the σ per small pixel that its boxes want; auto is decimated on these images
// wherever that decimates.
static int periodOf(const std::string& method, double sigma, double tolerance = 1e-3) {
    if (method != "decimated" && method != "auto") return 1;
    auto least = [&](double atMilli, double at100Micro, double at10Micro) {
        const double decades = -3 - std::log10(tolerance);
        return decades < 1 ? atMilli + decades * (at100Micro - atMilli)
                           : at100Micro + (decades - 1) * (at10Micro - at100Micro);
    };
    const double least4 = least(1.45, 1.85, 2.5);
    if (sigma >= 4 * least4) return std::min(int(sigma / least4), 16);
    return sigma >= 3 * least(1.29, 1.55, 1.93) ? 3 : sigma >= 2 * least(1.29, 1.52, 1.8) ? 2 : 1;
}

TEST(GaussianBlur, ConstantsAreKeptAtEveryRadius) {
    for (const char* method : methods)
        for (double radius : {0., .05, .2, .5, 1., 3.4, 3.6, 8., 30., 100., 1000.})
            expectConstantsKept(gaussian(method, radius));
}

TEST(GaussianBlur, RadiusZeroIsTheIdentity) {
    cv::Mat image = randomImage({31, 17}, 1);
    for (const char* method : methods)
        EXPECT_EQ(cv::countNonZero(onCpu(gaussian(method, 0), image).reshape(1) != image.reshape(1)), 0)
            << method;
}

TEST(GaussianBlur, ErrorOfFastMethodsIsUnderOneThousandthAtEveryRadius) {
    for (double radius : {.3, .5,   1., 1.5, 2., 2.5, 2.575, 2.585, 2.6, 3.,  3.5, 3.88,
                          5., 5.99, 6., 7.3, 8., 11., 16.,   27.,   32., 64., 200.})
        for (const char* method : {"auto", "fir", "decimated", "recursive"}) {
            auto error = operatorError(gaussian(method, radius), trueGaussian(radius, reachOf(radius)),
                                       periodOf(method, radius));
            EXPECT_LE(error.pair, 1e-3) << method << " " << radius << " one axis " << error.oneAxis;
            if (std::string(method) == "recursive") {
                EXPECT_LE(error.pair, 5e-5) << radius;
            }
        }
}

// Measured: at most .96 of it, and some more as fp32 rounds.
TEST(GaussianBlur, DecimatedKeepsItsTolerance) {
    for (double tolerance : {1e-3, 7.5e-4, 4.2e-4, 2.4e-4, 1.33e-4, 1e-4, 3e-5, 1e-5}) {
        for (double radius : {2.581, 2.6,  2.66, 2.77, 2.88, 2.99, 3.045, 3.34,  3.605, 3.88, 4.17, 4.36,
                              4.56,  4.66, 5.14, 5.8,  6.4,  7.41, 8.9,   10.01, 10.7,  14.5, 24.8, 33.}) {
            const int period = periodOf("decimated", radius, tolerance);
            if (period == 1) continue;
            Blur blur = {"gaussian_blur", "decimated", radius, tolerance};
            auto error = operatorError(blur, trueGaussian(radius, reachOf(radius)), period);
            EXPECT_LE(error.pair, tolerance + 2e-6) << blur.describe();
        }
    }
}

// Each box replicates what the one before it made of the edge: there the three err seven times as much as
// elsewhere, so that a dark frame's bright first rows and columns come out .31 too bright at the corner.
TEST(GaussianBlur, BoxesErrMoreAtEdgesAsStated) {
    for (cv::Size size : {cv::Size(60, 41), cv::Size(3, 80), cv::Size(1, 7)})
        for (double radius : {.34, .7, 1., 1.42, 2.45, 6., 14.}) {
            cv::Mat image(size, CV_32FC4, cv::Scalar::all(-1));
            for (int edge : {1, int(radius), int(2 * radius)}) {
                image.rowRange(0, std::clamp(edge, 1, size.height)) = cv::Scalar::all(1);
                image.colRange(0, std::clamp(edge, 1, size.width)) = cv::Scalar::all(1);
                expectWithinStatedError(gaussian("box", radius), image);
            }
            expectWithinStatedError(gaussian("box", radius), randomImage(size, 3));
        }
}

TEST(GaussianBlur, ErrorsOfTextbookMethodsAreAsStated) {
    for (double radius : {1., 5., 30., 100.}) {
        auto box = operatorError(gaussian("box", radius), trueGaussian(radius, reachOf(radius)), 1);
        EXPECT_LE(box.oneAxis, .06) << radius;
        EXPECT_GE(box.oneAxis, .02) << radius << ": better than three boxes can be";
    }
    // One axis at every phase of the pyramid; measured .160, .088, .062, .057.
    for (auto [radius, period] : {std::pair(3., 4), {5., 4}, {10., 8}, {20., 16}}) {
        auto dual =
            operatorError(gaussian("dual_filter", radius), trueGaussian(radius, reachOf(radius)), period);
        EXPECT_LE(dual.oneAxis, .17) << radius;
        EXPECT_GE(dual.oneAxis, .04) << radius << ": better than a dual filter can be";
    }
    // Row 4 of Pascal's triangle.
    cv::Mat impulse(1, 9, CV_32FC4, cv::Scalar::all(0));
    impulse.at<cv::Vec4f>(0, 4) = {1, 1, 1, 1};
    cv::Mat row = onCpu(gaussian("pascal", 1), impulse);
    const float pascal[] = {0, 0, 1, 4, 6, 4, 1, 0, 0};
    for (int i = 0; i < 9; i++) EXPECT_FLOAT_EQ(row.at<cv::Vec4f>(0, i)[0], pascal[i] / 16);
}

TEST(GaussianBlur, TransposedAndMirroredImagesGiveTransposedAndMirroredBlurs) {
    for (const char* method : methods)
        for (double radius : {.7, 2.5, 6., 20.}) {
            expectTransposed(gaussian(method, radius), 3e-6);
            bool isDecimated = periodOf(method, radius) > 1;
            // The levels of a pyramid share their centre where sizes are even.
            if (std::string(method) == "dual_filter")
                expectMirrored(gaussian(method, radius), 3e-6, {62, 46});
            else
                expectMirrored(gaussian(method, radius), isDecimated ? 1e-3 : 3e-6);
        }
}

TEST(GaussianBlur, MeanOfContentAwayFromEdgesIsKept) {
    for (const char* method : methods)
        for (double radius : {1., 4., 12.})
            expectMeanKept(gaussian(method, radius), int(8 * radius) + 4,
                           periodOf(method, radius) > 1 ? 1e-3 : 2e-5);
}

TEST(GaussianBlur, AStepBecomesTheIntegralOfTheKernel) {
    for (const char* method : {"fir", "recursive", "decimated", "auto"})
        for (double radius : {.5, 2., 5., 17.})
            expectStep(gaussian(method, radius), trueGaussian(radius, reachOf(radius)), 5.1e-4);
}

// Not box, not dual_filter: there each step replicates its own edges. auto may choose otherwise for the
// larger image, and each choice errs by up to 1e-3.
TEST(GaussianBlur, EdgesReplicateAlsoOfImagesNarrowerThanTheKernel) {
    for (const char* method : {"fir", "recursive", "decimated", "pascal"})
        for (double radius : {.7, 3., 9., 25.}) {
            // A whole number of small pixels, so that decimation falls on the same places.
            int period = periodOf(method, radius), reach = (int(9 * radius) + 8 + period) / period * period;
            expectEdgesReplicate(gaussian(method, radius), reach, 5e-6);
            expectEdgesReplicate(gaussian("auto", radius), reach, 2e-3);
        }
}

TEST(GaussianBlur, OneBadPixelCountsAsOneBoundedPixel) {
    for (const char* method : methods)
        for (double radius : {.5, 3., 9.}) expectBadPixelsBounded(gaussian(method, radius));
}

TEST(GaussianBlur, SameBitsOnAnyNumberOfThreads) {
    for (const char* method : methods)
        for (double radius : {2., 13.}) expectSameBitsOnAnyThreads(gaussian(method, radius));
}

// Exact for the kernel that makes a pixel; the image of a point, which mixes kernels of several phases, is up
// to 4.5 % wider or narrower (measured here).
TEST(GaussianBlur, DualFilterHasTheStandardDeviationAskedForAndAMassOfOne) {
    for (double radius : {1., 1.3, 2.5, 2.9, 5.3, 6.4, 13.4, 30., 57., 106., 150., 200.})
        for (bool upright : {false, true}) {
            const int length = 2 * (int(5 * radius) / 64 * 64 + 192), at = length / 2 + int(radius * 7) % 61;
            cv::Mat impulse(upright ? cv::Size(1, length) : cv::Size(length, 1), CV_32FC4,
                            cv::Scalar::all(0));
            impulse.at<cv::Vec4f>(upright ? cv::Point(0, at) : cv::Point(at, 0)) = {1, 1, 1, 1};
            cv::Mat blurred = onCpu(gaussian("dual_filter", radius), impulse);
            double sum = 0, first = 0, second = 0;
            for (int i = 0; i < length; i++) {
                double w = blurred.at<cv::Vec4f>(upright ? cv::Point(0, i) : cv::Point(i, 0))[0];
                sum += w, first += w * (i - at), second += w * (i - at) * (i - at);
            }
            EXPECT_NEAR(sum, 1, 1e-5) << radius;
            EXPECT_NEAR(std::sqrt(second / sum), radius, .06 * radius) << radius;
            EXPECT_NEAR(first / sum, 0, std::max(.6, .35 * radius)) << radius;
        }
}

TEST(GaussianBlur, GlslMatches) {
    for (const char* method : methods)
        for (double radius : {.4, 3., 9., 60.})
            for (cv::Size size : {cv::Size(53, 31), cv::Size(3, 40)})
                expectGlMatches(gaussian(method, radius), size);
}

TEST(GaussianBlur, TheoremsHoldInGlsl) {
    for (const char* method : {"fir", "recursive", "decimated", "auto"})
        for (double radius : {.7, 3., 9.})
            expectTheoremsInGlsl(gaussian(method, radius), trueGaussian(radius, reachOf(radius)),
                                 periodOf(method, radius), 5.1e-4);
}

// What a blur of values up to 1 comes to is at most its kernel's L1 norm, which is 1 where no weight is below
// 0.
TEST(GaussianBlur, EveryMethodIsBoundedAndKeepsConstantsInGlsl) {
    const cv::Size size(40, 3);
    cv::Mat signs(size, CV_32FC4), constant(size, CV_32FC4, cv::Scalar(.3, 1, 60000, .5));
    for (int j = 0; j < size.height; j++)
        for (int i = 0; i < size.width; i++)
            for (int c = 0; c < 4; c++)
                signs.at<cv::Vec4f>(j, i)[c] = (i / (1 << 2 * c) + (c % 2 ? j : 0)) % 2 ? 1.f : -1.f;
    for (const char* method : methods)
        for (double radius : {0., .2, 1., 8., 100., 1000.}) {
            const Blur blur = gaussian(method, radius);
            EXPECT_LE(difference(onGl(blur, constant), constant), 1e-5) << blur.describe();
            EXPECT_LE(cv::norm(onGl(blur, signs).reshape(1), cv::NORM_INF), 1.001) << blur.describe();
        }
}
