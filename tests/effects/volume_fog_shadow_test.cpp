// Where the CPU march of volume_fog does not look whether it is on the shadow map, it is, and what it leaves
// out is not: with matrices of any numbers.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/core.hpp>
#include <random>

#include "volume_fog/march.hpp"

namespace brume {
namespace {

using volume_fog::March;
using volume_fog::tileWidth;
using volume_fog::volumeRows, volume_fog::lampRows;

constexpr int steps = 12;

// A march of one tile; its rays and its shadow matrix are set from outside. The map is deeper than
// everything: what is on it is in shadow.
class OneTile {
  public:
    explicit OneTile(int channels) {
        p_.shadow_strength = 1;
        p_.steps = steps;
        derived_["volume_count"] = {0};
        derived_["volumes"].assign(4 * volumeRows, 0);
        derived_["lamps"].assign(4 * lampRows, 0);
        derived_["noise_cell"] = derived_["noise_fraction"] = {0, 0, 0};
        derived_["towards_sun"] = {0, 1, 0};
        derived_["shadow"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
        context_.derivedValues = &derived_;
        context_.images["shadow_map"] = cv::Mat(23, 41, CV_MAKETYPE(CV_32F, channels));
        context_.images["shadow_map"] = cv::Scalar::all(-3e38);
        march_ = std::make_unique<March>(p_, context_);
    }
    March& march() { return *march_; }
    float& shadow(int k) { return derived_["shadow"][size_t(k)]; }

  private:
    volume_fog::Params p_;
    DerivedValues derived_;
    CpuContext context_;
    std::unique_ptr<March> march_;
};

class Hostility {
  public:
    explicit Hostility(uint64_t seed) : random_(seed) {}
    double in(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
    int below(int n) { return std::uniform_int_distribution(0, n - 1)(random_); }
    double either() { return below(2) ? 1 : -1; }
    double decades(double low, double high) { return either() * std::pow(10., in(low, high)); }

    // Rays as pixels beside each other have them, as near as they may be, or all over the sphere.
    void castRays(March& m) {
        cv::Vec3d middle(in(-1, 1), in(-1, 1), in(-1, 1));
        if (!below(4)) middle[below(3)] = 0;
        const double spread[] = {0, 1e-7, .05, 2};
        const double apart = spread[below(4)], begin = below(2) ? std::abs(decades(-2, 3)) : 0,
                     stride = below(8) ? std::abs(decades(-3, 3)) : 0;
        for (int x = 0; x < tileWidth; x++) {
            const cv::Vec3d d = middle + apart * cv::Vec3d(in(-1, 1), in(-1, 1), in(-1, 1));
            const cv::Vec3d unit = d * (1 / std::max(cv::norm(d), 1e-9));
            m.tile.dx[x] = float(unit[0]), m.tile.dy[x] = float(unit[1]), m.tile.dz[x] = float(unit[2]);
            m.tile.begin[x] = float(begin * in(.9, 1)), m.tile.stride[x] = float(stride * in(.9, 1));
        }
    }
    // A map that the rays pass through, and then what should not be.
    void makeMatrix(OneTile& one) {
        const auto& t = one.march().tile;
        const double middle = t.begin[0] + in(0, steps) * t.stride[0];
        const double scale = std::abs(decades(-5, 1)) / std::max(middle, .1);
        for (int row = 0; row < 3; row++) {
            double r[3] = {scale * in(-1, 1), scale * in(-1, 1), scale * in(-1, 1)};
            const double u = r[0] * t.dx[0] + r[1] * t.dy[0] + r[2] * t.dz[0];
            const double hair = below(3) ? 0 : decades(-8, -1);
            const double place = (below(3) ? in(0, 1) : below(2)) + hair;  // in the map, or beside an edge
            for (int k = 0; k < 3; k++) one.shadow(4 * row + k) = float(r[k]);
            one.shadow(4 * row + 3) = float(place - u * middle);
        }
        for (int times = below(3); times > 0; times--) spoil(one);
    }

  private:
    std::mt19937_64 random_;

    void spoil(OneTile& one) {
        constexpr float inf = std::numeric_limits<float>::infinity(),
                        nan = std::numeric_limits<float>::quiet_NaN();
        const int row = 4 * below(3), entry = below(12);
        switch (below(7)) {
            case 0:
                one.shadow(entry) = float(decades(-42, 38));
                break;
            case 1:
                one.shadow(entry) = below(2) ? nan : float(either()) * inf;
                break;
            case 2:
                for (int k = 0; k < 3; k++) one.shadow(row + k) = 0;
                break;
            case 3:
                for (int k = 0; k < 4; k++) one.shadow(row + k) *= float(decades(-20, 20));
                break;
            case 4: {  // both ends of the row far away, and the map between them
                const float by = float(decades(0, 21));
                for (int k = 0; k < 4; k++) one.shadow(row + k) *= by;
                break;
            }
            case 5:  // about where the march ceases to trust its roundings
                one.shadow(row + 3) = float(either() * 100 * in(.98, 1.02));
                break;
            default:
                one.shadow(row + below(3)) = float(either() * 1e18 * in(.5, 2));
        }
    }
};

TEST(VolumeFogShadow, HostileMatricesAreLookedUpWithinTheMap) {
    int unclamped = 0, clamped = 0, beyond = 0;
    for (int channels : {1, 4}) {
        OneTile one(channels);
        March& m = one.march();
        const int floats = m.mapRowFloats * int(m.mapHeight);
        Hostility hostility{uint64_t(channels)};
        for (int n = 0; n < 20000; n++) {
            hostility.castRays(m);
            hostility.makeMatrix(one);
            volume_fog::crossShadowMap(m);
            for (int i = 0; i < steps; i++) {
                volume_fog::placeStep(m, i, .5f);
                const bool isInMap = volume_fog::shadeStep(m, i);
                const volume_fog::Tile asIs = m.tile;
                volume_fog::placeInMap(m, false);
                bool isAnyOn = false, isSame = true;
                for (int x = 0; x < tileWidth; x++) {
                    // A ray whose steps have no length has no fog.
                    isAnyOn |= m.tile.sunDepth[x] > -3e38f && m.tile.stride[x] > 0;
                    if (!isInMap) continue;
                    isSame &=
                        asIs.mapIndex[x] == m.tile.mapIndex[x] && asIs.sunDepth[x] == m.tile.sunDepth[x];
                    ASSERT_TRUE(asIs.mapIndex[x] >= 0 && asIs.mapIndex[x] < floats) << n;
                }
                ASSERT_TRUE(isSame) << "case " << n << ", step " << i << " of a map of " << channels;
                ASSERT_TRUE(isInMap || !isAnyOn) << "case " << n << ", step " << i << " is left out";
                const bool isWithin =
                    float(i - 1) > m.tile.firstWhollyIn && float(i + 2) < m.tile.lastWhollyIn;
                (isInMap ? isWithin ? unclamped : clamped : beyond)++;
            }
        }
    }
    // All three happen.
    EXPECT_GT(unclamped, 20000);
    EXPECT_GT(clamped, 20000);
    EXPECT_GT(beyond, 20000);
}

}  // namespace
}  // namespace brume
