// light_detect: what is bright enough to be a light (MODELS.md §7, Spirit Fog).
//
//   light = C'·(knee(B)·exp(-β·L))^curve·intensity
//   C' the colour at its saturation, L the distance along the ray, m,
//   B = .299 R + .587 G + .114 B of sRGB-encoded values, or Rec. 709 luminance of linear ones,
//   knee = B > t, or s²/(4k), at least B - t, over B, with s = clamp(B - t + k, 0, 2k), for a knee k > 0
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

#include "common/stream.hpp"
#include "effect/kit/math.hpp"
#include "effect/plugin.hpp"
#include "light_detect/encoding.hpp"

namespace {

using namespace brume;
using namespace light_detect;

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

constexpr int tile = 64;  // px: short enough that most tiles of a night hold no light

// Colour by channels, and how much of a light each pixel is.
struct Planes {
    float color[4][tile], weight[tile];
};

BRUME_INLINE float finite(float x) {
    float bounded = isInf(x) ? std::copysign(65504.0f, x) : x;
    return isNan(x) ? 0.0f : bounded;
}

// sRGB's curve of any finite value, relative error 4e-7: x = 2^n·(1 + m), x^(5/12) = 2^(5n/12)·(1 +
// m)^(5/12), each factor by a polynomial (Chebyshev's interpolation, relative errors 4e-8 and 1e-7).
BRUME_INLINE float encodeFinite(float x) {
    const float a = std::fabs(x);
    const int bits = std::bit_cast<int>(std::max(a, 0.0031308f)), n = (bits - 0x3f3504f3) >> 23;
    const float m = std::bit_cast<float>(bits - (n << 23)) - 1.0f, m2 = m * m;  // 1 + m from √½ to √2
    float even = ((-0.0251135755f * m2 - 0.0413092318f) * m2 - 0.121529462f) * m2 + 1.0f;
    float odd = ((0.0144069376f * m2 + 0.0305185875f) * m2 + 0.0640976851f) * m2 + 0.416667172f;
    float exponent = float(n) * (5.0f / 12.0f), whole = roundFast(exponent), r = exponent - whole, r2 = r * r;
    float evenPower = (0.00967603192f * r2 + 0.240221075f) * r2 + 1.00000008f;
    float oddPower = (0.00133908634f * r2 + 0.0555035711f) * r2 + 0.693147188f;
    float power = (even + m * odd) * (evenPower + r * oddPower) * powerOfTwo(int(whole));
    return std::copysign(a <= 0.0031308f ? 12.92f * a : 1.055f * power - 0.055f, x);
}

// The numbers of one call.
struct Detection {
    const LightDetect* p;
    const float *hardFrom, *rays;
    const Encoding* encoding;
    /// Of linear values: pixels whose channels are all below it are no lights. Luminance is a mean of
    /// channels, and sRGB's curve rises.
    float darkest;
};

// 1. The largest of colour, and whether all is finite and not below 0: floats compare as whole numbers do,
// and those below 0 are large ones without a sign. And alpha, if it is the same everywhere.
struct Largest {
    float color, alpha;
    bool isPlain, hasOneAlpha;
};
template <class L>
BRUME_INLINE Largest largestOf(const float* in) {
    typedef typename L::Bits Bits;
    typedef typename L::Unsigned Unsigned;
    Bits color = {};
    const Bits first = *reinterpret_cast<const Bits*>(in);
    Unsigned all = {};
    Bits differs = {};
    for (int i = 0; i < 4 * tile; i += L::count) {
        const Bits bits = *reinterpret_cast<const Bits*>(in + i);
        color = bits > color ? bits : color;
        all = (Unsigned)bits > all ? (Unsigned)bits : all;
        differs |= bits ^ first;
    }
    int most = 0, alphaDiffers = 0;
    unsigned mostOfAll = 0;
    for (int k = 0; k < L::count; k++) {
        most = std::max(most, k % 4 < 3 ? color[k] : 0);
        mostOfAll = std::max(mostOfAll, all[k]);
        alphaDiffers |= k % 4 < 3 ? 0 : differs[k] | (first[k] ^ first[3]);
    }
    return {std::bit_cast<float>(most), in[3], mostOfAll < 0x7f800000u, alphaDiffers == 0};
}

// Whether anything of a tile is within the range, and not beyond where the air lets nothing through: the way
// along the ray is at least the depth.
BRUME_INLINE bool mayArrive(const LightDetect& p, const float* depth) {
    const float near = p.near, far = p.far > 0 ? p.far : HUGE_VALF, attenuation = p.attenuation;
    int arrives = 0;
    for (int i = 0; i < tile; i++) {
        const float dimmed = attenuation * std::min(depth[i], 1e30f);
        arrives |= !(depth[i] < near) & !(depth[i] > far) & !(dimmed >= 87.0f);
    }
    return arrives;
}

// 3. What arrives over the distance.
BRUME_INLINE void arrive(const LightDetect& p, const float* rays, const float* depth, int x, int y,
                         float* weight) {
    const float near = p.near, far = p.far > 0 ? p.far : HUGE_VALF, attenuation = p.attenuation;
    const float rayY = (float(y) + rays[1]) * rays[3], originX = rays[0], inverseFx = rays[2];
    if (attenuation > 0.0f)
        for (int i = 0; i < tile; i++) {
            const float rayX = (float(x + i) + originX) * inverseFx;
            const float distance = std::min(depth[i] * View::rayLength(rayX, rayY), 1e30f),
                        through = extinctionOf(attenuation * distance).transmittance;
            weight[i] = depth[i] < near || depth[i] > far ? 0.0f : through;
        }
    else
        for (int i = 0; i < tile; i++) weight[i] = depth[i] < near || depth[i] > far ? 0.0f : 1.0f;
}

// 2. Luminance, its knee, and the curve.
template <class L>
BRUME_INLINE void measure(const Detection& d, bool isPlain, const Planes& t, float* luminance) {
    const float *r = t.color[0], *g = t.color[1], *b = t.color[2];
    if (d.p->luminance == linear709)
        for (int i = 0; i < tile; i++) luminance[i] = r[i] * 0.2126f + g[i] * 0.7152f + b[i] * 0.0722f;
    else if (isPlain) {
        const Encoding encoding = *d.encoding;
        typedef typename L::Vector Vector;
        for (int i = 0; i < tile; i += L::count) {
            auto at = [&](const float* plane) __attribute__((always_inline)) {
                return encoding.of<L>(*reinterpret_cast<const Vector*>(plane + i));
            };
            *reinterpret_cast<Vector*>(luminance + i) = at(r) * 0.299f + at(g) * 0.587f + at(b) * 0.114f;
        }
    } else
        for (int i = 0; i < tile; i++)
            luminance[i] =
                encodeFinite(r[i]) * 0.299f + encodeFinite(g[i]) * 0.587f + encodeFinite(b[i]) * 0.114f;
}
BRUME_INLINE void weigh(const LightDetect& p, const float* from, const float* luminance, float* weight) {
    const float threshold = p.threshold, knee = p.knee, start = from[0], scale = from[1], curve = p.curve;
    if (knee == 0.0f)
        for (int i = 0; i < tile; i++) weight[i] = luminance[i] > threshold ? weight[i] : 0.0f;
    else
        for (int i = 0; i < tile; i++) {
            const float b = luminance[i], s = std::min(std::max(b - start, 0.0f), 2.0f * knee);
            weight[i] *= std::max(s * s * scale, b - threshold) / std::max(b, 1e-6f);
        }
    if (curve != 1.0f)
        for (int i = 0; i < tile; i++) weight[i] = powFast(weight[i], curve);
}

// The lights of a tile, added to `sums`, one a channel.
template <class Wide>
BRUME_INLINE void addLightsBy(const Detection& d, const float* in, const float* depth, int x, int y,
                              float* const* sums) {
    typedef Lanes<Wide> L;
    const LightDetect& p = *d.p;
    float *red = sums[0], *green = sums[1], *blue = sums[2], *alpha = sums[3];
    const Largest largest = largestOf<L>(in);
    float bounded[4 * tile];
    if (!largest.isPlain) {
        for (int i = 0; i < 4 * tile; i++) bounded[i] = finite(in[i]);
        in = bounded;
    }
    if (largest.isPlain && largest.hasOneAlpha)
        for (int i = 0; i < tile; i++) alpha[i] += largest.alpha;
    else
        for (int i = 0; i < tile; i++) alpha[i] += in[4 * i + 3];
    if (largest.color < d.darkest || !mayArrive(p, depth)) return;
    Planes t;
    for (int i = 0; i < tile; i++)
        for (int n = 0; n < 4; n++) t.color[n][i] = in[4 * i + n];
    float luminance[tile];
    arrive(p, d.rays, depth, x, y, t.weight);
    measure<L>(d, largest.isPlain && largest.color < 128.0f, t, luminance);
    weigh(p, d.hardFrom, luminance, t.weight);
    const float saturation = p.saturation, intensity = p.intensity, limit = p.limit > 0 ? p.limit : HUGE_VALF;
    for (int i = 0; i < tile; i++) {
        float r = t.color[0][i], g = t.color[1][i], b = t.color[2][i];
        float grey = r * 0.2126f + g * 0.7152f + b * 0.0722f, strength = t.weight[i] * intensity;
        r = std::max(grey + saturation * (r - grey), 0.0f);
        g = std::max(grey + saturation * (g - grey), 0.0f);
        b = std::max(grey + saturation * (b - grey), 0.0f);
        float most = std::max(std::max(r, g), b);
        strength *= most > limit ? limit / most : 1.0f;
        red[i] += r * strength;
        green[i] += g * strength;
        blue[i] += b * strength;
    }
}
BRUME_WIDE(void, addLights,
           (const Detection& d, const float* in, const float* depth, int x, int y, float* const* sums),
           (d, in, depth, x, y, sums))

// 4. The mean over the pixels that one pixel of the output stands for, of sums over its rows: pixel i stands
// for columns begins[i] to begins[i + 1]. `lights` has room for the sums, `stride` of them a channel, as
// pixels.
template <class Wide>
BRUME_INLINE void averageBy(float* out, int outWidth, const int* begins, const float* sums, int stride,
                            float* lights, int rows) {
    typedef float Pixel __attribute__((vector_size(16), aligned(4), may_alias));
    for (int i = 0; i < stride; i += Lanes<Wide>::count)
        Lanes<Wide>::toPixels(lights + 4 * i, sums + i, stride);
    for (int i = 0; i < outWidth; i++) {
        Pixel sum = {};
        for (int x = begins[i]; x < begins[i + 1]; x++)
            sum += *reinterpret_cast<const Pixel*>(lights + 4 * x);
        *reinterpret_cast<Pixel*>(out + 4 * i) = sum * (1.0f / float((begins[i + 1] - begins[i]) * rows));
    }
}
BRUME_WIDE(void, average,
           (float* out, int outWidth, const int* begins, const float* sums, int stride, float* lights,
            int rows),
           (out, outWidth, begins, sums, stride, lights, rows))

void run(const LightDetect& p, const CpuContext& c) {
    const int width = c.input.cols, height = c.input.rows;
    cv::Mat out = c.output;
    const float begin = c.derived("hardFrom")[0];  // of the knee
    const Encoding encoding;
    const Detection detection{
        &p, c.derived("hardFrom").data(), c.derived("rays").data(), &encoding,
        std::max((p.luminance == encoded601 ? decodeSrgb(begin) : begin) * 0.999f, 0.0f)};
    std::vector<int> begins(out.cols + 1);
    for (int i = 0; i <= out.cols; i++) begins[i] = int(int64_t(i) * width / out.cols);
    const int stride = (width + tile - 1) / tile * tile;
    const bool streams = c.outputIsStreamed && canStreamPlanes() && out.size() == c.input.size();
    auto detect = [&](const cv::Range& range) {
        std::vector<float> columns(4 * size_t(stride)), lights(columns.size());
        float tileIn[4 * tile] = {}, tileDepth[tile] = {};  // the last of a row, with nothing beyond
        for (int j = range.start; j < range.end; j++) {
            const int y0 = int(int64_t(j) * height / out.rows), y1 = int(int64_t(j + 1) * height / out.rows);
            std::fill(columns.begin(), columns.end(), 0.0f);
            float* sums[4];
            for (int y = y0; y < y1; y++) {
                const float *rowIn = c.input.ptr<float>(y), *rowDepth = c.depth.ptr<float>(y);
                for (int x = 0; x < width; x += tile) {
                    const float *in = rowIn + 4 * x, *depth = rowDepth + x;
                    const int count = std::min(tile, width - x);
                    for (int n = 0; n < 4; n++) sums[n] = columns.data() + size_t(n) * stride + x;
                    for (int i = 0; i < count; i += 4) __builtin_prefetch(in + 4 * (i + 8 * tile));
                    for (int i = 0; i < count; i += 16) __builtin_prefetch(depth + i + 8 * tile);
                    if (count < tile) {
                        std::copy(in, in + 4 * count, tileIn);
                        std::copy(depth, depth + count, tileDepth);
                        in = tileIn, depth = tileDepth;
                    }
                    addLights(detection, in, depth, x, y, sums);
                }
            }
            float* const to = out.ptr<float>(j);
            if (streams)
                streamPlanes(to, columns.data(), stride, width);
            else
                average(to, out.cols, begins.data(), columns.data(), stride, lights.data(), y1 - y0);
        }
        if (streams) streamEnd();
    };
    cv::parallel_for_(cv::Range(0, out.rows), detect, 16 * cv::getNumThreads());
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

// Lights are bounded tile by tile, so that a blur of them need not fear one everywhere.
// The last pixel of a smaller image is the mean of several: how bright it is at most, from the two tiles that
// these may lie in.
void widenRing(ImageBounds& bounds) {
    const cv::Mat highest = bounds.highest.clone(), mean = bounds.greatestMean.clone();
    const int rows = highest.rows, columns = highest.cols;
    auto widen = [&](int j, int i) {
        const bool isAbove = j == 0, isBelow = j == rows - 1, isLeft = i == 0, isRight = i == columns - 1;
        float most = 0, sum = 0;
        for (int y = j + isAbove - 2 * isBelow; y <= j + 2 * isAbove - isBelow; y++)
            for (int x = i + isLeft - 2 * isRight; x <= i + 2 * isLeft - isRight; x++) {
                const cv::Point place(std::clamp(x, 1, columns - 2), std::clamp(y, 1, rows - 2));
                most = std::max(most, highest.at<cv::Vec3f>(place)[0]);
                sum += mean.at<cv::Vec3f>(place)[0];
            }
        for (bool isBeyond : {isAbove || isBelow, isLeft || isRight})
            if (isBeyond) sum *= ImageBounds::tile;
        bounds.highest.at<cv::Vec3f>(j, i) = cv::Vec3f::all(most);
        bounds.greatestMean.at<cv::Vec3f>(j, i) = cv::Vec3f::all(std::min(most, sum));
    };
    for (int j = 0; j < rows; j++)
        for (int i : {0, columns - 1}) widen(j, i);
    for (int i = 0; i < columns; i++)
        for (int j : {0, rows - 1}) widen(j, i);
}

Plan plan(const LightDetect& p, const PlanInput& in) {
    Plan plan;
    const double colorful = std::max(1., double(p.saturation)), begin = p.threshold - p.knee;
    auto brightest = [&](double light) {  // of pixels whose largest channel is at most `light`
        const double luminance = p.luminance == encoded601 ? encoded(light) : light;
        if (!(light > 0) || luminance < begin) return 0.;
        const double most = light * colorful;
        return (p.limit > 0 ? std::min(most, double(p.limit)) : most) * p.intensity;
    };
    plan.output = ImageBounds::anywhere(0, brightest(in.input.high));
    if (!in.input.lowest.empty()) {
        const cv::Size tiles = in.input.lowest.size();
        plan.output.lowest = plan.output.leastMean = cv::Mat::zeros(tiles, CV_32FC3);
        plan.output.highest.create(tiles, CV_32FC3);
        plan.output.greatestMean.create(tiles, CV_32FC3);
        for (int j = 0; j < tiles.height; j++)
            for (int i = 0; i < tiles.width; i++) {
                const auto& highest = in.input.highest.at<cv::Vec3f>(j, i);
                const auto& mean = in.input.greatestMean.at<cv::Vec3f>(j, i);
                const double most = brightest(std::max({highest[0], highest[1], highest[2]}));
                const double sum = double(mean[0]) + mean[1] + mean[2];
                plan.output.highest.at<cv::Vec3f>(j, i) = cv::Vec3f::all(float(most));
                plan.output.greatestMean.at<cv::Vec3f>(j, i) = cv::Vec3f::all(
                    float(in.input.low < 0 ? most : std::min(most, sum * colorful * p.intensity)));
            }
        if (p.reduction > 1) widenRing(plan.output);
    }
    plan.predictedCost = p.reduction == 1 ? 2.2 : 1.7;
    // Where the knee rises; without one a pixel is a light or is not, and no bound holds.
    plan.gain = std::max(1., colorful * p.intensity * (1 + 12.92 / std::max(double(p.knee), .05)));
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
