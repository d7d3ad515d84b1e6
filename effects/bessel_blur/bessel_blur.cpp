// bessel_blur: the second-order Bessel low-pass H(s) = 3/((sτ)² + 3sτ + 3), forward and back along rows, then
// columns (MODELS.md §6, Spirit Fog). Its kernel is r(x) = e^(-1.5a)·cos(√3·a/2 - π/3)/τ, a = |x|/τ, of
// standard deviation √(2/3)·τ: that is `radius`, in px of the full frame. Edges replicate; NaN counts as 0
// and ±inf as ±65504, alpha too.
//
//   fir        r integrated over each pixel, cut where the tails weigh less than `tolerance`
//   recursive  the same without a cut: r's integrals are one damped oscillation, which a recursion follows
//              (the CPU, where the kernel is short against the image, as one filter forward and back,)
//   decimated  boxes in a row, every factor-th pixel, the recursion again (a FIR in GLSL), the same boxes up:
//              error under `tolerance`, at most 1e-3
//   hold       the zero-order hold of H: error .02 at radius 1, 2.4e-3 at 4
//   bilinear   the bilinear transform of H, k = 2τ: error .14 at radius 1, .01 at 4
//
// Error means the L1 norm of the difference of impulse responses, at the worst place. Limits: radius 0 is the
// identity.
#include <opencv2/core.hpp>

#include "common/blur_bessel.hpp"
#include "common/blur_plan.hpp"
#include "common/blur_reference.hpp"
#include "common/blur_tried.hpp"
#include "common/cascade.hpp"
#include "common/decimated.hpp"
#include "common/recursion.hpp"
#include "effect/plugin.hpp"

namespace {

using namespace brume;

enum Method { fir, recursive, decimated, hold, bilinear };

struct BesselBlur {
    float radius, tolerance;
    int method;
};

// --- derived constants, fp64

double radiusOf(const BesselBlur& p, const DeriveContext& c) {
    return double(p.radius) * c.size.width / c.frameSize.width;
}

blur::Half tapsOf(const BesselBlur& p, const DeriveContext& c) {
    return p.method == fir ? blur::besselTaps(radiusOf(p, c), p.tolerance) : blur::Half{1};
}
std::vector<double> reach(const BesselBlur& p, const DeriveContext& c) {
    return {double(tapsOf(p, c).size()) - 1};
}

int factorOf(const BesselBlur& p, const DeriveContext& c) {
    return p.method == decimated ? blur::besselFactor(radiusOf(p, c), p.tolerance) : 1;
}
std::vector<double> factor(const BesselBlur& p, const DeriveContext& c) { return {double(factorOf(p, c))}; }
blur::Decimation decimationOf(const BesselBlur& p, const DeriveContext& c) {
    return blur::besselDecimation(factorOf(p, c));
}
std::vector<double> prefilterReach(const BesselBlur& p, const DeriveContext& c) {
    return {double(decimationOf(p, c).prefilter.size()) - 1};
}
std::vector<double> prefilter(const BesselBlur& p, const DeriveContext& c) {
    return decimationOf(p, c).prefilter;
}
blur::Half smallTaps(const BesselBlur& p, const DeriveContext& c) {
    return p.method == decimated ? blur::besselSmallTaps(radiusOf(p, c), factorOf(p, c)) : blur::Half{1};
}
std::vector<double> smallReach(const BesselBlur& p, const DeriveContext& c) {
    return {double(smallTaps(p, c).size()) - 1};
}
std::vector<double> enlarging(const BesselBlur& p, const DeriveContext& c) {
    return blur::enlargingWeights(decimationOf(p, c));
}

blur::Exponentials exponentialsOf(const BesselBlur& p, const DeriveContext& c) {
    double radius = radiusOf(p, c);
    blur::Exponentials none;
    none.terms.resize(1);
    if (radius <= 0 || p.method == fir) return none;
    if (p.method == decimated) return blur::besselSmall(radius, factorOf(p, c));
    if (p.method == hold) return blur::besselHold(radius);
    return p.method == bilinear ? blur::besselBilinear(radius) : blur::besselExponentials(radius);
}
std::vector<double> poleCount(const BesselBlur& p, const DeriveContext& c) {
    return {double(exponentialsOf(p, c).terms.size())};
}
std::vector<double> poles(const BesselBlur& p, const DeriveContext& c) {
    return exponentialsOf(p, c).packed();
}
std::vector<double> poleOrigin(const BesselBlur& p, const DeriveContext& c) {
    return {exponentialsOf(p, c).origin()};
}
std::vector<double> centerTap(const BesselBlur& p, const DeriveContext& c) {
    return {exponentialsOf(p, c).center};
}

// Where the CPU's bands take the recursion: reach is 0 elsewhere.
blur::Cascade cascadeNumbersOf(const BesselBlur& p, const DeriveContext& c) {
    if ((p.method != recursive && p.method != decimated) || radiusOf(p, c) < .4) return {};
    const blur::Exponentials e = exponentialsOf(p, c);
    blur::Cascade cascade = blur::cascadeOf(e);
    const int factor = factorOf(p, c),
              height = factor == 1 ? c.size.height : blur::smallLength(c.size.height, factor);
    if (factor > 1) cascade.reach = blur::reachOf(e.terms[0].pole, blur::besselSmallCut);
    return blur::isCascaded(height, cascade.reach) ? cascade : blur::Cascade{};
}
std::vector<double> cascadeReach(const BesselBlur& p, const DeriveContext& c) {
    return {double(cascadeNumbersOf(p, c).reach)};
}
std::vector<double> cascade(const BesselBlur& p, const DeriveContext& c) {
    return cascadeNumbersOf(p, c).packed();
}

// --- CPU

void run(const BesselBlur& p, const CpuContext& c) {
    cv::Mat out = c.output;
    if (p.method == fir) return blur::separableFir(c.input, out, c.derived("taps"), c.outputIsStreamed);
    blur::decimatedBlur(
        c.input, out, {int(c.derived("factor")[0]), c.derived("prefilter"), c.derived("enlarging")},
        c.outputIsStreamed, [&](const cv::Mat& from, cv::Mat& to, bool streams) {
            const int reach = int(c.derived("cascadeReach")[0]);
            if (reach > 0) return blur::cascadedBlur(from, to, c.derived("cascade"), reach, streams);
            blur::recursiveBlur(from, to,
                                {c.derived("poles"), c.derived("centerTap")[0], c.derived("poleOrigin")[0]});
        });
}

// --- reference, fp64: r integrated over each pixel by Simpson's rule, out to 14 τ

double kernelValue(double x, double tau) {
    double a = std::abs(x) / tau;
    return std::exp(-1.5 * a) * std::cos(std::sqrt(3) * a / 2 - CV_PI / 3) / tau;
}

// Half pixels, because r has a kink at 0; parts short against τ.
double integral(double from, double to, double tau) {
    int parts = 2 * std::clamp(int(std::ceil(40 * (to - from) / tau)), 2, 20000);
    double step = (to - from) / parts, sum = kernelValue(from, tau) + kernelValue(to, tau);
    for (int k = 1; k < parts; k++) sum += (k % 2 ? 4 : 2) * kernelValue(from + k * step, tau);
    return sum * step / 3;
}

std::vector<std::vector<double>> blurMatrix(double radius, int length) {
    double tau = radius / std::sqrt(2. / 3);
    int far = tau < .01 ? 0 : 1 + int(std::ceil(14 * tau));
    std::vector<double> weight(far + 1, 1);
    double sum = 1;
    if (far > 0) {
        sum = weight[0] = 2 * integral(0, .5, tau);
        for (int d = 1; d <= far; d++)
            sum += 2 * (weight[d] = integral(d - .5, d, tau) + integral(d, d + .5, tau));
    }
    return blur::blurMatrix(weight, sum, length);
}

double statedError(const BesselBlur& p, double radius) {
    switch (p.method) {
        case recursive:
            return 0;
        case decimated:
            return blur::besselFactor(radius, p.tolerance) == 1 ? 0 : std::min(1e-3, double(p.tolerance));
        case hold:
            return radius < .6 ? .35 : std::min(.2, .08 / (radius * radius));
        case bilinear:
            return radius < 1 ? 3 : std::min(1., .4 / (radius * radius));
        default:
            return p.tolerance;
    }
}

void reference(const BesselBlur& p, const ReferenceContext& c, std::span<const cv::Point> pixels,
               std::span<ReferencePixel> truth) {
    const double radius = double(p.radius) * c.input.cols / c.frameSize.width,
                 anywhere = statedError(p, radius);
    blur::separableReference(
        c, pixels, truth, [&](int length) { return blurMatrix(radius, length); },
        [&](const cv::Point&) { return anywhere; });
}

// --- plan

// FIRs of larger radii are not the cheapest.
constexpr double longestTried = 1.6;

// L1 norm of a method's kernel less the true one, as measured for the plan.
double kernelError(const BesselBlur& p, double radius) {
    if (p.method == hold) return std::min(.4, .06 / (radius * radius));
    constexpr double rounding = 1e-6;
    return p.method == fir ? statedError(p, radius) + rounding : std::max(rounding, statedError(p, radius));
}

// Frame copies on the CPU with two threads; `reach` of the FIR, or of the recursion's bands (0: it has none).
// Measured at 1920×1080 and, `isSmall`, at 1280×720, where caches hold more of a frame, on a CPU without
// AVX-512; with it FIRs take less.
double costOf(int method, int factor, int reach, bool isSmall) {
    if (method == fir) return .8 + .15 * reach;
    const double recursion = reach > 0 ? (isSmall ? 1.9 : 2.2) + 1e-5 * reach * reach : 2.9;
    if (factor == 1) return recursion;
    return (isSmall ? 1.4 + .8 / factor : 1 + 1.3 / factor) + recursion / (factor * factor);
}

Plan plan(const BesselBlur& p, const PlanInput& in) {
    Plan plan;
    // It overshoots beside edges, by the weight of the kernel's negative parts.
    const double overshoot = .02 * (in.input.high - in.input.low);
    plan.output = ImageBounds::anywhere(in.input.low - overshoot, in.input.high + overshoot);
    const double radius = radiusOf(p, in.scene);
    if (p.radius == 0) {
        plan.skip = true;
        plan.why = "a radius of 0 changes nothing";
        return plan;
    }
    const blur::Unseen unseen(in, {radius, 12, blur::besselDensity});
    const bool isSmall = in.frame.size.area() < 1400 * 1000;
    std::vector<blur::Choice> choices;
    auto offer = [&](int method, const char* name, double tolerance, double peak) {
        if (!in.chooses("method") && method != p.method) return;
        if (!in.chooses("tolerance")) tolerance = p.tolerance;
        const BesselBlur blur{p.radius, float(tolerance), method};
        // A tolerance that was asked for holds for what is chosen.
        const double error = kernelError(blur, radius);
        if (!in.chooses("tolerance") && in.chooses("method") && method != fir && method != recursive &&
            error > 1.001 * p.tolerance)
            return;
        const int reach = method == fir ? int(blur::besselTaps(radius, tolerance).size()) - 1
                                        : cascadeNumbersOf(blur, in.scene).reach;
        choices.push_back({method, name, tolerance, error, peak,
                           costOf(method, factorOf(blur, in.scene), reach, isSmall) * in.scene.size.area() /
                               in.frame.size.area()});
        if (factorOf(blur, in.scene) > 1) choices.back().likely = blur::likelihoodDecimated;
    };
    offer(recursive, "recursive", 1e-3, 4);
    for (blur::Choice& exact : choices) exact.share = unseen.share(exact);
    // The shortest that does not show; one that cannot, as far as the bounds go, is the last.
    const double surely =
        std::clamp(.999 * blur::likelihood / blur::likelihoodExact * unseen.error(1) - 1e-6, 1e-6, 1e-3);
    const blur::Half whole = blur::besselWhole(radius);
    const double coarsest = !in.chooses("tolerance") ? double(p.tolerance)
                            : radius > longestTried  ? surely
                                                     : 1e-3;
    for (double tolerance = coarsest;; tolerance = std::max(.999 * tolerance, surely)) {
        const size_t before = choices.size();
        const blur::Cut cut = blur::besselCut(whole, tolerance);
        // Rounded to fp32 it must not be less.
        if (in.chooses("tolerance")) tolerance = std::clamp(1.0001 * cut.error, 1e-6, tolerance);
        offer(fir, "fir", tolerance, 1);
        if (choices.size() == before) break;
        blur::Choice& choice = choices.back();
        choice.likely = blur::likelihoodExact;
        if (!in.chooses("tolerance")) break;
        if (radius <= longestTried && blur::isCheapest(choices)) {
            const int reach = int(whole.size()) - 1;
            const blur::ShortKernel kernel = {{blur::ShortKernel::whole(cut.taps, reach)},
                                              blur::ShortKernel::whole(whole, reach)};
            choice.shows = [&in, kernel](const cv::Rect& area) {
                return blur::showsWithin(in, kernel, area);
            };
        }
        choice.share = unseen.share(choice);
        if (choice.share <= 1 || tolerance <= surely) break;
        choices.pop_back();
    }
    // The coarsest that does not show.
    int factor = blur::besselFactor(radius, in.chooses("tolerance") ? 1e-3 : double(p.tolerance));
    do {
        offer(decimated, "decimated", blur::besselTolerance(radius, factor), 4);
        if (factor == 1 || choices.empty() || choices.back().method != decimated) break;
        choices.back().axis = blur::besselAxisError(radius, factor);
        choices.back().share = unseen.share(choices.back());
    } while (in.chooses("tolerance") && blur::besselTolerance(radius, factor) > 1e-6 &&
             choices.back().share > 1 && --factor > 1);
    offer(hold, "hold", 1e-3, 4);
    offer(bilinear, "bilinear", 1e-3, 4);
    blur::choose(plan, in, unseen, choices);
    return plan;
}

}  // namespace

BRUME_PLUGIN(EffectOf<BesselBlur>()
                 .bind("radius", &BesselBlur::radius)
                 .bind("tolerance", &BesselBlur::tolerance)
                 .bind("method", &BesselBlur::method)
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
                 .derive("cascadeReach", cascadeReach)
                 .derive("cascade", cascade)
                 .run(run)
                 .referenceImage(reference)
                 .plan(plan))
