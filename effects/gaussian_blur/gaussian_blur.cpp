// gaussian_blur: each pixel the Gaussian-weighted mean of its surroundings, standard deviation `radius` px of
// the full frame (MODELS.md §5). Rows and columns apart; edges replicate; NaN counts as 0 and ±inf as
// ±65504, alpha too.
//
//   fir          a sampled Gaussian, cut where the tails weigh less than `tolerance`
//   recursive    a sum of three complex exponentials, forward and back: error 1.4e-5 a dimension, any radius
//   decimated    boxes in a row, every factor-th pixel, a small FIR, the same boxes up: error under
//                `tolerance`, and 1e-3
//   box          three extended boxes by running sums: error .11, of edges' pixels up to .77
//   pascal       an even row of Pascal's triangle as a FIR (the ocean fog's blur of its noise)
//   dual_filter  the GPU's pyramid of bilinear taps: error .28 and more
//
// Error means the L1 norm of the difference of impulse responses, at the worst place: what an input of
// magnitude 1 can come to. Limits: radius 0 is the identity; radius → ∞ the mean of what the replicated edges
// continue.
#include <opencv2/core.hpp>

#include "common/blur_gaussian.hpp"
#include "common/blur_plan.hpp"
#include "common/blur_reference.hpp"
#include "common/blur_tried.hpp"
#include "common/box.hpp"
#include "common/decimated.hpp"
#include "common/dual_filter.hpp"
#include "common/recursion.hpp"
#include "effect/plugin.hpp"

namespace {

using namespace brume;

enum Method { fir, recursive, decimated, box, pascal, dualFilter };

struct GaussianBlur {
    float radius, tolerance;
    int method;
};

// --- derived constants, fp64

double sigmaOf(const GaussianBlur& p, const DeriveContext& c) {
    return double(p.radius) * c.size.width / c.frameSize.width;
}

blur::Half tapsOf(const GaussianBlur& p, const DeriveContext& c) {
    double sigma = sigmaOf(p, c);
    if (p.method == fir) return blur::gaussianTaps(sigma, blur::gaussianReach(sigma, p.tolerance));
    if (p.method == pascal) return blur::pascalTaps(sigma, p.tolerance);
    return {1};
}
std::vector<double> reach(const GaussianBlur& p, const DeriveContext& c) {
    return {double(tapsOf(p, c).size()) - 1};
}

blur::Decimation decimationOf(const GaussianBlur& p, const DeriveContext& c) {
    return p.method == decimated ? blur::gaussianDecimation(sigmaOf(p, c), p.tolerance) : blur::Decimation{};
}
std::vector<double> factor(const GaussianBlur& p, const DeriveContext& c) {
    return {double(decimationOf(p, c).factor)};
}
std::vector<double> prefilterReach(const GaussianBlur& p, const DeriveContext& c) {
    return {double(decimationOf(p, c).prefilter.size()) - 1};
}
std::vector<double> prefilter(const GaussianBlur& p, const DeriveContext& c) {
    return decimationOf(p, c).prefilter;
}
std::vector<double> smallReach(const GaussianBlur& p, const DeriveContext& c) {
    return {p.method == decimated ? double(blur::gaussianSmallReach(sigmaOf(p, c), p.tolerance)) : 0.};
}
std::vector<double> smallTaps(const GaussianBlur& p, const DeriveContext& c) {
    return p.method == decimated ? blur::gaussianSmallTaps(sigmaOf(p, c), p.tolerance) : blur::Half{1};
}
std::vector<double> enlarging(const GaussianBlur& p, const DeriveContext& c) {
    return blur::enlargingWeights(decimationOf(p, c));
}

blur::Exponentials exponentialsOf(const GaussianBlur& p, const DeriveContext& c) {
    blur::Exponentials none;
    none.terms.resize(1);
    return p.method == recursive && sigmaOf(p, c) > 0 ? blur::gaussianExponentials(sigmaOf(p, c)) : none;
}
std::vector<double> poleCount(const GaussianBlur& p, const DeriveContext& c) {
    return {double(exponentialsOf(p, c).terms.size())};
}
std::vector<double> poles(const GaussianBlur& p, const DeriveContext& c) {
    return exponentialsOf(p, c).packed();
}
std::vector<double> poleOrigin(const GaussianBlur& p, const DeriveContext& c) {
    return {exponentialsOf(p, c).origin()};
}
std::vector<double> centerTap(const GaussianBlur& p, const DeriveContext& c) {
    return {exponentialsOf(p, c).center};
}

std::vector<double> boxReach(const GaussianBlur& p, const DeriveContext& c) {
    return {double(blur::extendedBox(sigmaOf(p, c)).reach)};
}
std::vector<double> boxWeights(const GaussianBlur& p, const DeriveContext& c) {
    auto b = blur::extendedBox(sigmaOf(p, c));
    double weight = 1 / (2 * b.reach + 1 + 2 * b.share);
    return {weight, b.share * weight};
}

std::vector<double> dualLevels(const GaussianBlur& p, const DeriveContext& c) {
    return {double(blur::dualFilter(sigmaOf(p, c)).levels)};
}
std::vector<double> dualOffset(const GaussianBlur& p, const DeriveContext& c) {
    return {double(blur::dualFilter(sigmaOf(p, c)).offset)};
}
std::vector<double> dualShare(const GaussianBlur& p, const DeriveContext& c) {
    return {double(blur::dualFilter(sigmaOf(p, c)).share)};
}

// --- CPU

void run(const GaussianBlur& p, const CpuContext& c) {
    cv::Mat out = c.output;
    if (p.method == recursive)
        blur::recursiveBlur(c.input, out,
                            {c.derived("poles"), c.derived("centerTap")[0], c.derived("poleOrigin")[0]});
    else if (p.method == decimated)
        blur::decimatedBlur(c.input, out,
                            {int(c.derived("factor")[0]), c.derived("prefilter"), c.derived("enlarging")},
                            c.outputIsStreamed, [&](const cv::Mat& from, cv::Mat& to, bool streams) {
                                blur::separableFir(from, to, c.derived("smallTaps"), streams);
                            });
    else if (p.method == box)
        blur::boxBlur(
            c.input, out,
            {int(c.derived("boxReach")[0]), c.derived("boxWeights")[0], c.derived("boxWeights")[1]});
    else if (p.method == dualFilter)
        blur::dualBlur(
            c.input, out,
            {int(c.derived("dualLevels")[0]), c.derived("dualOffset")[0], c.derived("dualShare")[0]});
    else
        blur::separableFir(c.input, out, c.derived("taps"), c.outputIsStreamed);
}

// --- reference, fp64: every weight out to 8.5 standard deviations

std::vector<std::vector<double>> blurMatrix(double sigma, int length) {
    int far = int(std::ceil(8.5 * sigma));
    std::vector<double> weight(far + 1, 1);
    double sum = 0;
    for (int d = -far; d <= far; d++) {
        if (sigma > 0) weight[std::abs(d)] = std::exp(-double(d) * d / (2 * sigma * sigma));
        sum += weight[std::abs(d)];
    }
    return blur::blurMatrix(weight, sum, length);
}

// Of three boxes along one axis, so many px from the nearest edge. Within their reach each box replicates the
// edge of what the one before it made: an edge pixel's kernel is off by .11 at σ = 1, .332 at 2, .367 at 4,
// .3812 at 33 and no more than .383 in the limit; elsewhere by .0675 at most (σ = 1.42). Below σ = 1, where a
// box is hardly more than a pixel, by .167 (.34) anywhere. Computed from the weights, all positions of lines
// of any length.
double boxError(int fromEdge, double sigma) {
    return sigma < 1 ? .17 : fromEdge < 3 * (sigma + 1) ? .385 : .07;
}

double statedError(const GaussianBlur& p, double sigma) {
    switch (p.method) {
        case recursive:
            return 1e-4;
        case decimated:
            return std::max(1e-4, std::min(1e-3, double(p.tolerance)));
        case box:
            return 2 * boxError(0, sigma);
        case pascal:
            return sigma < 1 ? 1.2 : p.tolerance + .4 / sigma;
        case dualFilter:
            // Measured over all positions: .754 at .7, .438 at 2.2, .273 at 2.9; 2 is the most two kernels
            // differ by.
            return sigma < 1.3 ? .8 : sigma < 2.88 ? .5 : sigma <= 106 ? .28 : 2;
        default:
            return p.tolerance;
    }
}

void reference(const GaussianBlur& p, const ReferenceContext& c, std::span<const cv::Point> pixels,
               std::span<ReferencePixel> truth) {
    const int width = c.input.cols, height = c.input.rows;
    const double sigma = double(p.radius) * width / c.frameSize.width, anywhere = statedError(p, sigma);
    blur::separableReference(
        c, pixels, truth, [&](int length) { return blurMatrix(sigma, length); },
        [&](const cv::Point& at) {
            if (p.method != box) return anywhere;
            // Both kernels are above 0: a pair's error is at most the sum of the axes'.
            return boxError(std::min(at.x, width - 1 - at.x), sigma) +
                   boxError(std::min(at.y, height - 1 - at.y), sigma);
        });
}

// --- plan

// Of larger σ the first decimation will do, and trying kernels takes longer.
constexpr double longestTried = 3.2;

// Larger factors' kernels are long, and their errors near what they are stated to be.
constexpr int largestTabulated = 4;

// Of fir and decimated.
blur::ShortKernel kernelOf(int method, double sigma, double tolerance) {
    using blur::ShortKernel;
    const int reach = int(std::ceil(6 * sigma)) + 1;
    const std::vector<double> wanted = ShortKernel::whole(blur::gaussianTaps(sigma, reach), reach);
    if (method == decimated) {
        const blur::Decimation d = blur::gaussianDecimation(sigma, tolerance);
        if (d.factor > 1)
            return {blur::decimatedRows(d, blur::gaussianSmallTaps(sigma, tolerance), reach), wanted};
    }
    const blur::Half taps = blur::gaussianTaps(sigma, blur::gaussianReach(sigma, tolerance));
    return {{ShortKernel::whole(taps, reach)}, wanted};
}

// L1 norm of a method's kernel less the true one, as measured for the plan (statedError bounds what a check
// allows, which includes rounding).
double kernelError(int method, double sigma, double tolerance) {
    if (method == recursive) return 3e-5;
    if (method != decimated) return statedError({0, float(tolerance), method}, sigma);
    const blur::Decimation d = blur::gaussianDecimation(sigma, tolerance);
    if (d.factor == 1) return tolerance;
    if (d.factor > largestTabulated) return std::min(tolerance, 1e-3);
    // Mostly far less than the tolerance, which is kept from a least σ of the factor on.
    const blur::ShortKernel kernel = kernelOf(method, sigma, tolerance);
    double worst = 0;
    for (size_t a = 0; a < kernel.rows.size(); a++)
        for (size_t b = 0; b <= a; b++) {
            double sum = 0;
            for (size_t j = 0; j < kernel.wanted.size(); j++)
                for (size_t i = 0; i < kernel.wanted.size(); i++)
                    sum +=
                        std::abs(kernel.rows[a][i] * kernel.rows[b][j] - kernel.wanted[i] * kernel.wanted[j]);
            worst = std::max(worst, sum);
        }
    return std::min(std::max(worst, 1e-6), tolerance);
}

// Frame copies on the CPU at 1920×1080 with two threads. Decimated by 1 is a FIR.
double costOf(int method, double sigma, double tolerance, int reach) {
    switch (method) {
        case fir:
        case pascal:
            return .8 + .15 * reach;
        case recursive:
            return 6.6;
        case decimated:
            if (blur::gaussianFactor(sigma, tolerance) == 1) return costOf(fir, sigma, tolerance, reach);
            return 1.2 + 2.1 / blur::gaussianFactor(sigma, tolerance);
        case dualFilter:
            return sigma < 32 ? 330 : 550;
        default:
            return 10;
    }
}

Plan plan(const GaussianBlur& p, const PlanInput& in) {
    Plan plan;
    plan.output = ImageBounds::anywhere(in.input.low, in.input.high);
    const double sigma = sigmaOf(p, in.scene);
    if (p.radius == 0) {
        plan.skip = true;
        plan.why = "a radius of 0 changes nothing";
        return plan;
    }
    const blur::Unseen unseen(in, {sigma, 5, blur::gaussianDensity});
    std::vector<blur::Choice> choices;
    auto offer = [&](int method, const char* name, double tolerance, double peak) {
        if (!in.chooses("method") && method != p.method) return;
        // An infinite pixel counts as 65504: sums that hold it are rounded to steps that show, least in
        // decimated.
        const bool isInfinite = std::max(in.input.high, -in.input.low) >= 65504,
                   isOnlyChoice = isInfinite && sigma >= 3.5 && in.chooses("method");
        if (isOnlyChoice && method != decimated) return;
        if (!in.chooses("tolerance")) tolerance = p.tolerance;
        // A tolerance that was asked for holds for what is chosen.
        const double error = kernelError(method, sigma, tolerance);
        if (!in.chooses("tolerance") && in.chooses("method") && error > 1.001 * p.tolerance &&
            method != recursive && !isOnlyChoice)
            return;
        const int reach = method == pascal ? int(blur::pascalTaps(sigma, tolerance).size()) - 1
                                           : blur::gaussianReach(sigma, tolerance);
        choices.push_back(
            {method, name, tolerance, error, peak,
             costOf(method, sigma, tolerance, reach) * in.scene.size.area() / in.frame.size.area()});
        // Of tabulated kernels all of the error is known, as of a FIR's: there is none that only others have.
        if (method == decimated && blur::gaussianFactor(sigma, tolerance) > largestTabulated)
            choices.back().likely = blur::likelihoodDecimated;
    };
    auto tryIt = [&](blur::Choice& choice) {
        if (sigma <= longestTried && blur::isCheapest(choices))
            choice.shows = [&in, kernel = kernelOf(choice.method, sigma, choice.tolerance)](
                               const cv::Rect& area) { return blur::showsWithin(in, kernel, area); };
        choice.share = unseen.share(choice);
    };
    // The shortest FIR that does not show; one that cannot, as far as the bounds go, is the last. A little
    // less than would show: rounded to fp32 it must not be more.
    const double surely = std::clamp(.999 * unseen.error(1.5), 1e-6, 1e-3);
    int reach = blur::gaussianReach(sigma, sigma > longestTried || !in.chooses("tolerance") ? surely : 1e-3);
    for (bool isLast = false; !isLast; reach++) {
        const double tolerance = std::clamp(1.0001 * blur::gaussianCutError(sigma, reach), surely, 1e-3);
        const size_t before = choices.size();
        offer(fir, "fir", tolerance, 1.5);
        if (choices.size() == before) break;
        tryIt(choices.back());
        isLast = choices.back().share <= 1 || tolerance <= surely || !in.chooses("tolerance");
        if (!isLast) choices.pop_back();
    }
    offer(recursive, "recursive", 1e-3, 4);
    // Tolerances that stay from frame to frame where these will do.
    for (double tolerance : {1e-3, 1e-4, 1e-5}) {
        const size_t before = choices.size();
        offer(decimated, "decimated", tolerance, 3);
        if (choices.size() > before && tolerance == 1e-3 && blur::gaussianFactor(sigma, tolerance) > 1)
            tryIt(choices.back());
    }
    double most = .999 * blur::likelihood / blur::likelihoodDecimated * unseen.error(3);
    if (blur::gaussianFactor(sigma, std::clamp(most, 1e-5, 1e-3)) <= largestTabulated)
        most *= blur::likelihoodDecimated / blur::likelihood;
    offer(decimated, "decimated", std::clamp(most, 1e-5, 1e-3), 3);
    offer(box, "box", 1e-3, 4);
    offer(pascal, "pascal", 1e-3, 4);
    offer(dualFilter, "dual_filter", 1e-3, 4);
    blur::choose(plan, in, unseen, choices);
    return plan;
}

}  // namespace

BRUME_PLUGIN(EffectOf<GaussianBlur>()
                 .bind("radius", &GaussianBlur::radius)
                 .bind("tolerance", &GaussianBlur::tolerance)
                 .bind("method", &GaussianBlur::method)
                 .derive("reach", reach)
                 .derive("taps", tapsOf)
                 .derive("factor", factor)
                 .derive("prefilterReach", prefilterReach)
                 .derive("prefilter", prefilter)
                 .derive("smallReach", smallReach)
                 .derive("smallTaps", smallTaps)
                 .derive("enlarging", enlarging)
                 .derive("poleCount", poleCount)
                 .derive("poles", poles)
                 .derive("poleOrigin", poleOrigin)
                 .derive("centerTap", centerTap)
                 .derive("boxReach", boxReach)
                 .derive("boxWeights", boxWeights)
                 .derive("dualLevels", dualLevels)
                 .derive("dualOffset", dualOffset)
                 .derive("dualShare", dualShare)
                 .run(run)
                 .referenceImage(reference)
                 .plan(plan))
