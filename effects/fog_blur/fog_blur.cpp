// fog_blur: blur that grows with the fog in front of a surface (MODELS.md §8; Gawron and Boryczka 2018,
// §3.4).
//
//   σ(p) = radius·clamp((α - start)/(1 - start), 0, 1)^falloff, px of the full frame,
//          α = 1 - the mean of T's channels
//
//   blur(p) = Σ_q g(|p - q|; σ(p))·w·C(q) / Σ_q g·w,
//             w = min(1, σ(q)/σ(p)) where edges are kept, else 1
//
//   separate: C is the foggy picture, out = blur
//
//   single: C is the clear one, out = foggy + T·(blur - C)
//
// Where w leaves less than .05 of the Gaussian's weight, the pixel itself fills it up to that. Edges of the
// picture replicate; NaN counts as 0 and ±inf as ±65504; alpha passes through. Limits: σ = 0 is the identity.
//
//   ladder  a pixel takes four neighbouring images of a ladder of blurred ones, with the weights that come
//           nearest its own Gaussian; variances double from one image to the next (rungs: in 2, 4 or 8
//           steps): within .02 (L1; .004, .001) where edges bleed
//   gather  the definition, its Gaussian cut at 4σ
//
// The paper's 5×5 table sums to .98; a Gaussian of σ = 1 normalised takes its place.
#include <cmath>
#include <opencv2/core.hpp>

#include "effect/plugin.hpp"
#include "fog_blur/derived.hpp"
#include "fog_blur/methods.hpp"
#include "fog_blur/plan.hpp"

namespace {

using namespace brume;
using namespace fog_blur;

// --- reference, fp64

double boundedValue(float x) {
    return std::isnan(x) ? 0. : std::isinf(x) ? std::copysign(65504., double(x)) : double(x);
}

std::vector<double> foldedWeights(double sigma, int at, int length) {
    std::vector<double> weights(length, 0);
    int far = int(std::ceil(8.5 * sigma));
    double sum = 0;
    for (int d = -far; d <= far; d++) {
        double w = sigma > 0 ? std::exp(-double(d) * d / (2 * sigma * sigma)) : 1;
        weights[std::clamp(at + d, 0, length - 1)] += w;
        sum += w;
    }
    for (double& w : weights) w /= sum;
    return weights;
}

void reference(const FogBlur& p, const ReferenceContext& c, std::span<const cv::Point> pixels,
               std::span<ReferencePixel> truth) {
    const cv::Mat& source = p.order == single ? c.image("clear") : c.input;
    const cv::Mat& through = c.image("transmittance");
    const int width = source.cols, height = source.rows;
    auto sigmaAt = [&](int y, int x) {
        double sum = 0;
        for (int n = 0; n < 3; n++) sum += boundedValue(through.at<cv::Vec4f>(y, x)[n]);
        double share = std::clamp((1 - sum / 3 - p.start) / (1 - double(p.start)), 0., 1.);
        return share > 0 ? double(p.radius) * width / c.frameSize.width * std::pow(share, double(p.falloff))
                         : 0.;
    };
    double largest = 1;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            for (int n = 0; n < 4; n++)
                largest = std::max({largest, std::abs(boundedValue(source.at<cv::Vec4f>(y, x)[n])),
                                    std::abs(boundedValue(c.input.at<cv::Vec4f>(y, x)[n]))});
    for (size_t k = 0; k < pixels.size(); k++) {
        const cv::Point at = pixels[k];
        double sigma = sigmaAt(at.y, at.x), weight = 0, strongest = 1;
        auto across = foldedWeights(sigma, at.x, width), down = foldedWeights(sigma, at.y, height);
        cv::Vec3d sum, self;
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++) {
                double w = across[x] * down[y];
                if (w == 0) continue;
                if (p.edges == keep && sigma > 0) w *= std::min(1., sigmaAt(y, x) / sigma);
                weight += w;
                for (int n = 0; n < 3; n++) sum[n] += w * boundedValue(source.at<cv::Vec4f>(y, x)[n]);
            }
        double enough = std::max(weight, .05);
        for (int n = 0; n < 3; n++) {
            self[n] = boundedValue(source.at<cv::Vec4f>(at)[n]);
            sum[n] = (sum[n] + (enough - weight) * self[n]) / enough;
            double t = boundedValue(through.at<cv::Vec4f>(at)[n]);
            if (p.order == single)
                sum[n] = boundedValue(c.input.at<cv::Vec4f>(at)[n]) + t * (sum[n] - self[n]);
            truth[k].color[n] = sum[n];
            if (p.order == single) strongest = std::max(strongest, std::abs(t));
        }
        truth[k].color[3] = c.input.at<cv::Vec4f>(at)[3];
        truth[k].scale = largest * strongest;
        // What the methods state, over the share of the weight that they divide by; the small σ that fp32
        // cannot tell.
        double stated = statedError(p);
        truth[k].methodError = sigma > 0 ? stated * truth[k].scale / (p.edges == keep ? enough : 1) : 0;
        // 4 half ulp of the brightest value, which every level of the ladder may hold a share of and the
        // weighing of levels then takes away again.
        if (sigma > 0) truth[k].allowance = 2.4e-7 * truth[k].scale;
    }
}

}  // namespace

BRUME_PLUGIN(EffectOf<FogBlur>()
                 .bind("radius", &FogBlur::radius)
                 .bind("start", &FogBlur::start)
                 .bind("falloff", &FogBlur::falloff)
                 .bind("order", &FogBlur::order)
                 .bind("edges", &FogBlur::edges)
                 .bind("method", &FogBlur::method)
                 .bind("rungs", &FogBlur::rungs)
                 .derive("largestSigma", largestSigma)
                 .derive("levelCount", levelCount)
                 .derive("levels", levels)
                 .derive("levelTables", levelTables)
                 .derive("stripWidth", stripWidth)
                 .derive("tapCount", tapCount)
                 .derive("levelTaps", levelTaps)
                 .derive("prefilterCount", prefilterCount)
                 .derive("prefilters", prefilters)
                 .derive("phaseCount", phaseCount)
                 .derive("phases", phases)
                 .derive("nodeWeights", nodeWeights)
                 .run(run)
                 .referenceImage(reference)
                 .plan(plan))
