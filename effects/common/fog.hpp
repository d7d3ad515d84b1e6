// What every fog effect does last, on a tile of one row; twin of fog.glsl. To be inlined into functions
// marked BRUME_VECTORISE: they are plain loops over pixels.
#pragma once

#include <algorithm>
#include <opencv2/core/matx.hpp>

#include "common/stream.hpp"
#include "effect/kit/math.hpp"
#include "effect/plugin.hpp"

namespace brume {

/// px worked on at a time: the arrays of a tile stay in the first-level cache.
constexpr int fogTileSize = 128;

/// A tile of one row. Memory further on is asked for in four parts, between the stages of this tile, so that
/// it comes while they compute: the processor's own prefetching begins anew with each tile, and cannot take
/// all at once.
struct FogSpan {
    const float *depth, *in;
    const float* ahead;          ///< memory that is to be asked for while this tile is worked on
    float *out, *transmittance;  ///< transmittance may be null
    int row, first, count;
    float y;       ///< of the pixels' rays
    bool streams;  ///< out is written past the caches (stream.hpp)

    /// As a rule two tiles ahead; behind the end of a row that is the next one's begin, and behind the last
    /// it is nothing.
    BRUME_INLINE void fetch(int quarter) const {
        const int begin = quarter * (fogTileSize / 4);
        for (int i = begin; i < begin + fogTileSize / 4; i += 16) {
            __builtin_prefetch(depth + 2 * fogTileSize + i);
            for (int k = 0; k < 64; k += 16) {
                __builtin_prefetch(ahead + 4 * i + k);
                if (!streams) __builtin_prefetch(out + 4 * (2 * fogTileSize + i) + k, 1);
            }
        }
    }
};

/// Of the work below: a function called, not inlined, would miss the instructions its caller was built for.
#define BRUME_INLINED __attribute__((always_inline))

/// Calls work(FogSpan), marked BRUME_INLINED, for every tile of some rows.
template <class Work>
BRUME_INLINE void forEachSpan(const CpuContext& c, cv::Range rows, const Work& work) {
    const bool streams = c.outputIsStreamed && canStreamPlanes();
    for (int j = rows.start; j < rows.end; j++) {
        float* out = const_cast<float*>(c.output.ptr<float>(j));
        float* transmittance =
            c.transmittance.empty() ? nullptr : const_cast<float*>(c.transmittance.ptr<float>(j));
        for (int i = 0; i < c.view.width; i += fogTileSize) {
            const float* in = c.input.ptr<float>(j) + 4 * i;
            const float* ahead = c.upcoming.empty() ? in + 8 * fogTileSize : c.upcoming.ptr<float>(j) + 4 * i;
            work(FogSpan{c.depth.ptr<float>(j) + i, in, ahead, out + 4 * i,
                         transmittance ? transmittance + 4 * i : nullptr, j, i,
                         std::min(fogTileSize, c.view.width - i), c.view.rayY(j), streams});
        }
    }
    if (streams) streamEnd();
}

/// Per pixel: optical depth in, then transmittance and opacity; one channel where all three agree.
struct FogTile {
    float opticalDepth[3][fogTileSize];
    float transmittance[3][fogTileSize];
    float opacity[3][fogTileSize];
    float airlight[3][fogTileSize];  ///< where it varies
};

// 1, 2. Transmittance and opacity of each optical depth ≥ 0, which may be inf.
BRUME_INLINE void extinctionTile(FogTile& t, int channels, int count) {
    for (int n = 0; n < channels; n++)
        for (int i = 0; i < count; i++) {
            const Extinction e = extinctionOf(t.opticalDepth[n][i]);
            t.transmittance[n][i] = e.transmittance;
            t.opacity[n][i] = e.opacity;
        }
}

// Four planes into RGBA pixels. A loop of its own: in one with the arithmetic GCC scatters every float by
// itself.
BRUME_INLINE void storePlanes(const float (*plane)[fogTileSize], float* out, int count, bool streams) {
    if (streams) return streamPlanes(out, plane[0], fogTileSize, count);
    for (int i = 0; i < count; i++)
        for (int n = 0; n < 4; n++) out[4 * i + n] = plane[n][i];
}

// Two pixels. Where one number goes for all channels of a pixel it is spread over them: GCC takes channels
// apart at twice the cost.
struct TwoPixels {
    typedef blur::Two Vector;
    typedef int Mask __attribute__((vector_size(32)));
    static constexpr Mask isAlpha = {0, 0, 0, -1, 0, 0, 0, -1};
    // Numbers i and j of four, each four times.
    template <int i, int j>
    static BRUME_INLINE Vector spread(const float* four) {
        const blur::One a = *reinterpret_cast<const blur::One*>(four);
        const Vector twice = __builtin_shufflevector(a, a, 0, 1, 2, 3, 4, 5, 6, 7);
        return __builtin_shufflevector(twice, twice, i, i, i, i, 4 + j, 4 + j, 4 + j, 4 + j);
    }
};

// 3. Composite C·T + A·(1 - T) over RGBA pixels of one airlight, transmittance being that of all channels.
template <bool streams>
BRUME_INLINE void compositeEven(const float* transmittance, const float* opacity, const cv::Vec3f& airlight,
                                const float* in, float* out, int count) {
    typedef TwoPixels::Vector Vector;
    typedef TwoPixels::Mask Mask;
    const float r = airlight[0], g = airlight[1], b = airlight[2];
    const Vector light = {r, g, b, 0, r, g, b, 0}, none = {};
    auto two = [&](int i, Vector T, Vector o) BRUME_INLINED {
        const Vector color = *reinterpret_cast<const Vector*>(in + 4 * i);
        // where T = 0 not even an infinite scene shows
        const Vector left = (Vector)((Mask)color & (T > none));
        const Vector foggy = TwoPixels::isAlpha ? color : left * T + light * o;
        if constexpr (streams)
            streamPixels(out + 4 * i, foggy);
        else
            *reinterpret_cast<Vector*>(out + 4 * i) = foggy;
    };
    int i = 0;
    for (; i + 4 <= count; i += 4) {
        const float *T = transmittance + i, *o = opacity + i;
        two(i, TwoPixels::spread<0, 1>(T), TwoPixels::spread<0, 1>(o));
        two(i + 2, TwoPixels::spread<2, 3>(T), TwoPixels::spread<2, 3>(o));
    }
    for (; i < count; i++) {
        for (int n = 0; n < 3; n++)
            out[4 * i + n] = attenuated(in[4 * i + n], transmittance[i]) + airlight[n] * opacity[i];
        out[4 * i + 3] = in[4 * i + 3];
    }
}
BRUME_INLINE void compositeEvenTile(const FogTile& t, const cv::Vec3f& airlight, const FogSpan& s) {
    if (s.streams)
        compositeEven<true>(t.transmittance[0], t.opacity[0], airlight, s.in, s.out, s.count);
    else
        compositeEven<false>(t.transmittance[0], t.opacity[0], airlight, s.in, s.out, s.count);
}
// The same where either differs by channel or by pixel. `airlight` is used unless it varies from pixel to
// pixel.
template <bool oneChannel, bool varyingAirlight>
BRUME_INLINE void compositeTile(const FogTile& t, const cv::Vec3f& airlight, const FogSpan& s) {
    float plane[4][fogTileSize];
    for (int i = 0; i < s.count; i++) {
        for (int n = 0; n < 3; n++) {
            const float T = t.transmittance[oneChannel ? 0 : n][i],
                        opacity = t.opacity[oneChannel ? 0 : n][i];
            const float light = varyingAirlight ? t.airlight[n][i] : airlight[n];
            // where T = 0 not even an infinite scene shows; a mask, since three equal selects would become a
            // branch
            const uint32_t shows = 0u - uint32_t(T > 0.0f);
            const float left = std::bit_cast<float>(std::bit_cast<uint32_t>(s.in[4 * i + n]) & shows);
            plane[n][i] = left * T + light * opacity;
        }
        plane[3][i] = s.in[4 * i + 3];
    }
    storePlanes(plane, s.out, s.count, s.streams);
}

/// Multiplies the running transmittance image's pixels.
BRUME_INLINE void transmittanceTile(const FogTile& t, bool oneChannel, float* transmittance, int count) {
    float plane[4][fogTileSize];
    for (int i = 0; i < count; i++) {
        for (int n = 0; n < 3; n++)
            plane[n][i] = transmittance[4 * i + n] * t.transmittance[oneChannel ? 0 : n][i];
        plane[3][i] = transmittance[4 * i + 3];
    }
    storePlanes(plane, transmittance, count, false);
}

/// The composite and the running transmittance of one tile, whose transmittance and opacity are known.
template <bool varyingAirlight>
BRUME_INLINE void storeTile(const FogTile& t, bool oneChannel, const cv::Vec3f& airlight, const FogSpan& s) {
    s.fetch(3);
    if (oneChannel && !varyingAirlight)
        compositeEvenTile(t, airlight, s);
    else if (oneChannel)
        compositeTile<true, varyingAirlight>(t, airlight, s);
    else
        compositeTile<false, varyingAirlight>(t, airlight, s);
    if (s.transmittance) transmittanceTile(t, oneChannel, s.transmittance, s.count);
}

}  // namespace brume
