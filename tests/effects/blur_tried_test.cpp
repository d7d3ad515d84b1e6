// Short kernels tried on the picture (common/blur_tried.hpp), and what plans make of it.
#include "common/blur_tried.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "apply/apply.hpp"
#include "common/blur_bessel.hpp"
#include "common/blur_gaussian.hpp"
#include "effect/preset.hpp"
#include "effects/blur_theorems.hpp"

using namespace blur_test;

static brume::FramePair frameOf(const cv::Mat& image) {
    brume::FramePair frame;
    frame.color = image;
    frame.depth = cv::Mat(image.size(), CV_32F, cv::Scalar(10));
    frame.camera = brume::Camera::withHorizontalView(frame.size(), 90);
    return frame;
}
static brume::PlanInput inputOf(const brume::FramePair& frame) {
    brume::PlanInput in;
    in.frame = brume::measureFrame(frame);
    in.scene = brume::deriveContextFor(frame, frame.size());
    in.input = in.frame.color;
    in.color = frame.color;
    return in;
}
static double looksApart(const brume::PlanInput& in, const cv::Mat& a, const cv::Mat& b,
                         const cv::Rect& area) {
    double most = 0;
    for (int y = area.y; y < area.br().y; y++)
        for (int x = area.x; x < area.br().x; x++)
            for (int n = 0; n < 3; n++)
                most = std::max(most, in.visible(a.at<cv::Vec4f>(y, x)[n], b.at<cv::Vec4f>(y, x)[n]));
    return most;
}

TEST(BlurTried, AKernelShowsAsMuchAsItsBlurDoes) {
    cv::Mat image = randomImage({83, 61}, 3) + cv::Scalar::all(.05);
    for (int k = 0; k < 12; k++) image.at<cv::Vec4f>(5 * k % 61, 17 * k % 83) = cv::Vec4f(400, 90, 9, 1);
    image.at<cv::Vec4f>(30, 40)[1] = NAN;
    const brume::FramePair frame = frameOf(image);
    const brume::PlanInput in = inputOf(frame);
    struct Case {
        Blur tried, wanted;
        blur::ShortKernel kernel;
    };
    std::vector<Case> cases;
    const blur::Half bessel = blur::besselWhole(1);
    cases.push_back(
        {{"bessel_blur", "fir", 1, 1e-3},
         {"bessel_blur", "recursive", 1},
         {{blur::ShortKernel::whole(blur::besselTaps(1, 1e-3), 15)}, blur::ShortKernel::whole(bessel, 15)}});
    for (double sigma : {2.65, 4.})  // by 2 and by 3
        cases.push_back({{"gaussian_blur", "decimated", sigma, 1e-3},
                         {"gaussian_blur", "fir", sigma, 1e-6},
                         {blur::decimatedRows(blur::gaussianDecimation(sigma, 1e-3),
                                              blur::gaussianSmallTaps(sigma, 1e-3), 34),
                          blur::ShortKernel::whole(blur::gaussianTaps(sigma, 34), 34)}});
    for (const Case& c : cases) {
        const cv::Mat made = onCpu(c.tried, image), wanted = onCpu(c.wanted, image);
        for (cv::Rect area : {cv::Rect(0, 0, 16, 16), cv::Rect(32, 16, 16, 16), cv::Rect(80, 48, 3, 13)}) {
            const double apart = looksApart(in, made, wanted, area);
            EXPECT_GT(apart, 5e-6) << c.tried.describe();
            EXPECT_NEAR(blur::showsWithin(in, c.kernel, area), apart, .03 * apart + 3e-6)
                << c.tried.describe() << " " << area;
        }
    }
}

// Steps of gray 35 and .09 beside each other, one with a lamp in it; a hole into which a short FIR's missing
// tails shine from all four sides.
static cv::Mat lampNearADarkWall() {
    cv::Mat image(160, 240, CV_32FC4, cv::Scalar(.8, .8, .8, 1));
    image.colRange(0, 100).setTo(cv::Scalar(.09, .09, .09, 1));
    image(cv::Rect(116, 70, 4, 4)).setTo(cv::Scalar(32, 32, 32, 1));
    return image;
}
static cv::Mat holeInALight(int size) {
    cv::Mat image(160, 240, CV_32FC4, cv::Scalar(.09, .09, .09, 1));
    image(cv::Rect(60, 40, 90, 80)).setTo(cv::Scalar(35, 35, 35, 1));
    image(cv::Rect(100, 70, size, size)).setTo(cv::Scalar(.09, .09, .09, 1));
    return image;
}
static brume::Chain planOf(const std::string& effect, double radius, const brume::FramePair& frame,
                           const std::string& method = "auto") {
    const std::string preset = R"({"effects": [{"effect": ")" + effect + R"(", "radius": )" +
                               std::to_string(radius) + R"(, "method": ")" + method +
                               R"(", "tolerance": "auto"}]})";
    return brume::planChain(brume::parsePreset(preset, "test", brume::EffectRegistry::standard()), frame,
                            brume::Backend::Cpu, {});
}
static double number(const brume::Chain& chain, const std::string& parameter) {
    return chain.steps.at(0).values.at(parameter).numbers.at(0);
}

TEST(BlurTried, AFirIsAsShortAsThePictureAllows) {
    const auto lamp = planOf("bessel_blur", 1, frameOf(lampNearADarkWall()), "fir");
    EXPECT_EQ(blur::besselTaps(1, number(lamp, "tolerance")).size(), 8u);
    for (int size : {11, 13, 15, 17}) {
        const cv::Mat image = holeInALight(size);
        const brume::FramePair frame = frameOf(image);
        const auto chain = planOf("bessel_blur", 1, frame, "fir");
        const Blur chosen = {"bessel_blur", "fir", 1, number(chain, "tolerance")};
        const cv::Mat truth = onCpu({"bessel_blur", "recursive", 1}, image);
        const cv::Rect all(0, 0, image.cols, image.rows);
        const brume::PlanInput in = inputOf(frame);
        EXPECT_LE(looksApart(in, onCpu(chosen, image), truth, all), in.tolerance) << size;
        if (size == 15) {
            EXPECT_GT(looksApart(in, onCpu({"bessel_blur", "fir", 1, 1e-3}, image), truth, all), in.tolerance)
                << "nothing to be careful about";
        }
    }
}

// Where the kernel passes through 0, some 4 radii beside lamps, all that is left may be its error.
TEST(BlurTried, ABesselIsDecimatedAsFarAsDoesNotShow) {
    for (double radius : {7., 10.}) {
        cv::Mat lamps(160, 240, CV_32FC4, cv::Scalar(.0005, .0005, .0005, 1));
        for (int k = 0; k < 12; k++)
            lamps(cv::Rect(20 * k, 13 * k % 150, 3, 3)).setTo(cv::Scalar(3000, 300, 30, 1));
        const brume::FramePair frame = frameOf(lamps);
        const brume::PlanInput in = inputOf(frame);
        const cv::Mat truth = onCpu({"bessel_blur", "recursive", radius}, lamps);
        auto shows = [&](double tolerance) {
            return looksApart(in, onCpu({"bessel_blur", "decimated", radius, tolerance}, lamps), truth,
                              cv::Rect({0, 0}, lamps.size()));
        };
        EXPECT_GT(shows(1e-3), in.tolerance) << radius << ": nothing to be careful about";
        const auto chain = planOf("bessel_blur", radius, frame);
        if (number(chain, "method") == 2) {
            EXPECT_LE(shows(number(chain, "tolerance")), in.tolerance) << radius;
        } else {
            EXPECT_EQ(number(chain, "method"), 1) << radius;
        }
    }
}

TEST(BlurTried, AGaussianIsDecimatedWhereThatDoesNotShow) {
    for (double sigma : {2.65, 2.8, 3.}) {
        const auto lamp = planOf("gaussian_blur", sigma, frameOf(lampNearADarkWall()));
        EXPECT_EQ(number(lamp, "method"), 2) << sigma;
        EXPECT_FLOAT_EQ(float(number(lamp, "tolerance")), 1e-3f) << sigma;
    }
}

TEST(BlurTried, FirsHaveNoTapTooManyForTheirTolerance) {
    for (double radius : {.3, .5, 1., 1.7, 3.})
        for (double tolerance : {1e-2, 1e-3, 1e-4, 1e-5}) {
            const blur::Half whole = blur::besselWhole(radius);
            const blur::Cut cut = blur::besselCut(whole, tolerance);
            auto errorOf = [&](const blur::Half& taps) {
                auto at = [](const blur::Half& half, size_t k) { return k < half.size() ? half[k] : 0; };
                double error = 0;
                for (size_t j = 0; j < whole.size(); j++)
                    for (size_t i = 0; i < whole.size(); i++)
                        error += (j ? 2 : 1) * (i ? 2 : 1) *
                                 std::abs(at(taps, i) * at(taps, j) - whole[i] * whole[j]);
                return error;
            };
            EXPECT_LE(cut.error, tolerance);
            EXPECT_NEAR(errorOf(cut.taps), cut.error, .03 * cut.error + 1e-8) << radius << " " << tolerance;
            for (size_t size = 1; size < cut.taps.size(); size++)
                EXPECT_GT(
                    errorOf(blur::normalised(blur::Half(whole.begin(), whole.begin() + ptrdiff_t(size)))),
                    .96 * tolerance)
                    << radius << " " << tolerance << " " << size;
            EXPECT_EQ(blur::besselTaps(radius, 1.0001 * cut.error + 1e-9).size(), cut.taps.size());
        }
}

// Crossing beams of a black frame, the place between them dark: all that comes there is a kernel's tails.
TEST(BlurTried, ADecimatedGaussianIsTakenToShowAsMuchOfItsErrorAsAFir) {
    const double sigma = 3.7778;
    cv::Mat image(159, 45, CV_32FC4, cv::Scalar(0, 0, 0, 1));
    for (int j = 0; j < image.rows; j++)
        for (int i = 0; i < image.cols; i++) {
            const int x = std::abs(i - 22), y = std::abs(j - 79);
            if ((x >= 17 && x <= 28) || (y >= 17 && y <= 28))
                image.at<cv::Vec4f>(j, i) = {54.94f, 54.94f, 54.94f, 1};
        }
    const brume::FramePair frame = frameOf(image);
    const brume::PlanInput in = inputOf(frame);
    auto shows = [&](double tolerance) {
        return looksApart(in, onCpu({"gaussian_blur", "decimated", sigma, tolerance}, image),
                          onCpu({"gaussian_blur", "fir", sigma, 1e-6}, image),
                          cv::Rect({0, 0}, image.size()));
    };
    EXPECT_GT(shows(1e-3), in.tolerance) << "nothing to be careful about";
    const auto chain = planOf("gaussian_blur", sigma, frame);
    ASSERT_EQ(number(chain, "method"), 2);
    EXPECT_LE(shows(number(chain, "tolerance")), in.tolerance);
}
