#include "frame/color_encoding.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <opencv2/core/utility.hpp>
#include <vector>

#include "error.hpp"

// The widest vectors the machine has, chosen when the library is loaded.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__SANITIZE_THREAD__)
#define BRUME_VECTOR_CLONES __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define BRUME_VECTOR_CLONES
#endif

namespace brume {

double srgbEncode(double x) {
    const double a = std::abs(x);
    return std::copysign(a <= .0031308 ? 12.92 * a : 1.055 * std::pow(a, 1 / 2.4) - .055, x);
}

double srgbDecode(double x) {
    const double a = std::abs(x);
    return std::copysign(a <= .04045 ? a / 12.92 : std::pow((a + .055) / 1.055, 2.4), x);
}

namespace {

// x^p for normal x > 0 by log2 and exp2, branch-free: minimax polynomials of log2(1 + f)/f on
// [sqrt(1/2) - 1, sqrt(2) - 1] (relative error 2.7e-8) and of 2^f on [-1/2, 1/2] (1.9e-9), fitted for this
// file.
inline float power(float x, float p) {
    const uint32_t bits = std::bit_cast<uint32_t>(x);
    const int32_t exponent = int32_t(bits - 0x3f3504f3u) >> 23;
    const float f = std::bit_cast<float>(bits - (uint32_t(exponent) << 23)) - 1.0f;
    float q = .1258352262f;
    q = q * f - .2072688692f;
    q = q * f + .2157158665f;
    q = q * f - .238944963f;
    q = q * f + .2879162366f;
    q = q * f - .3607036762f;
    q = q * f + .4809106431f;
    q = q * f - .7213473469f;
    q = q * f + 1.442695004f;
    const float y = (float(exponent) + f * q) * p;
    const float whole = (y + 0x1.8p23f) - 0x1.8p23f, g = y - whole;  // to the nearest integer
    float r = .0001534580719f;
    r = r * g + .001339993118f;
    r = r * g + .009618488975f;
    r = r * g + .05550328777f;
    r = r * g + .2402264689f;
    r = r * g + .6931472057f;
    r = r * g + 1.000000001f;
    return std::bit_cast<float>(std::bit_cast<uint32_t>(r) + (uint32_t(int32_t(whole)) << 23));
}

BRUME_VECTOR_CLONES void encodeRow(const float* in, float* out, int n) {
    for (int i = 0; i < n; ++i) {
        const float x = in[i], a = std::fabs(x);
        const float curve = 1.055f * power(a, float(1 / 2.4)) - .055f;
        const float y = a <= .0031308f ? 12.92f * a : curve;
        out[i] = a < INFINITY ? std::copysign(y, x) : x;  // ±inf and NaN as they are
    }
}

BRUME_VECTOR_CLONES void decodeRow(const float* in, float* out, int n) {
    for (int i = 0; i < n; ++i) {
        const float x = in[i], a = std::fabs(x);
        const float curve = power((a + .055f) / 1.055f, 2.4f);
        const float y = a <= .04045f ? a / 12.92f : curve;
        // Above 1e15 the result is no float any more.
        out[i] = a < 1e15f ? std::copysign(y, x) : (a == a ? std::copysign(INFINITY, x) : x);
    }
}

inline uint32_t mixed(uint32_t h) {
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    h ^= h >> 16;
    return h;
}

BRUME_VECTOR_CLONES void ditherRow(const float* in, uchar* out, int n, uint32_t key) {
    for (int k = 0; k < n; ++k) {
        const float inZeroOne = in[k] > 0 ? std::min(in[k], 1.0f) : 0.0f;
        const uint32_t h = mixed(uint32_t(k) ^ key);
        const float threshold = float(int32_t(h >> 8)) * (0x1p-24f * (1 - 0x1p-11f)) + 0x1p-12f;
        out[k] = uchar(int32_t(inZeroOne * 255.0f + threshold));
    }
}

// What each integer stands for; alpha never goes through the curve.
template <class T>
const float* integerTable(bool srgb) {
    static constexpr int count = std::numeric_limits<T>::max() + 1;
    static const std::vector<float> tables = [] {
        std::vector<float> both(2 * count);
        for (int i = 0; i < count; ++i) {
            both[i] = float(i / double(count - 1));
            both[count + i] = float(srgbDecode(i / double(count - 1)));
        }
        return both;
    }();
    return tables.data() + (srgb ? count : 0);
}

template <class T>
void integersToRgba(const T* in, float* out, int n, int channels, const float* color, const float* plain) {
    const bool grey = channels <= 2;
    for (int i = 0; i < n; ++i, in += channels, out += 4) {
        out[0] = color[in[0]];
        out[1] = color[in[grey ? 0 : 1]];
        out[2] = color[in[grey ? 0 : 2]];
        out[3] = channels == 4 ? plain[in[3]] : channels == 2 ? plain[in[1]] : 1.0f;
    }
}

void floatsToRgba(const float* in, float* out, int n, int channels) {
    const bool grey = channels <= 2;
    for (int i = 0; i < n; ++i, in += channels, out += 4) {
        out[0] = in[0];
        out[1] = in[grey ? 0 : 1];
        out[2] = in[grey ? 0 : 2];
        out[3] = channels == 4 ? in[3] : channels == 2 ? in[1] : 1.0f;
    }
}

}  // namespace

void srgbEncodeRow(const float* linear, float* encoded, int n) { encodeRow(linear, encoded, n); }
void srgbDecodeRow(const float* encoded, float* linear, int n) { decodeRow(encoded, linear, n); }

cv::Mat toLinearRgba(const cv::Mat& stored, bool srgb) {
    if (stored.depth() == CV_32F && stored.channels() == 4 && !srgb) return stored;
    const int n = stored.cols, channels = stored.channels();
    cv::Mat rgba(stored.size(), CV_32FC4);
    cv::parallel_for_(cv::Range(0, stored.rows), [&](const cv::Range& rows) {
        std::vector<float> decoded(srgb && stored.depth() == CV_32F ? 4 * n : 0);
        for (int j = rows.start; j < rows.end; ++j) {
            float* out = rgba.ptr<float>(j);
            switch (stored.depth()) {
                case CV_8U:
                    integersToRgba(stored.ptr<uchar>(j), out, n, channels, integerTable<uchar>(srgb),
                                   integerTable<uchar>(false));
                    break;
                case CV_16U:
                    integersToRgba(stored.ptr<ushort>(j), out, n, channels, integerTable<ushort>(srgb),
                                   integerTable<ushort>(false));
                    break;
                case CV_32F:
                    floatsToRgba(stored.ptr<float>(j), out, n, channels);
                    if (!srgb) break;
                    decodeRow(out, decoded.data(), 4 * n);
                    for (int k = 0; k < 4 * n; ++k) out[k] = k % 4 == 3 ? out[k] : decoded[k];
                    break;
                default:
                    failUsage("colour must have 8 or 16 bits or float32");
            }
        }
    });
    return rgba;
}

cv::Mat toSrgb8(const cv::Mat& image, bool withAlpha, int frameIndex, uint32_t seed) {
    const int n = image.cols, inChannels = image.channels();
    const int channels = inChannels == 1 ? 1 : withAlpha ? 4 : 3;
    if (image.depth() != CV_32F || (inChannels != 1 && inChannels != 4))
        failUsage("a picture must have one or four channels of float32");
    const uint32_t imageKey = mixed(seed * 0x9e3779b9u + uint32_t(frameIndex));
    cv::Mat bytes(image.size(), CV_8UC(channels));
    cv::parallel_for_(cv::Range(0, image.rows), [&](const cv::Range& rows) {
        std::vector<float> packed(size_t(n) * channels), encoded(size_t(n) * channels);
        for (int j = rows.start; j < rows.end; ++j) {
            const float* in = image.ptr<float>(j);
            float* to = packed.data();
            for (int i = 0; i < n; ++i, in += inChannels, to += channels)
                for (int c = 0; c < channels; ++c) to[c] = in[c];
            encodeRow(packed.data(), encoded.data(), n * channels);
            if (channels == 4)
                for (int i = 0; i < n; ++i) encoded[4 * i + 3] = packed[4 * i + 3];
            ditherRow(encoded.data(), bytes.ptr<uchar>(j), n * channels, mixed(imageKey ^ uint32_t(j)));
        }
    });
    return bytes;
}

}  // namespace brume
