// fog_blur: blur that grows with the fog in front of a surface (MODELS.md §8; Gawron and Boryczka 2018,
// §3.4).
//
//   σ(p) = radius·clamp((α - start)/(1 - start), 0, 1)^falloff, px of the full frame; α = 1 - the mean of T's
//   channels blur(p) = Σ_q g(|p - q|; σ(p))·w·C(q) / Σ_q g·w,  w = min(1, σ(q)/σ(p)) where edges are kept,
//   else 1 separate: C is the foggy picture, out = blur.  single: C is the clear one, out = foggy + T·(blur -
//   C)
//
// Where w leaves less than .05 of the Gaussian's weight, the pixel itself fills it up to that. Edges of the
// picture replicate; NaN counts as 0 and ±inf as ±65504; alpha passes through. Limits: σ = 0 is the identity.
//
//   ladder  a pixel takes four neighbouring images of a ladder of blurred ones, variances doubling from one
//   to the next,
//           with the weights that come nearest its own Gaussian: within .02 (L1) where edges bleed
//   gather  the definition, its Gaussian cut at 4σ
//
// The paper's 5×5 table sums to .98; a Gaussian of σ = 1 normalised takes its place.
#include <cmath>
#include <opencv2/core.hpp>

#include "common/blur_plan.hpp"
#include "effect/plugin.hpp"
#include "fog_blur/ladder_cpu.hpp"
#include "fog_blur/ladder_design.hpp"

namespace {

using namespace brume;
using fog_blur::Level;

enum Method { ladderMethod, gatherMethod };
enum Order { separate, single };
enum Edges { keep, bleed };

struct FogBlur {
    float radius, start, falloff;
    int order, edges, method;
};

// --- derived constants, fp64

double largestOf(const FogBlur& p, const DeriveContext& c) {
    return double(p.radius) * c.size.width / c.frameSize.width;
}
std::vector<Level> ladderOf(const FogBlur& p, const DeriveContext& c) {
    return fog_blur::ladderOf(largestOf(p, c), c.size.width, c.size.height);
}
std::vector<double> largestSigma(const FogBlur& p, const DeriveContext& c) { return {largestOf(p, c)}; }
std::vector<double> levelCount(const FogBlur& p, const DeriveContext& c) {
    return {double(ladderOf(p, c).size())};
}
std::vector<double> levels(const FogBlur& p, const DeriveContext& c) {
    std::vector<double> numbers;
    double left = 0;
    for (const Level& l : ladderOf(p, c)) {
        for (double x : {l.sigma, double(l.factor), left, double(l.reach)}) numbers.push_back(x);
        left += l.width;
    }
    return numbers;
}
std::vector<double> levelTables(const FogBlur& p, const DeriveContext& c) {
    std::vector<double> numbers;
    double taps = 0, prefilter = 0, phase = 0;
    for (const Level& l : ladderOf(p, c)) {
        for (double x : {taps, prefilter, phase, double(l.width)}) numbers.push_back(x);
        taps += l.reach + 1, prefilter += fog_blur::prefilterReach(l.factor) + 1, phase += l.factor;
    }
    return numbers;
}
std::vector<double> stripWidth(const FogBlur& p, const DeriveContext& c) {
    double width = 0;
    for (const Level& l : ladderOf(p, c)) width += l.width;
    return {width};
}
template <class TableOf>
std::vector<double> joined(const FogBlur& p, const DeriveContext& c, TableOf tableOf) {
    std::vector<double> numbers;
    for (const Level& l : ladderOf(p, c)) {
        auto table = tableOf(l);
        numbers.insert(numbers.end(), table.begin(), table.end());
    }
    return numbers;
}
std::vector<double> levelTaps(const FogBlur& p, const DeriveContext& c) {
    return joined(p, c, fog_blur::tapsOf);
}
std::vector<double> prefilters(const FogBlur& p, const DeriveContext& c) {
    return joined(p, c, [](const Level& l) { return fog_blur::decimationOf(l).prefilter; });
}
std::vector<double> phases(const FogBlur& p, const DeriveContext& c) {
    return joined(p, c, [](const Level& l) { return blur::enlargingWeights(fog_blur::decimationOf(l)); });
}
std::vector<double> tapCount(const FogBlur& p, const DeriveContext& c) {
    return {double(levelTaps(p, c).size())};
}
std::vector<double> prefilterCount(const FogBlur& p, const DeriveContext& c) {
    return {double(prefilters(p, c).size())};
}
std::vector<double> phaseCount(const FogBlur& p, const DeriveContext& c) {
    return {double(phases(p, c).size()) / blur::enlargingTaps};
}
std::vector<double> nodeWeights(const FogBlur& p, const DeriveContext& c) {
    return fog_blur::ladderWeights(ladderOf(p, c));
}

// --- CPU

// 1. Standard deviation of each pixel's blur.
template <bool areFinite>
BRUME_INLINE void shareRow(float start, const float* transmittance, float* share, int count) {
    const float inverse = 1.0f - start;
    for (int i = 0; i < count; i++) {
        float t[3];
        for (int n = 0; n < 3; n++) {
            float x = t[n] = transmittance[4 * i + n];
            if constexpr (!areFinite) t[n] = isNan(x) ? 0.0f : isInf(x) ? std::copysign(65504.0f, x) : x;
        }
        float opacity = 1.0f - (t[0] + t[1] + t[2]) * (1.0f / 3.0f);
        share[i] = std::min(std::max((opacity - start) / inverse, 0.0f), 1.0f);
    }
}
BRUME_VECTORISE void sigmaRow(const FogBlur& p, float largest, const float* transmittance, bool areFinite,
                              float* sigma, int count) {
    const float falloff = p.falloff;
    if (areFinite)
        shareRow<true>(p.start, transmittance, sigma, count);
    else
        shareRow<false>(p.start, transmittance, sigma, count);
    if (falloff != 1.0f)
        for (int i = 0; i < count; i++) sigma[i] = sigma[i] > 0.0f ? powFast(sigma[i], falloff) : 0.0f;
    for (int i = 0; i < count; i++) sigma[i] *= largest;
}

fog_blur::Ladder ladderOf(const FogBlur& p, const CpuContext& c) {
    fog_blur::Ladder ladder;
    auto levels = c.derived("levels"), tables = c.derived("levelTables");
    auto taps = c.derived("levelTaps"), prefilters = c.derived("prefilters"), phases = c.derived("phases");
    for (size_t l = 0; l + 4 <= levels.size(); l += 4) {
        fog_blur::LadderLevel level;
        level.sigma = levels[l];
        level.factor = int(levels[l + 1]);
        level.taps = taps.subspan(size_t(tables[l]), size_t(levels[l + 3]) + 1);
        level.prefilter =
            prefilters.subspan(size_t(tables[l + 1]), size_t(fog_blur::prefilterReach(level.factor)) + 1);
        level.up = phases.subspan(blur::enlargingTaps * size_t(tables[l + 2]),
                                  blur::enlargingTaps * size_t(level.factor));
        ladder.levels.push_back(level);
    }
    ladder.nodeWeights = c.derived("nodeWeights");
    ladder.largest = c.derived("largestSigma")[0];
    ladder.keepEdges = p.edges == keep;
    return ladder;
}

// Weights of one axis, what lies beyond an edge added to the edge's.
void foldedGaussian(float sigma, int at, int length, std::vector<float>& weights, int& low) {
    const float scale = 0.5f / std::max(sigma * sigma, 1e-4f);
    const int reach = int(std::ceil(4.0f * sigma));
    low = std::max(at - reach, 0);
    int high = std::min(at + reach, length - 1);
    weights.assign(high - low + 1, 0.0f);
    for (int d = -reach; d <= reach; d++)
        weights[std::clamp(at + d, low, high) - low] += expFast(-float(d) * float(d) * scale);
}

void gather(const FogBlur& p, const fog_blur::Source& source, cv::Mat& out) {
    cv::parallel_for_(
        cv::Range(0, out.rows),
        [&](const cv::Range& range) {
            std::vector<float> across, down, row(4 * size_t(out.cols));
            for (int y = range.start; y < range.end; y++)
                for (int x = 0; x < out.cols; x++) {
                    cv::Vec4f self, sum;
                    float sigma = source.sigma.at<float>(y, x), total = 0;
                    fog_blur::sharpen(self.val, source.color.ptr<float>(y) + 4 * x, 1);
                    if (sigma > 0) {
                        int left = 0, top = 0;
                        foldedGaussian(sigma, x, out.cols, across, left);
                        foldedGaussian(sigma, y, out.rows, down, top);
                        for (size_t j = 0; j < down.size(); j++) {
                            const int count = int(across.size());
                            fog_blur::sharpen(row.data(), source.color.ptr<float>(top + int(j)) + 4 * left,
                                              count);
                            const float* sigmas = source.sigma.ptr<float>(top + int(j)) + left;
                            for (int i = 0; i < count && p.edges == keep; i += fog_blur::widestWeighed)
                                fog_blur::weigh(row.data() + 4 * i, row.data() + 4 * i, sigmas + i, sigma,
                                                std::min(fog_blur::widestWeighed, count - i));
                            for (size_t i = 0; i < across.size(); i++) {
                                float w = across[i] * down[j];
                                for (int n = 0; n < 4; n++) sum[n] += w * row[4 * i + n];
                                total += w;
                            }
                        }
                        sum *= 1.0f / total;
                        float weight = p.edges == keep ? std::max(sum[3], 0.05f) : 1.0f;
                        float missing = p.edges == keep ? weight - sum[3] : 0.0f;
                        for (int n = 0; n < 3; n++) self[n] = (sum[n] + missing * self[n]) * (1.0f / weight);
                    }
                    out.at<cv::Vec4f>(y, x) = self;
                }
        },
        4 * cv::getNumThreads());
}

// 5. The fog's own light stays; what it let through of the clear picture is exchanged for the blurred one.
BRUME_VECTORISE void finishRow(bool isSingle, const float* foggy, const float* clear,
                               const float* transmittance, float* out, int count) {
    auto bounded = [](float x) {
        float y = isInf(x) ? std::copysign(65504.0f, x) : x;
        return isNan(x) ? 0.0f : y;
    };
    for (int i = 0; i < count; i++) {
        if (isSingle)
            for (int n = 0; n < 3; n++) {
                float change = out[4 * i + n] - bounded(clear[4 * i + n]);
                out[4 * i + n] = bounded(foggy[4 * i + n]) + bounded(transmittance[4 * i + n]) * change;
            }
        out[4 * i + 3] = foggy[4 * i + 3];
    }
}

void run(const FogBlur& p, const CpuContext& c) {
    cv::Mat out = c.output;
    const cv::Mat &transmittance = c.image("transmittance"), &clear = c.image("clear");
    blur::Scratch sigmas(out.total() + fog_blur::spreadMargin);
    fog_blur::Source source{p.order == single ? clear : c.input, cv::Mat(out.size(), CV_32F, sigmas.data())};
    float largest = c.derived("largestSigma")[0];
    auto sigmaOf = [&](int y, int x, int count, float* sigma) {
        const float* through = transmittance.ptr<float>(y) + 4 * x;
        sigmaRow(p, largest, through, blur::allFinite(through, 4 * count), sigma, count);
    };
    auto finish = [&](int y, int x, int count, float* row) {
        finishRow(p.order == single, c.input.ptr<float>(y) + 4 * x, clear.ptr<float>(y) + 4 * x,
                  transmittance.ptr<float>(y) + 4 * x, row, count);
    };
    if (p.method == ladderMethod) {
        const fog_blur::Ladder ladder = ladderOf(p, c);
        const auto cells = fog_blur::findCells(source, ladder, sigmaOf);
        fog_blur::Room room;
        const auto small = fog_blur::smallLevels(source, ladder.levels, cells, ladder.keepEdges, room);
        return fog_blur::ladderBlur(source, ladder, cells, small, out, c.outputIsStreamed, finish);
    }
    for (int y = 0; y < out.rows; y++) sigmaOf(y, 0, out.cols, source.sigma.ptr<float>(y));
    gather(p, source, out);
    for (int y = 0; y < out.rows; y++) finish(y, 0, out.cols, out.ptr<float>(y));
}

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
        double stated = p.method == ladderMethod ? (p.edges == keep ? .03 : .021) : 1e-3;
        truth[k].methodError = sigma > 0 ? stated * truth[k].scale / (p.edges == keep ? enough : 1) : 0;
        // 4 half ulp of the brightest value, which every level of the ladder may hold a share of and the
        // weighing of levels then takes away again.
        if (sigma > 0) truth[k].allowance = 2.4e-7 * truth[k].scale;
    }
}

Plan plan(const FogBlur& p, const PlanInput& in) {
    Plan plan;
    plan.output = ImageBounds::anywhere(in.input.low, in.input.high);
    if (p.radius == 0) {
        plan.skip = true;
        plan.why = "a radius of 0 changes nothing";
        return plan;
    }
    // Pixels have blurs of every size up to the largest. Gather is exact, but looks at every pixel that its
    // largest blur covers, seconds a frame: it is chosen only where the ladder's error could show. These
    // shares of the bound are estimates: with the ladder everywhere, 1800 random fogs over captured frames
    // came to .34 of it at most where edges are kept (and what is left of the weight divides the error), to
    // .08 where they bleed.
    const double likely = p.edges == keep ? .4 : .1;
    const double largest = largestOf(p, in.scene), across = 8 * largest + 1;
    double unseen = HUGE_VAL;
    for (double deviation : {largest, .5 * largest, .25 * largest, std::min(largest, 1.)})
        unseen = std::min(
            unseen, blur::likelihood * blur::Unseen(in, {deviation, 5, blur::gaussianDensity}).error(4));
    const double ladderError = likely * (p.edges == keep ? .03 : .021),
                 ladderCost = 8 + 1.4 * std::log2(std::max(1.f, p.radius)),
                 gatherCost = 4 + .25 * across * across;
    const bool isLadder = in.chooses("method") ? ladderError <= unseen : p.method == ladderMethod;
    plan.chosen["method"] = isLadder ? ladderMethod : gatherMethod;
    plan.predictedError =
        (isLadder ? ladderError : blur::likelihood * 1e-3) / std::max(unseen, 1e-30) * in.tolerance;
    plan.predictedCost = isLadder ? ladderCost : gatherCost;
    plan.why = !in.chooses("method") ? isLadder ? "ladder, as asked" : "gather, as asked"
               : isLadder
                   ? "ladder: by an estimate (no bound), its error does not show among this frame's lights"
                   : "gather: the ladder, much faster, might show beside this frame's brightest lights";
    return plan;
}

}  // namespace

BRUME_PLUGIN(EffectOf<FogBlur>()
                 .bind("radius", &FogBlur::radius)
                 .bind("start", &FogBlur::start)
                 .bind("falloff", &FogBlur::falloff)
                 .bind("order", &FogBlur::order)
                 .bind("edges", &FogBlur::edges)
                 .bind("method", &FogBlur::method)
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
