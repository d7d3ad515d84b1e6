// blend: two images combined channel by channel; alpha is the first image's.
//
//   mix       a + s·(b - a)                     s = strength, at most 1 but for add
//   add       a + s·b
//   screen    a + s·(a ⊕ b - a), a ⊕ b = 1 - (1 - a)(1 - b), and max(a, b) where either exceeds 1
//   multiply  a + s·(a·b - a)
//
// Limits: s = 0 gives a to the bit, whatever b is; mix with s = 1 gives b to the bit.
#include <algorithm>
#include <cmath>

#include "common/stream.hpp"
#include "effect/kit/math.hpp"
#include "effect/plugin.hpp"

namespace {

using namespace brume;

enum Mode { mixMode, addMode, screenMode, multiplyMode };

struct Blend {
    int mode;
    float strength;
};

// Two pixels, one. As vectors: GCC would scatter three of every four floats by itself, and takes longer ones
// through memory where registers are not as long.
struct Two {
    typedef float Vector __attribute__((vector_size(32), aligned(4), may_alias));
    typedef int Mask __attribute__((vector_size(32)));
    static constexpr Mask isAlpha = {0, 0, 0, -1, 0, 0, 0, -1};
};
struct One {
    typedef float Vector __attribute__((vector_size(16), aligned(4), may_alias));
    typedef int Mask __attribute__((vector_size(16)));
    static constexpr Mask isAlpha = {0, 0, 0, -1};
};

template <int mode, class Pixels>
BRUME_INLINE void blendSome(const float* in, const float* beside, float* out, float share, float strength) {
    typedef typename Pixels::Vector Vector;
    const Vector a = *(const Vector*)in, b = *(const Vector*)beside;
    const float keep = 1.0f - share;
    Vector result = a;
    if constexpr (mode == mixMode) result = keep > 0.0f ? a * keep + b * share : b;
    if constexpr (mode == addMode) result = a + b * strength;
    if constexpr (mode == screenMode) {
        const Vector larger = a < b ? b : a,
                     screened = larger > 1.0f ? larger : 1.0f - (1.0f - a) * (1.0f - b);
        result = keep > 0.0f ? a * keep + screened * share : screened;
    }
    if constexpr (mode == multiplyMode) result = keep > 0.0f ? a * keep + a * b * share : a * b;
    *(Vector*)out = Pixels::isAlpha ? a : result;
}
template <int mode>
BRUME_INLINE void blendRow(const float* in, const float* beside, float* out, int width, float strength) {
    const float share = std::min(strength, 1.0f);
    int i = 0;
    for (; i + 2 <= width; i += 2)
        blendSome<mode, Two>(in + 4 * i, beside + 4 * i, out + 4 * i, share, strength);
    for (; i < width; i++) blendSome<mode, One>(in + 4 * i, beside + 4 * i, out + 4 * i, share, strength);
}

BRUME_VECTORISE void rows(const Blend& p, const CpuContext& c, cv::Range range) {
    const cv::Mat& second = c.image("second");
    const int width = c.view.width;
    constexpr int step = 64;
    float finished[4 * step];
    for (int j = range.start; j < range.end; j++)
        for (int x = 0; x < width; x += step) {
            const int count = std::min(step, width - x);
            const float *in = c.input.ptr<float>(j) + 4 * x, *beside = second.ptr<float>(j) + 4 * x;
            float* const to = const_cast<float*>(c.output.ptr<float>(j)) + 4 * x;
            float* const out = c.outputIsStreamed ? finished : to;
            const float* ahead = c.upcoming.empty() ? in + 8 * 4 * step : c.upcoming.ptr<float>(j) + 4 * x;
            for (int i = 0; i < count; i += 4) __builtin_prefetch(ahead + 4 * i);
            if (p.strength <= 0.0f)
                std::copy(in, in + 4 * count, out);
            else if (p.mode == mixMode)
                blendRow<mixMode>(in, beside, out, count, p.strength);
            else if (p.mode == addMode)
                blendRow<addMode>(in, beside, out, count, p.strength);
            else if (p.mode == screenMode)
                blendRow<screenMode>(in, beside, out, count, p.strength);
            else
                blendRow<multiplyMode>(in, beside, out, count, p.strength);
            if (c.outputIsStreamed) putRow(to, out, 4 * count, true);
        }
    if (c.outputIsStreamed) streamEnd();
}

ReferencePixel reference(const Blend& p, const ReferenceContext& c, cv::Point at) {
    cv::Vec4f a = c.input.at<cv::Vec4f>(at), b = c.image("second").at<cv::Vec4f>(at);
    double strength = p.strength, share = std::min(strength, 1.);
    ReferencePixel pixel;
    for (int n = 0; n < 3; n++) {
        double x = a[n], y = b[n], blended = 0;
        switch (p.mode) {
            case mixMode:
                blended = y;
                break;
            case addMode:
                blended = x + y;
                break;
            case screenMode:
                blended = x > 1 || y > 1 ? std::max(x, y) : 1 - (1 - x) * (1 - y);
                break;
            case multiplyMode:
                blended = x * y;
                break;
        }
        double s = p.mode == addMode ? strength : share;
        pixel.color[n] = s == 0 ? x : (s == 1 ? blended : (1 - s) * x + s * blended);
        if (p.mode == addMode) pixel.color[n] = s == 0 ? x : x + s * y;
        for (double term : {x, s * y, x * y})
            if (std::isfinite(term)) pixel.scale = std::max(pixel.scale, std::abs(term));
    }
    pixel.color[3] = a[3];
    return pixel;
}

Plan plan(const Blend& p, const PlanInput& in) {
    Plan plan;
    const ImageBounds& second = in.images.at("second");
    const double share = p.mode == addMode ? p.strength : std::min(1.f, p.strength);
    const double other = std::max(std::abs(second.low), std::abs(second.high));
    const double low = std::min({in.input.low, second.low, 0.}),
                 high = std::max({in.input.high, second.high, 0.});
    plan.predictedCost = 1.6;
    plan.why = "as written, nothing cheaper";
    plan.output = ImageBounds::anywhere(low, high);  // mix, screen
    if (share > 0 && p.mode == addMode)
        plan.output = ImageBounds::anywhere(in.input.low + share * std::min(0., second.low),
                                            in.input.high + share * std::max(0., second.high)),
        plan.gain = std::max(1., share);
    if (share > 0 && p.mode == multiplyMode) {
        const double most = std::max(1., other) * in.maxInput;
        plan.output = ImageBounds::anywhere(low < 0 ? -most : 0, most);
        plan.gain = std::max({1., other, in.maxInput});
    }
    if (share == 0) {
        plan.output = in.input;
        plan.skip = true;
        plan.why = "a strength of 0 changes nothing";
    }
    return plan;
}

}  // namespace

BRUME_PLUGIN(EffectOf<Blend>()
                 .bind("mode", &Blend::mode)
                 .bind("strength", &Blend::strength)
                 .rows(rows)
                 .reference(reference)
                 .plan(plan))
