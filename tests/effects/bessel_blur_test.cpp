// Theorems and error bounds of bessel_blur; parity and reference over many frames are driven by the registry.
#include <gtest/gtest.h>

#include <cmath>

#include "apply/apply.hpp"
#include "common/blur_bessel.hpp"
#include "effect/plan.hpp"
#include "effect/preset.hpp"
#include "effect/runner.hpp"
#include "effects/blur_theorems.hpp"

using namespace blur_test;

static const char* const methods[] = {"fir", "recursive", "decimated", "hold", "bilinear", "auto"};

static Blur bessel(const std::string& method, double radius) { return {"bessel_blur", method, radius}; }

// e^(-1.5a)·cos(√3·a/2 - π/3)/τ integrated over pixels by its antiderivative.
static Kernel trueBessel(double radius, int reach) {
    double tau = radius / std::sqrt(2. / 3), s = std::sqrt(3.) / 2;
    auto integral = [&](double x) {  // from 0 to x
        auto at = [&](double a) {
            double angle = s * a - M_PI / 3;
            return std::exp(-1.5 * a) * (-1.5 * std::cos(angle) + s * std::sin(angle)) / 3;
        };
        return at(x / tau) - at(0);
    };
    Kernel kernel;
    double sum = 0;
    for (int d = -reach; d <= reach; d++) {
        double n = std::abs(d);
        sum += kernel.emplace_back(d == 0 ? 2 * integral(.5) : integral(n + .5) - integral(n - .5));
    }
    for (double& w : kernel) w /= sum;
    return kernel;
}
static int reachOf(double radius) { return int(15 * radius) + 8; }

// Of small pixels; auto may be decimated.
static int periodOf(const std::string& method, double radius, double tolerance = 1e-3) {
    return method != "decimated" && method != "auto" ? 1 : blur::besselFactor(radius, tolerance);
}

TEST(BesselBlur, ConstantsAreKeptAtEveryRadius) {
    for (const char* method : methods)
        for (double radius : {0., .01, .2, .5, 1., 3., 7., 30., 100., 1000.})
            expectConstantsKept(bessel(method, radius));
}

// Thousands of taps of about one size: one fp32 sum of them came out 3e-5 too small, in GLSL 5e-5.
TEST(BesselBlur, LongFirsKeepConstantsToo) {
    const cv::Mat constant(cv::Size(40, 3), CV_32FC4, cv::Scalar(.3, 1, .7, .5));
    for (double radius : {250., 871.656})
        for (auto* run : {onCpu, onGl}) {
            const Blur blur{"bessel_blur", "fir", radius, 5e-6};
            EXPECT_LE(difference(run(blur, constant), constant), 1e-5) << blur.describe();
        }
}

TEST(BesselBlur, RadiusZeroIsTheIdentity) {
    cv::Mat image = randomImage({31, 17}, 1);
    for (const char* method : methods)
        EXPECT_EQ(cv::countNonZero(onCpu(bessel(method, 0), image).reshape(1) != image.reshape(1)), 0)
            << method;
}

TEST(BesselBlur, ErrorOfFastMethodsIsUnderOneThousandthAtEveryRadius) {
    for (double radius :
         {.5, .7, 1., 1.99, 2., 3., 5., 6.16, 6.2, 7., 9.19, 9.25, 12., 12.88, 12.92, 20., 32., 60., 200.})
        for (const char* method : {"auto", "fir", "decimated", "recursive"}) {
            auto error = operatorError(bessel(method, radius), trueBessel(radius, reachOf(radius)),
                                       periodOf(method, radius));
            // Above 16 the pair's is only bounded, by twice one axis's.
            EXPECT_LE(error.pair, radius > 16 ? 1.2e-3 : 1e-3)
                << method << " " << radius << " one axis " << error.oneAxis;
            EXPECT_LE(error.oneAxis, 6e-4) << method << " " << radius;
            if (std::string(method) == "recursive") {
                EXPECT_LE(error.pair, 2e-5) << radius;
            }
        }
}

// Each factor from the least radius on that it is taken at.
TEST(BesselBlur, DecimatedErrsByTheToleranceAskedForAndHardlyLess) {
    const std::pair<double, int> atTolerance[] = {{1e-3, 5}, {4e-4, 4}, {1e-4, 3}, {2e-5, 2}};
    for (const auto& [tolerance, largest] : atTolerance)
        for (int factor = 2; factor <= largest; factor++) {
            double radius = 3. * factor;
            while (blur::besselFactor(radius, tolerance) < factor) radius *= 1.0005;
            Blur blur = bessel("decimated", radius);
            blur.tolerance = tolerance;
            const Kernel truth = trueBessel(radius, reachOf(radius));
            double error = 0;  // of the pair, at the places that are worst along both axes
            for (const Kernel& row : operatorError(blur, truth, factor).rows) {
                double sum = 0;
                for (size_t j = 0; j < truth.size(); j++)
                    for (size_t i = 0; i < truth.size(); i++)
                        sum += std::abs(row[i] * row[j] - truth[i] * truth[j]);
                error = std::max(error, sum);
            }
            EXPECT_LE(error, tolerance + 2e-6) << radius << " by " << factor;
            EXPECT_GE(error, .96 * tolerance - 2e-6) << radius << " by " << factor;
        }
}

// What the plan counts lights and ranges by: at each distance, in all from any distance on, and of its L1
// norm there, but for a little that is fp32's. Measured: .97, .90 and .97 of it.
TEST(BesselBlur, DecimatedErrsWhereItsKernelBends) {
    double atDistance = 0, inAll = 0, beyond = 0;
    for (double ratio : {3.09, 3.24, 3.41, 4.2, 5.5, 7., 12.})
        for (int factor : {2, 3, 4, 7}) {
            const double radius = ratio * factor;
            if (radius > 50 || blur::besselDecimationError(radius, factor) > 1e-3) continue;
            Blur blur = bessel("decimated", radius);
            blur.tolerance = blur::besselTolerance(radius, factor);
            const int reach = reachOf(radius);
            const Kernel truth = trueBessel(radius, reach);
            const auto axis = blur::besselAxisError(radius, factor);
            for (const Kernel& row : operatorError(blur, truth, factor).rows) {
                std::vector<double> norm(reach + 2, 0);  // from each distance on
                double sum = 0;
                for (int d = -reach; d <= reach; d++) {
                    const double off = row[d + reach] - truth[d + reach];
                    atDistance = std::max(atDistance, std::abs(off) / (axis.largest(std::abs(d)) + 1e-8));
                    inAll = std::max(inAll, std::abs(sum += off) / axis.step);
                    norm[std::abs(d)] += std::abs(off);
                }
                for (int d = reach; d >= 0; d--)
                    beyond = std::max(beyond, (norm[d] += norm[d + 1]) / (axis.beyond(d) + 1e-6));
            }
        }
    EXPECT_LE(atDistance, 1);
    EXPECT_LE(inAll, 1);
    EXPECT_LE(beyond, 1);
}

// What a blur makes of values up to 1 is at most its kernel's L1 norm: of a pair 1.025 for the true
// one, 1.028 for hold, and 4.18 for bilinear at radius .01, falling to 1.08 at 1.
TEST(BesselBlur, EveryMethodIsBoundedAndKeepsConstantsOnBothBackends) {
    const cv::Size size(40, 3);
    cv::Mat signs(size, CV_32FC4), constant(size, CV_32FC4, cv::Scalar(.3, 1, 60000, .5));
    cv::RNG random(5);
    for (int j = 0; j < size.height; j++)
        for (int i = 0; i < size.width; i++)
            signs.at<cv::Vec4f>(j, i) = {i % 2 ? 1.f : -1.f, (i + j) % 2 ? 1.f : -1.f,
                                         i / 20 % 2 ? 1.f : -1.f, random.uniform(0, 2) ? 1.f : -1.f};
    for (const char* method : methods)
        for (double radius : {0., .01, .2, .5, 1., 3., 30., 200., 1000.})
            for (auto* run : {onCpu, onGl}) {
                const Blur blur = bessel(method, radius);
                EXPECT_LE(difference(run(blur, constant), constant), 1e-5) << blur.describe();
                EXPECT_LE(cv::norm(run(blur, signs).reshape(1), cv::NORM_INF),
                          std::string(method) == "bilinear" ? 4.2 : 1.03)
                    << blur.describe();
            }
}

// MODELS.md §6: at τ = 2 / 4 / 16 the hold errs 1.1e-2 / 3.5e-3 / 2.3e-4, the bilinear form 5.2e-2 / 1.6e-2
// / 9.8e-4.
TEST(BesselBlur, ErrorsOfTextbookMethodsAreTheKnownOnes) {
    const double known[][3] = {{2, 1.1e-2, 5.2e-2}, {4, 3.5e-3, 1.6e-2}, {16, 2.3e-4, 9.8e-4}};
    for (const auto& [tau, hold, bilinear] : known) {
        double radius = tau * std::sqrt(2. / 3);
        Kernel truth = trueBessel(radius, reachOf(radius));
        EXPECT_NEAR(operatorError(bessel("hold", radius), truth, 1).oneAxis, hold, .12 * hold) << tau;
        EXPECT_NEAR(operatorError(bessel("bilinear", radius), truth, 1).oneAxis, bilinear, .12 * bilinear)
            << tau;
    }
}

// Where a FIR of the small image's recursion ended, at a millionth, a light of 60000 left .0035, eleven 8-bit
// steps.
TEST(BesselBlur, WhereDecimatedEndsDoesNotShow) {
    cv::Mat image(3, 1600, CV_32FC4, cv::Scalar(0, 0, 0, 1));
    image.colRange(0, 300).setTo(cv::Scalar(60000, 60000, 60000, 1));
    for (double radius : {58., 80.}) {
        const cv::Mat truth = onCpu(bessel("recursive", radius), image).colRange(1000, 1600);
        for (auto* run : {onCpu, onGl})
            EXPECT_LE(difference(run(bessel("decimated", radius), image).colRange(1000, 1600), truth),
                      .5 / 255 / 12.92)
                << radius;
    }
}

// What the plan takes for the kernel; it was once narrower by a third.
TEST(BesselBlur, ThePlansDensityIsTheKernels) {
    const double radius = 50;
    const Kernel truth = trueBessel(radius, 600);
    for (int d = 0; d <= 600; d++)
        EXPECT_NEAR(blur::besselDensity(d / radius) / radius, truth[d + 600], 2e-4 / radius) << d;
}

// At a radius of 5e-6 px a plan asked for the kernel 32 times a deviation all over a tile: 18 s.
TEST(BesselBlur, PlanningLooksNoFartherThanTheKernelReaches) {
    static long asked = 0;
    brume::FramePair frame;
    frame.color = cv::Mat(40, 60, CV_32FC4, cv::Scalar::all(.1));
    frame.depth = cv::Mat(40, 60, CV_32F, cv::Scalar(10));
    frame.camera = brume::Camera::withHorizontalView(frame.size(), 90);
    brume::PlanInput in;
    in.frame = brume::measureFrame(frame);
    in.scene = brume::deriveContextFor(frame, frame.size());
    in.input = in.frame.color;
    for (double radius : {1e-9, 5e-6, .01, 1., 100.}) {
        asked = 0;
        blur::Unseen unseen(in, {radius, 12, [](double x) { return asked++, blur::besselDensity(x); }});
        EXPECT_LT(asked, 30000) << radius;
    }
}

// A tolerance that just does not show was rounded to fp32, and half the time up: then a few taps lost to the
// recursion, four times as dear.
TEST(BesselBlur, AFewTapsAreChosenWhateverTheLights) {
    for (float light = 1; light < 40; light *= 1.1f) {
        brume::FramePair frame;
        frame.color = cv::Mat(40, 60, CV_32FC4, cv::Scalar::all(.1));
        frame.color.at<cv::Vec4f>(20, 30) = cv::Vec4f::all(light);
        frame.depth = cv::Mat(40, 60, CV_32F, cv::Scalar(10));
        frame.camera = brume::Camera::withHorizontalView(frame.size(), 90);
        const auto chain = brume::planChain(
            brume::parsePreset(
                R"({"effects": [{"effect": "bessel_blur", "radius": 0.1, "method": "auto", "tolerance": "auto"}]})",
                "test", brume::EffectRegistry::standard()),
            frame, brume::Backend::Cpu, {});
        EXPECT_NE(chain.steps.at(0).values.at("method").numbers.at(0), 1) << light;
    }
}

TEST(BesselBlur, ItsStandardDeviationIsTheRadius) {
    for (double radius : {2., 5., 9.}) {
        const int reach = reachOf(radius);
        cv::Mat impulse(1, 2 * reach + 1, CV_32FC4, cv::Scalar::all(0));
        impulse.at<cv::Vec4f>(0, reach) = {1, 1, 1, 1};
        cv::Mat blurred = onCpu(bessel("recursive", radius), impulse);
        double variance = 0;
        for (int d = -reach; d <= reach; d++) variance += d * d * blurred.at<cv::Vec4f>(0, d + reach)[0];
        // A pixel's own variance comes on top.
        EXPECT_NEAR(variance, radius * radius + 1. / 12, 2e-3 * radius * radius) << radius;
    }
}

TEST(BesselBlur, TransposedAndMirroredImagesGiveTransposedAndMirroredBlurs) {
    for (const char* method : methods)
        for (double radius : {.7, 2.5, 8., 20.}) {
            expectTransposed(bessel(method, radius), 5e-6);
            expectMirrored(bessel(method, radius), periodOf(method, radius) > 1 ? 1e-3 : 5e-6);
        }
}

// A step of the recursion rounds by a share of what it leaves, not of what it takes away: at radius .5 it
// leaves a twelfth. Measured: 9.4e-7 of the kernel's fading (poles counted from 1: 6.9e-5, in GLSL 6e-6).
TEST(BesselBlur, TheRecursionsRoundingFadesAsItsKernelDoes) {
    const cv::Size size(25, 25);
    for (double radius : {.5, .7, 1., 1.7, 2.2, 4.})
        for (auto* run : {onCpu, onGl}) {
            cv::Mat image(size, CV_32FC4, cv::Scalar::all(0));
            image.at<cv::Vec4f>(12, 12) = {1e4f, 1, 1, 1};
            const cv::Mat blurred = run(bessel("recursive", radius), image);
            const Kernel kernel = trueBessel(radius, 60);
            double worst = 0;
            for (int j = 0; j < size.height; j++)
                for (int i = 0; i < size.width; i++) {
                    const int across = std::abs(i - 12), down = std::abs(j - 12);
                    const double truth = 1e4 * kernel[60 + across] * kernel[60 + down],
                                 fading = std::exp(-1.5 * (across + down) * std::sqrt(2. / 3) / radius);
                    worst = std::max(
                        worst, std::abs(blurred.at<cv::Vec4f>(j, i)[0] - truth) / (1e4 * (fading + 1e-9)));
                }
            EXPECT_LE(worst, 1.5e-6) << radius << (run == onGl ? " GLSL" : " CPU");
        }
}

// The recursion goes down a tall image in bands, each of which looks only so far beyond itself; along the
// rows of a wide one it looks at everything. Measured: 4.7e-7.
TEST(BesselBlur, BandsOfTheRecursionDoNotShow) {
    for (double radius : {.5, 1., 3., 8., 20.})
        for (cv::Size size : {cv::Size(13, 1000), cv::Size(22, 517)}) {
            cv::Mat image = randomImage(size, 12), wide, blurred;
            image.at<cv::Vec4f>(size.height / 2, 3) = {40, NAN, 100, 1};
            cv::transpose(image, wide);
            cv::transpose(onCpu(bessel("recursive", radius), wide), blurred);
            EXPECT_LE(difference(onCpu(bessel("recursive", radius), image), blurred), 2e-6)
                << radius << " " << size;
        }
}

TEST(BesselBlur, MeanOfContentAwayFromEdgesIsKept) {
    for (const char* method : methods)
        for (double radius : {1., 4., 9.})
            expectMeanKept(bessel(method, radius), int(15 * radius) + 4,
                           periodOf(method, radius) > 1 ? 1e-3 : 5e-5);
}

TEST(BesselBlur, AStepBecomesTheIntegralOfTheKernel) {
    for (const char* method : {"fir", "recursive", "decimated", "auto"})
        for (double radius : {.5, 2., 7., 17.})
            expectStep(bessel(method, radius), trueBessel(radius, reachOf(radius)), 6e-4);
}

TEST(BesselBlur, EdgesReplicateAlsoOfImagesNarrowerThanTheKernel) {
    for (const char* method : methods)
        for (double radius : {.7, 3., 9., 16.}) {
            int period = periodOf(method, radius), reach = (int(16 * radius) + 8 + period) / period * period;
            // auto may choose otherwise for the larger image.
            expectEdgesReplicate(bessel(method, radius), reach, std::string(method) == "auto" ? 2e-3 : 1e-5);
        }
}

TEST(BesselBlur, OneBadPixelCountsAsOneBoundedPixel) {
    for (const char* method : methods)
        for (double radius : {.5, 3., 9.}) expectBadPixelsBounded(bessel(method, radius));
}

TEST(BesselBlur, SameBitsOnAnyNumberOfThreads) {
    for (const char* method : methods)
        for (double radius : {2., 13.}) expectSameBitsOnAnyThreads(bessel(method, radius));
}

TEST(BesselBlur, GlslMatches) {
    for (const char* method : methods)
        for (double radius : {.4, 3., 9., 60.})
            for (cv::Size size : {cv::Size(53, 31), cv::Size(3, 40), cv::Size(7, 300)})
                expectGlMatches(bessel(method, radius), size);
}

TEST(BesselBlur, TheoremsHoldInGlsl) {
    for (const char* method : {"fir", "recursive", "decimated", "auto"})
        for (double radius : {.7, 3., 9.})
            expectTheoremsInGlsl(bessel(method, radius), trueBessel(radius, reachOf(radius)),
                                 periodOf(method, radius), 6e-4);
}
