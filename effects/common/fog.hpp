// What every fog effect does last, on a tile of one row; twin of fog.glsl. To be inlined into functions
// marked BRUME_VECTORISE: they are plain loops over pixels.
#pragma once

#include <opencv2/core/matx.hpp>

#include "effect/kit/math.hpp"

namespace brume {

/// px worked on at a time: the arrays of a tile stay in the first-level cache.
constexpr int fogTileSize = 256;

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

// 3. Composite C·T + A·(1 - T) over RGBA pixels. `airlight` is used unless it varies from pixel to pixel.
template <bool oneChannel, bool varyingAirlight>
BRUME_INLINE void compositeTile(const FogTile& t, const cv::Vec3f& airlight, const float* in, float* out,
                                int count) {
    const float fixed[3] = {airlight[0], airlight[1],
                            airlight[2]};  // which no store through `out` can change
    for (int i = 0; i < count; i++) {
        const float scene[4] = {in[4 * i], in[4 * i + 1], in[4 * i + 2], in[4 * i + 3]};
        for (int n = 0; n < 3; n++) {
            const float T = t.transmittance[oneChannel ? 0 : n][i],
                        opacity = t.opacity[oneChannel ? 0 : n][i];
            const float light = varyingAirlight ? t.airlight[n][i] : fixed[n];
            // where T = 0 not even an infinite scene shows; a mask, since three equal selects would become a
            // branch
            const uint32_t shows = 0u - uint32_t(T > 0.0f);
            const float left = std::bit_cast<float>(std::bit_cast<uint32_t>(scene[n]) & shows);
            out[4 * i + n] = left * T + light * opacity;
        }
        out[4 * i + 3] = scene[3];
    }
}

/// Multiplies the running transmittance image's pixels.
BRUME_INLINE void transmittanceTile(const FogTile& t, bool oneChannel, float* transmittance, int count) {
    for (int i = 0; i < count; i++)
        for (int n = 0; n < 3; n++) transmittance[4 * i + n] *= t.transmittance[oneChannel ? 0 : n][i];
}

/// All of the above for one tile of a row whose optical depths are known. `transmittance` may be null.
template <bool varyingAirlight>
BRUME_INLINE void finishTile(FogTile& t, bool oneChannel, const cv::Vec3f& airlight, const float* in,
                             float* out, float* transmittance, int count) {
    extinctionTile(t, oneChannel ? 1 : 3, count);
    if (oneChannel)
        compositeTile<true, varyingAirlight>(t, airlight, in, out, count);
    else
        compositeTile<false, varyingAirlight>(t, airlight, in, out, count);
    if (transmittance) transmittanceTile(t, oneChannel, transmittance, count);
}

}  // namespace brume
