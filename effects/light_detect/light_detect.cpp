// light_detect: what is bright enough to be a light (MODELS.md §7, Spirit Fog).
//
//   light = C'·(knee(B)·exp(-β·L))^curve·intensity   C' the colour at its saturation, L the distance along
//   the ray, m B     = .299 R + .587 G + .114 B of sRGB-encoded values, or Rec. 709 luminance of linear ones
//   knee  = B > t, or s²/(4k), at least B - t, over B, with s = clamp(B - t + k, 0, 2k), for a knee k > 0
//   none where planar depth is outside near..far (far 0: no limit, and the sky counts)
//
// At a reduced resolution each pixel is the mean of the lights in its area: detecting on one sample of it
// would miss small lights and flicker. Limits: β = 0 leaves even the sky's lights; B = inf counts as 65504,
// NaN as dark. Alpha is averaged.
#include <algorithm>
#include <bit>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "effect/kit/math.hpp"
#include "effect/plugin.hpp"

namespace {

using namespace brume;

enum Luminance { encoded601, linear709 };

struct LightDetect {
    int luminance, reduction;
    float threshold, knee, near, far, attenuation, limit, intensity, saturation, curve;
};

std::vector<double> rays(const LightDetect&, const DeriveContext& c) {
    return {.5 - c.camera.cx, .5 - c.camera.cy, 1 / c.camera.fx, 1 / c.camera.fy};
}
// Where the knee begins, and 1/(4k).
std::vector<double> hardFrom(const LightDetect& p, const DeriveContext&) {
    return {double(p.threshold) - p.knee, p.knee > 0 ? .25 / p.knee : 0};
}

// --- CPU

constexpr int tile = 128;  // px: short enough that most tiles of a night hold no light

struct Planes {
    float color[3][tile], luminance[tile], weight[tile];
};

BRUME_INLINE float finite(float x) {
    float bounded = isInf(x) ? std::copysign(65504.0f, x) : x;
    return isNan(x) ? 0.0f : bounded;
}

typedef int FourPixels __attribute__((vector_size(64), aligned(4), may_alias));

// No luminance exceeds its brightest channel, so dark stretches need no sRGB curve. Floats above 0 compare as
// whole numbers do, and NaN and inf are the largest of them.
BRUME_INLINE bool anyReaches(const float* in, int count, float value) {
    FourPixels largest = {};
    int i = 0;
    for (; i + 4 <= count; i += 4) {
        FourPixels x = *reinterpret_cast<const FourPixels*>(in + 4 * i);
        largest = x > largest ? x : largest;
    }
    int most = 0;
    for (int k = 0; k < 16; k++) most = k % 4 < 3 ? std::max(most, largest[k]) : most;
    for (; i < count; i++)
        for (int n = 0; n < 3; n++) most = std::max(most, std::bit_cast<int>(in[4 * i + n]));
    return most >= std::bit_cast<int>(std::max(value, 0.0f));
}

// 1. Colour planes and luminance.
BRUME_INLINE void measure(const LightDetect& p, const float* in, int count, Planes& t) {
    for (int i = 0; i < count; i++) {
        t.color[0][i] = finite(in[4 * i]);
        t.color[1][i] = finite(in[4 * i + 1]);
        t.color[2][i] = finite(in[4 * i + 2]);
    }
    const float *r = t.color[0], *g = t.color[1], *b = t.color[2];
    if (p.luminance == encoded601)
        for (int i = 0; i < count; i++)
            t.luminance[i] =
                encodeSrgb(r[i]) * 0.299f + encodeSrgb(g[i]) * 0.587f + encodeSrgb(b[i]) * 0.114f;
    else
        for (int i = 0; i < count; i++) t.luminance[i] = r[i] * 0.2126f + g[i] * 0.7152f + b[i] * 0.0722f;
}

// 2, 3. Knee, depth range, attenuation, curve.
BRUME_INLINE void weigh(const LightDetect& p, const float* from, const float* rays, const float* depth, int x,
                        int y, int count, Planes& t) {
    const float threshold = p.threshold, knee = p.knee, start = from[0], scale = from[1], near = p.near;
    const float far = p.far > 0 ? p.far : HUGE_VALF, attenuation = p.attenuation, curve = p.curve;
    const float rayY = (float(y) + rays[1]) * rays[3], originX = rays[0], inverseFx = rays[2];
    if (knee == 0.0f) {
        for (int i = 0; i < count; i++) t.weight[i] = t.luminance[i] > threshold ? 1.0f : 0.0f;
    } else {
        for (int i = 0; i < count; i++) {
            float b = t.luminance[i], s = std::min(std::max(b - start, 0.0f), 2.0f * knee);
            t.weight[i] = std::max(s * s * scale, b - threshold) / std::max(b, 1e-6f);
        }
    }
    for (int i = 0; i < count; i++) t.weight[i] = depth[i] < near || depth[i] > far ? 0.0f : t.weight[i];
    if (attenuation > 0.0f) {
        for (int i = 0; i < count; i++) {
            float rayX = (float(x + i) + originX) * inverseFx;
            float distance = std::min(depth[i] * View::rayLength(rayX, rayY), 1e30f);
            t.weight[i] *= expFast(-std::min(attenuation * distance, 87.0f));
        }
    }
    if (curve != 1.0f)
        for (int i = 0; i < count; i++) t.weight[i] = powFast(t.weight[i], curve);
}

// The lights of `count` pixels of a row, added to `sum`, interleaved.
BRUME_VECTORISE void addLights(const LightDetect& p, const float* from, const float* rays, const float* in,
                               const float* depth, int x, int y, int count, float darkest, float* sum) {
    for (int i = 0; i < count; i++) sum[4 * i + 3] += finite(in[4 * i + 3]);
    if (!anyReaches(in, count, darkest)) return;
    Planes t;
    measure(p, in, count, t);
    weigh(p, from, rays, depth, x, y, count, t);
    const float saturation = p.saturation, intensity = p.intensity, limit = p.limit > 0 ? p.limit : HUGE_VALF;
    for (int i = 0; i < count; i++) {
        float r = t.color[0][i], g = t.color[1][i], b = t.color[2][i];
        float grey = r * 0.2126f + g * 0.7152f + b * 0.0722f, strength = t.weight[i] * intensity;
        r = std::max(grey + saturation * (r - grey), 0.0f);
        g = std::max(grey + saturation * (g - grey), 0.0f);
        b = std::max(grey + saturation * (b - grey), 0.0f);
        float brightest = std::max(std::max(r, g), b);
        strength *= brightest > limit ? limit / brightest : 1.0f;
        sum[4 * i + 0] += r * strength;
        sum[4 * i + 1] += g * strength;
        sum[4 * i + 2] += b * strength;
    }
}

// 4. The mean over the pixels that one pixel of the output stands for: columns are summed first, then cells.
void run(const LightDetect& p, const CpuContext& c) {
    const int width = c.input.cols, height = c.input.rows;
    cv::Mat out = c.output;
    const float begin = c.derived("hardFrom")[0];  // of the knee
    const float darkest = (p.luminance == encoded601 ? decodeSrgb(begin) : begin) * 0.999f;
    cv::parallel_for_(
        cv::Range(0, out.rows),
        [&](const cv::Range& range) {
            std::vector<float> columns(4 * size_t(width));
            for (int j = range.start; j < range.end; j++) {
                int y0 = int(int64_t(j) * height / out.rows), y1 = int(int64_t(j + 1) * height / out.rows);
                std::fill(columns.begin(), columns.end(), 0.0f);
                for (int y = y0; y < y1; y++)
                    for (int x = 0; x < width; x += tile)
                        addLights(p, c.derived("hardFrom").data(), c.derived("rays").data(),
                                  c.input.ptr<float>(y) + 4 * x, c.depth.ptr<float>(y) + x, x, y,
                                  std::min(tile, width - x), darkest, &columns[4 * x]);
                float* row = out.ptr<float>(j);
                for (int i = 0; i < out.cols; i++) {
                    int x0 = int(int64_t(i) * width / out.cols), x1 = int(int64_t(i + 1) * width / out.cols);
                    float sum[4] = {};
                    for (int x = x0; x < x1; x++)
                        for (int n = 0; n < 4; n++) sum[n] += columns[4 * x + n];
                    for (int n = 0; n < 4; n++) row[4 * i + n] = sum[n] / float((x1 - x0) * (y1 - y0));
                }
            }
        },
        4 * cv::getNumThreads());
}

// --- reference, fp64

double encoded(double x) {
    double a = std::abs(x);
    return std::copysign(a <= .0031308 ? 12.92 * a : 1.055 * std::pow(a, 1 / 2.4) - .055, x);
}

double trueWeight(const LightDetect& p, double brightness, double planar, double distance) {
    double t = p.threshold, k = p.knee, weight = brightness > t;
    if (k > 0) {
        double s = std::clamp(brightness - t + k, 0., 2 * k);
        weight = std::max(s * s / (4 * k), brightness - t) / std::max(brightness, 1e-6);
    }
    if (planar < p.near || (p.far > 0 && planar > p.far)) return 0;
    if (p.attenuation > 0) weight *= std::exp(-std::min(double(p.attenuation) * distance, 87.));
    return weight > 0 ? std::pow(weight, double(p.curve)) : 0;
}

ReferencePixel reference(const LightDetect& p, const ReferenceContext& c, cv::Point at) {
    cv::Size out(std::max(1, int(c.input.cols / double(p.reduction) + .5)),
                 std::max(1, int(c.input.rows / double(p.reduction) + .5)));
    ReferencePixel pixel;
    int count = 0;
    auto near = [](double a, double b) { return b > 0 && std::abs(a - b) <= 4 * 1.2e-7 * std::abs(b); };
    for (int y = at.y * c.input.rows / out.height; y < (at.y + 1) * c.input.rows / out.height; y++)
        for (int x = at.x * c.input.cols / out.width; x < (at.x + 1) * c.input.cols / out.width; x++) {
            double color[4];
            for (int n = 0; n < 4; n++) {
                float v = c.input.at<cv::Vec4f>(y, x)[n];
                color[n] = std::isnan(v) ? 0 : std::isinf(v) ? std::copysign(65504., double(v)) : v;
                pixel.scale = std::max(pixel.scale, std::abs(color[n]) * (n < 3 ? double(p.intensity) : 1));
            }
            double grey = .2126 * color[0] + .7152 * color[1] + .0722 * color[2];
            double b = p.luminance == linear709
                           ? grey
                           : .299 * encoded(color[0]) + .587 * encoded(color[1]) + .114 * encoded(color[2]);
            double planar = c.depth.at<float>(y, x);
            double distance = std::min(planar * cv::norm(c.camera.ray(x, y)), 1e30);
            double brightest = std::max({std::abs(color[0]), std::abs(color[1]), std::abs(color[2]), 1.});
            double doubt = 2e-6 * brightest;
            if (p.knee == 0 && std::abs(b - p.threshold) <= doubt) pixel.ambiguous = true;
            if (near(planar, p.near) || near(planar, p.far)) pixel.ambiguous = true;
            double weight = trueWeight(p, b, planar, distance), difference = 0;
            // Conditioning: luminance and optical depth are rounded before the knee, the exponential and the
            // curve.
            for (double sign : {-1., 1.})
                difference = std::max(
                    {difference, std::abs(trueWeight(p, b + sign * .5 * doubt, planar, distance) - weight),
                     std::abs(trueWeight(p, b, planar, distance * (1 + sign * 5e-7)) - weight)});
            if (p.knee == 0) difference = std::min(difference, weight * 1e-4);
            double lights[3], most = 0;
            for (int n = 0; n < 3; n++) {
                lights[n] = std::max(0., grey + p.saturation * (color[n] - grey));
                most = std::max(most, lights[n]);
            }
            for (int n = 0; n < 3; n++) {
                double light = lights[n] * p.intensity * (p.limit > 0 && most > p.limit ? p.limit / most : 1);
                pixel.color[n] += light * weight;
                pixel.allowance = std::max(pixel.allowance, light * difference);
                pixel.scale = std::max(pixel.scale, light);
            }
            pixel.color[3] += color[3];
            count++;
        }
    for (int n = 0; n < 4; n++) pixel.color[n] /= count;
    return pixel;
}

Plan plan(const LightDetect& p, const PlanInput& in) {
    Plan plan;
    double brightest = std::isfinite(in.maxInput) ? in.maxInput : 65504.;
    plan.maxOutput = brightest * std::max(1.f, p.saturation);
    if (p.limit > 0) plan.maxOutput = std::min(plan.maxOutput, double(p.limit));
    plan.maxOutput *= p.intensity;
    plan.predictedCost = p.reduction == 1 ? 2 : 1.2;
    plan.why = "detects at every pixel; reduced resolutions average what was detected";
    return plan;
}

}  // namespace

BRUME_PLUGIN(EffectOf<LightDetect>()
                 .bind("luminance", &LightDetect::luminance)
                 .bind("threshold", &LightDetect::threshold)
                 .bind("knee", &LightDetect::knee)
                 .bind("near", &LightDetect::near)
                 .bind("far", &LightDetect::far)
                 .bind("attenuation", &LightDetect::attenuation)
                 .bind("limit", &LightDetect::limit)
                 .bind("intensity", &LightDetect::intensity)
                 .bind("saturation", &LightDetect::saturation)
                 .bind("curve", &LightDetect::curve)
                 .bind("reduction", &LightDetect::reduction)
                 .derive("rays", rays)
                 .derive("hardFrom", hardFrom)
                 .run(run)
                 .reference(reference)
                 .plan(plan))
