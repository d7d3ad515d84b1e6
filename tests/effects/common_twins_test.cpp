// GLSL and C++ halves of effects/common against each other, over a million inputs each.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "common/noise_line.hpp"
#include "common/noise_reference.hpp"
#include "common/profiles.hpp"
#include "common/sun_offset.hpp"
#include "measure/probe.hpp"

namespace brume {
namespace {

constexpr size_t count = 1'000'000;

std::string common(const std::string& name) {
    std::ifstream in(BRUME_SOURCE_DIR "/effects/common/" + name);
    return {std::istreambuf_iterator<char>(in), {}};
}

GlThread& gl() {
    static GlThread thread(GlPlatform::Auto);
    return thread;
}

// Places within 64 cells and whole numbers that stand for cells and seeds.
struct Inputs {
    std::vector<float> places, numbers;
    Inputs() : places(4 * count), numbers(4 * count) {
        std::mt19937 random(5);
        std::uniform_real_distribution<float> place(-64, 64);
        std::uniform_int_distribution<int> cell(0, 255);
        for (size_t k = 0; k < count; k++) {
            for (int n = 0; n < 4; n++) {
                places[4 * k + n] = place(random);
                numbers[4 * k + n] = float(cell(random));
            }
            if (k % 8 == 0)
                places[4 * k + k / 8 % 3] = std::round(places[4 * k + k / 8 % 3]);  // lattice planes
        }
    }
};
const Inputs& inputs() {
    static const Inputs made;
    return made;
}

TEST(CommonTwins, NoiseAgrees) {
    const auto results = probeGlsl(gl(), common("noise.glsl"),
                                   "NoiseLattice l = NoiseLattice(ivec3(in1.xyz), 255u, uint(in1.w));\n"
                                   "result = vec4(perlinNoise(in0.xyz, l), simplexNoise(in0.xyz, l),\n"
                                   "    perlinOctaves(in0.xyz, l, 4), simplexOctaves(in0.xyz, l, 4));",
                                   inputs().places, inputs().numbers);
    double worst[4] = {};
    for (size_t k = 0; k < count; k++) {
        const float *p = &inputs().places[4 * k], *c = &inputs().numbers[4 * k];
        const NoiseLattice l{int(c[0]), int(c[1]), int(c[2]), 255, uint32_t(c[3])};
        const cv::Vec3f place(p[0], p[1], p[2]);
        const float ours[4] = {perlinNoise(p[0], p[1], p[2], l), simplexNoise(p[0], p[1], p[2], l),
                               noiseOctaves<NoiseKind::Perlin>(place, l, 4),
                               noiseOctaves<NoiseKind::Simplex>(place, l, 4)};
        for (int n = 0; n < 4; n++)
            worst[n] = std::max(worst[n], std::abs(double(results[4 * k + n]) - ours[n]));
    }
    for (int n = 0; n < 4; n++) EXPECT_LE(worst[n], 1e-6) << "function " << n;
}

TEST(CommonTwins, LatticeHashesAreTheSameBits) {
    const auto results = probeGlsl(
        gl(), common("noise.glsl"),
        "uint h = latticeHash(uvec3(floatBitsToUint(in0.x), uint(in1.y), uint(in1.z)), uint(in1.w));\n"
        "result = vec4(float(h & 65535u), float(h >> 16), latticeSlope(h, in0.xyz), 0.0);",
        inputs().places, inputs().numbers);
    size_t different = 0;
    for (size_t k = 0; k < count; k++) {
        const float *p = &inputs().places[4 * k], *c = &inputs().numbers[4 * k];
        const uint32_t h =
            latticeHash(std::bit_cast<uint32_t>(p[0]), uint32_t(c[1]), uint32_t(c[2]), uint32_t(c[3]));
        different += results[4 * k] != float(h & 65535u) || results[4 * k + 1] != float(h >> 16) ||
                     results[4 * k + 2] != latticeSlope(h, p[0], p[1], p[2]);
    }
    EXPECT_EQ(different, 0u);
}

TEST(CommonTwins, MeansOfLineNoiseAgree) {
    const auto results = probeGlsl(gl(), common("noise.glsl") + common("noise_line.glsl"),
                                   "NoiseLattice l = NoiseLattice(ivec3(0), 255u, uint(in1.w));\n"
                                   "float a = min(in0.x, in0.y), b = max(in0.x, in0.y);\n"
                                   "float c = a + in0.z * in0.z * 1e-5;\n"
                                   "result = vec4(lineOctavesMean(a, b, int(in1.x), 1u, l, 4), "
                                   "lineOctavesMean(a, c, int(in1.x), 2u, l, 4), c, 0.0);",
                                   inputs().places, inputs().numbers);
    double worst = 0;
    for (size_t k = 0; k < count; k++) {
        const float *p = &inputs().places[4 * k], *c = &inputs().numbers[4 * k];
        const NoiseLattice l{0, 0, 0, 255, uint32_t(c[3])};
        const float a = std::min(p[0], p[1]), b = std::max(p[0], p[1]);
        worst = std::max(worst, std::abs(double(lineOctavesMean(a, b, int(c[0]), 1, l, 4)) - results[4 * k]));
        worst = std::max(worst, std::abs(double(lineOctavesMean(a, results[4 * k + 2], int(c[0]), 2, l, 4)) -
                                         results[4 * k + 1]));
    }
    EXPECT_LE(worst, 1e-6);
}

// φ and the exponential's mean, from 0 to where both ends are far beyond fp32.
TEST(CommonTwins, ProfilesAgreeAndFollowFp64) {
    std::vector<float> in0(4 * count);
    std::mt19937 random(9);
    std::uniform_real_distribution<float> exponent(-45, 30), place(-1, 1);
    for (size_t k = 0; k < count; k++) {
        in0[4 * k] = k == 0 ? 0 : std::exp2(exponent(random));
        in0[4 * k + 1] = 20 * place(random);
        in0[4 * k + 2] = std::exp2(place(random) * 10 - 5);
        in0[4 * k + 3] = std::copysign(std::exp2(exponent(random) * .5f), place(random));
    }
    const auto results =
        probeGlsl(gl(), common("profiles.glsl"),
                  "result = vec4(phi(in0.x), exponentialMean(in0.y, in0.z, in0.w), 0.0, 0.0);", in0);
    double phiApart = 0, phiWrong = 0, meanApart = 0, meanWrong = 0;
    for (size_t k = 0; k < count; k++) {
        const float* p = &in0[4 * k];
        const double x = p[0], truth = x > 0 ? -std::expm1(-x) / x : 1, ours = phi(p[0]);
        phiApart = std::max(phiApart, std::abs(ours - results[4 * k]) / truth);
        phiWrong = std::max(phiWrong, std::abs(ours - truth) / truth);
        // e^x turns an absolute rounding of its exponent into a relative error
        const double mean = exponentialMean(p[1], p[2], p[3]);
        const double exact = exponentialMean(double(p[1]), double(p[2]), double(p[3]));
        const double conditioning = 1 + std::abs(p[1]) + std::min(80.0, double(p[2]) * std::abs(p[3]));
        meanApart = std::max(meanApart, std::abs(mean - results[4 * k + 1]) / exact / conditioning);
        meanWrong = std::max(meanWrong, std::abs(mean - exact) / exact / conditioning);
    }
    EXPECT_LE(phiApart, 4e-7);
    EXPECT_LE(phiWrong, 3e-7);
    EXPECT_LE(meanApart, 6e-7);
    EXPECT_LE(meanWrong, 4e-7);
}

// Where the sun's lobe looks: from next to nothing to past 1e15 m, and with vectors that nearly cancel.
TEST(CommonTwins, OffsetDirectionsAgreeAndFollowFp64) {
    std::vector<float> in0(4 * count), turned[3], way(count);
    for (auto& axis : turned) axis.resize(count);
    std::mt19937 random(13);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<float> exponent(-40, 55);
    const float offset = 10;
    for (size_t k = 0; k < count; k++) {
        cv::Vec3d d(normal(random), normal(random), normal(random));
        if (k % 4 == 0) d = cv::Vec3d::all(-1) + d * .01;
        d /= cv::norm(d);
        way[k] = in0[4 * k + 3] =
            k % 4 == 0 ? float(offset * (1.732 + .01 * normal(random))) : std::exp2(exponent(random));
        for (int n = 0; n < 3; n++) in0[4 * k + n] = turned[n][k] = float(d[n]);
    }
    const auto results = probeGlsl(gl(), common("sun_offset.glsl"),
                                   "result = vec4(offsetDirection(in0.xyz, in0.w, 10.0), 0.0);", in0);
    offsetDirections(turned[0].data(), turned[1].data(), turned[2].data(), way.data(), offset, int(count));
    double apart = 0, wrong = 0;
    for (size_t k = 0; k < count; k++) {
        const cv::Vec3d d(in0[4 * k], in0[4 * k + 1], in0[4 * k + 2]);
        const double L = std::min(1e15, double(way[k]));
        const cv::Vec3d sum = d * L + cv::Vec3d::all(offset);
        const double length = cv::norm(sum), conditioning = (L + offset) / length;
        for (int n = 0; n < 3; n++) {
            apart = std::max(apart, std::abs(double(results[4 * k + n]) - turned[n][k]) / conditioning);
            wrong = std::max(wrong, std::abs(sum[n] / length - turned[n][k]) / conditioning);
        }
    }
    EXPECT_LE(apart, 4e-7);
    EXPECT_LE(wrong, 4e-7);
}

// The telescoping sum is the integral: fp64 against quadrature of the reference's noise.
TEST(LineNoise, MeanIsTheIntegral) {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> place(0, 40);
    const NoiseLattice lattice{0, 0, 0, 63, 7};
    for (int trial = 0; trial < 200; trial++) {
        const double a = place(random), b = a + place(random) * (trial % 2 ? 1 : .001);
        const int steps = 4000;
        double sum = 0, total = 0;
        for (int octave = 0; octave < 3; octave++) {
            double mean = 0;
            for (int k = 0; k < steps; k++)  // Simpson between step ends
                for (int part = 0; part < 3; part++)
                    mean += (part == 1 ? 4 : 1) / 6. / steps *
                            reference::lineNoise((a + (b - a) * (k + .5 * part) / steps) * (1 << octave), 1,
                                                 int64_t(64) << octave, 7 + uint32_t(octave) * 0x9e3779b9u);
            sum += std::pow(.5, octave) * mean, total += std::pow(.5, octave);
        }
        EXPECT_NEAR(lineOctavesMean(a, b, 0, 1, lattice, 3), .5 + .5 * sum / total, 1e-8);
    }
}

// Over a million cells it is taken for 0: what it would be is as small.
TEST(LineNoise, MeanVanishesOverAMillionCells) {
    EXPECT_EQ(lineMean(.25, .25 + 1.01e6, 0, 0, 1023u, 7u), 0);
    for (uint32_t seed = 0; seed < 200; seed++) {
        const double mean = lineMean(.25, .25 + .99e6 + seed / 200., 0, 0, 1023u, seed);
        EXPECT_NE(mean, 0);
        EXPECT_LT(std::abs(mean), 2e-6);
    }
}

// A density of e⁶⁰ at the most: times a way of any length it is a number or infinite, never 0·inf.
TEST(Profiles, ExponentialMeanTimesAnyWayIsANumber) {
    for (float logDensity : {-3e38f, -1e3f, 0.f, 59.f, 1e3f, 3e38f})
        for (float k : {0.f, 1e-30f, .1f, 1e3f, 1e30f})
            for (float y : {0.f, 1e-30f, 1.f, 88.f, 1e15f, 1e30f})
                for (float side : {-1.f, 1.f}) {
                    const float mean = exponentialMean(logDensity, k, side * y);
                    ASSERT_GE(mean, 0) << logDensity << " " << k << " " << side * y;
                    ASSERT_LE(mean, 1.1421e26f) << logDensity << " " << k << " " << side * y;
                    ASSERT_FALSE(std::isnan(mean * y)) << logDensity << " " << k << " " << side * y;
                }
}

}  // namespace
}  // namespace brume
