// What any blur of radius r must satisfy, whatever its method; gaussian_blur's and bessel_blur's tests share
// it.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "effect/effect.hpp"

namespace blur_test {

struct Blur {
    std::string effect, method;  ///< method "auto": whatever the plan decides
    double radius = 0;
    double tolerance = 1e-3;  ///< given, so that a method is the same one on every image
    bool isGlsl = false;      ///< what the theorems below run
    std::string describe() const;
};

cv::Mat randomImage(cv::Size size, unsigned seed);
cv::Mat onCpu(const Blur& blur, const cv::Mat& image);
cv::Mat onGl(const Blur& blur, const cv::Mat& image);
/// On the side that isGlsl says.
cv::Mat blurred(const Blur& blur, const cv::Mat& image);

/// Largest |a - b| over the largest |b|; infinite where classes differ.
double difference(const cv::Mat& a, const cv::Mat& b);

/// A kernel of odd length, its centre in the middle.
using Kernel = std::vector<double>;

/// Rows of the operator along x, one for each position of the output within a period of `period` px, against
/// `truth`: the L1 norm of the difference at the worst position, of one axis and of the separable pair.
struct OperatorError {
    double oneAxis = 0, pair = 0;
    std::vector<Kernel> rows;
};
OperatorError operatorError(const Blur& blur, const Kernel& truth, int period);

/// Of every pixel: what the reference says the method may be off by.
void expectWithinStatedError(const Blur& blur, const cv::Mat& image);
void expectConstantsKept(const Blur& blur);
void expectTransposed(const Blur& blur, double bound);
void expectMirrored(const Blur& blur, double bound, cv::Size size = {61, 45});
void expectMeanKept(const Blur& blur, int reach, double bound);
void expectStep(const Blur& blur, const Kernel& truth, double bound);
void expectEdgesReplicate(const Blur& blur, int reach, double bound);
void expectBadPixelsBounded(const Blur& blur);
/// All of these in the GLSL half; a step's values within `stepBound`.
void expectTheoremsInGlsl(Blur blur, const Kernel& truth, int period, double stepBound);
void expectSameBitsOnAnyThreads(const Blur& blur);
void expectGlMatches(const Blur& blur, cv::Size size);

}  // namespace blur_test
