// The noise's theorems, its published value, and fp32 against fp64.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/noise.hpp"
#include "common/noise_reference.hpp"

namespace brume {
namespace {

// The permutation of Perlin, "Improving noise" (2002), as data.
constexpr uint8_t permutation[256] = {
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,
    69,  142, 8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,
    94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136,
    171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122,
    60,  211, 133, 230, 220, 105, 92,  41,  55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161,
    1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196, 135, 130, 116, 188, 159, 86,
    164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124, 123, 5,   202, 38,  147, 118, 126,
    255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189, 28,  42,  223, 183, 170, 213,
    119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,   129, 22,  39,  253,
    19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,  242, 193,
    238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,
    222, 114, 67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

// Published: Perlin's own noise(3.14, 42, 7), printed by many ports of his reference implementation.
TEST(Noise, ReferenceWithPerlinsPermutationGivesThePublishedValue) {
    auto hash = [](int64_t x, int64_t y, int64_t z) {
        auto at = [](int64_t k) { return int64_t(permutation[k & 255]); };
        return uint32_t(at(at(at(x & 255) + (y & 255)) + (z & 255)));
    };
    EXPECT_NEAR(reference::perlin(cv::Vec3d(3.14, 42, 7), hash), .13691995878400012, 1e-15);
}

NoiseLattice latticeAt(int32_t x, int32_t y, int32_t z, uint32_t seed, uint32_t mask = 1023) {
    return {x, y, z, mask, seed};
}

TEST(Noise, ZeroOnLatticePoints) {
    for (int k = 0; k < 1000; k++) {
        const NoiseLattice lattice = latticeAt(k * 7, k * 13, k * 31, uint32_t(k));
        EXPECT_EQ(perlinNoise(float(k % 11), float(-k % 5), float(k % 3), lattice), 0.f);
        EXPECT_EQ(simplexNoise(float(k % 11), float(-k % 5), float(k % 3), lattice), 0.f);
        EXPECT_EQ(simplexNoise(float(k % 11) + .5f, float(-k % 5) + .5f, float(k % 3) + .5f, lattice), 0.f);
    }
}

// The best gradients a cell could draw reach 1 at these places, and nowhere more.
TEST(Noise, ScaleMakesTheLargestPossibleValueOne) {
    auto best = [](cv::Vec3d d) {
        double largest = -10;
        for (uint32_t g = 0; g < 16; g++) largest = std::max(largest, reference::gradient(g).dot(d));
        return largest;
    };
    auto perlin = [&](cv::Vec3d p) {
        double sum = 0;
        for (int corner = 0; corner < 8; corner++) {
            const cv::Vec3d d = p - cv::Vec3d(corner & 1, corner >> 1 & 1, corner >> 2);
            double weight = 1;
            for (int axis = 0; axis < 3; axis++) {
                const double t = 1 - std::abs(d[axis]);
                weight *= t * t * t * (t * (6 * t - 15) + 10);
            }
            sum += weight * best(d);
        }
        return sum * .9649214;
    };
    auto simplex = [&](cv::Vec3d p) {
        double sum = 0;
        for (int k = 0; k < 54; k++) {
            const double half = k >= 27 ? .5 : 0;
            const cv::Vec3d d = p - cv::Vec3d(k % 3 - 1 + half, k / 3 % 3 - 1 + half, k / 9 % 3 - 1 + half);
            if (d.dot(d) < .5) sum += std::pow(.5 - d.dot(d), 4) * best(d);
        }
        return sum * 76.88073;
    };
    EXPECT_NEAR(perlin({.481492, .5, .644743}), 1, 1e-6);
    EXPECT_NEAR(simplex({0, -.166848, .16685}), 1, 1e-6);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0, 1), centred(-.5, .5);
    for (int k = 0; k < 20000; k++) {
        ASSERT_LE(perlin({uniform(random), uniform(random), uniform(random)}), 1);
        ASSERT_LE(simplex({centred(random), centred(random), centred(random)}), 1);
    }
}

// A cell's gradients hashed once give the bits that hashing at every place does, to its very walls.
TEST(Noise, SimplexInAKnownCellIsSimplexNoise) {
    std::mt19937 random(5);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (int k = 0; k < 2000; k++) {
        const int32_t x = int32_t(random() % 1024), y = int32_t(random() % 1024), z = k % 2 ? 1023 : 0;
        const NoiseLattice lattice = latticeAt(0, 0, 0, uint32_t(k));
        const SimplexCell cell = simplexCell(x, y, z, lattice);
        const float walls[] = {0, 1.17549435e-38f, .25f, .49999997f, .5f, .75f, .99999994f, 1};
        for (int i = 0; i < 100; i++) {
            auto coordinate = [&] { return i % 4 ? uniform(random) : walls[random() % 8]; };
            const float fx = coordinate(), fy = coordinate(), fz = coordinate();
            ASSERT_EQ(simplexInCell(fx, fy, fz, cell), simplexInCell(fx, fy, fz, x, y, z, lattice))
                << fx << " " << fy << " " << fz;
        }
    }
}

template <NoiseKind kind>
void compareWithReference() {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(-40, 40);
    double worst = 0, sum = 0, squares = 0, low = 1, high = 0;
    const int count = 60000;
    for (int k = 0; k < count; k++) {
        const NoiseLattice lattice = latticeAt(k % 1024, k * 3 % 1024, k * 7 % 1024, uint32_t(k % 5));
        const cv::Vec3f p(uniform(random), uniform(random), uniform(random));
        const double truth = reference::noise(
            kind, cv::Vec3d(p[0], p[1], p[2]) + cv::Vec3d(lattice.cellX, lattice.cellY, lattice.cellZ), 3,
            1024, lattice.seed);
        const float n = noiseOctaves<kind>(p, lattice, 3);
        worst = std::max(worst, std::abs(n - truth));
        sum += n, squares += double(n) * n;
        low = std::min(low, double(n)), high = std::max(high, double(n));
    }
    EXPECT_LT(worst, 1e-6);
    EXPECT_GE(low, 0);
    EXPECT_LE(high, 1);
    const double mean = sum / count, deviation = std::sqrt(squares / count - mean * mean);
    EXPECT_NEAR(mean, .5, 5 * deviation / std::sqrt(count));
    EXPECT_GT(deviation, .05);
}
TEST(Noise, PerlinFollowsTheReference) { compareWithReference<NoiseKind::Perlin>(); }
TEST(Noise, SimplexFollowsTheReference) { compareWithReference<NoiseKind::Simplex>(); }

// Across the planes where other lattice points come into reach, slopes and curvatures go on: a fade of lower
// degree, or a kernel that ends earlier, would jump by whole numbers there.
TEST(Noise, TwiceContinuouslyDifferentiable) {
    std::mt19937 random(6);
    std::uniform_real_distribution<double> uniform(0, 1);
    const double h = 1e-4;
    double worst[2] = {}, largest[2] = {};
    for (int k = 0; k < 4000; k++) {
        const NoiseLattice lattice = latticeAt(3, 5, 7, uint32_t(k));
        cv::Vec3d p(uniform(random), uniform(random), uniform(random)), towards(.6, .48, .64);
        if (k % 4 == 0)
            p[0] = .5 * (k / 4 % 2);  // a wall of a cell, or its middle
        else if (k % 4 == 1)
            p[1] = p[0];  // two axes as far from the middle
        else if (k % 4 == 2)
            p[1] = 1 - p[0];
        else
            p = cv::Vec3d(p[0], .5, p[0]);
        if (k % 4 == 1 || k % 4 == 2) towards = {.8, -.36, .48};
        auto noise = [&](int kind, double way) {
            const cv::Vec3d q = p + towards * way;
            return kind ? simplexNoise(q[0], q[1], q[2], lattice) : perlinNoise(q[0], q[1], q[2], lattice);
        };
        for (int kind : {0, 1}) {
            auto curvature = [&](double side) {
                return (noise(kind, 0) - 2 * noise(kind, side) + noise(kind, 2 * side)) / (h * h);
            };
            const double after = curvature(h), before = curvature(-h);
            worst[kind] = std::max(worst[kind], std::abs(after - before));
            largest[kind] = std::max(largest[kind], std::abs(after));
        }
    }
    for (int kind : {0, 1}) {
        EXPECT_GT(largest[kind], 5) << kind;
        EXPECT_LT(worst[kind], .1) << kind;  // 2h times the third derivative
    }
}

TEST(Noise, RepeatsAfterItsPeriodInEveryOctave) {
    for (double place : {.3, 5.7, 15.99})
        for (int axis = 0; axis < 3; axis++) {
            cv::Vec3d p(place, .2, 9.4), q = p;
            q[axis] -= 16;
            EXPECT_NEAR(reference::noise(NoiseKind::Perlin, p, 4, 16, 2),
                        reference::noise(NoiseKind::Perlin, q, 4, 16, 2), 1e-12);
            const NoiseLattice lattice = latticeAt(3, 3, 3, 2, 15);
            const cv::Vec3f pf(p), qf(q);
            EXPECT_NEAR(noiseOctaves<NoiseKind::Simplex>(pf, lattice, 4),
                        noiseOctaves<NoiseKind::Simplex>(qf, lattice, 4), 4e-6);
        }
}

// Far from the world's origin, and after a long time, the noise is the noise at the same place.
TEST(Noise, LatticeOriginKeepsLargeCoordinatesExact) {
    for (double far : {0., 1e6, -1e7, 1e9}) {
        const cv::Vec3d eye(far + 1.25, -far - 2.5, .125), wind(3, 0, -4);
        const double time = 1e5, size = 2.5;
        cv::Vec3d fraction;
        const NoiseLattice lattice = noiseLattice(eye, wind, time, size, 4096, 9, fraction);
        const cv::Vec3d way(10.3, -4.4, 7.7);
        const double truth =
            reference::noise(NoiseKind::Perlin, (eye + way - wind * time) / size, 3, 4096, 9);
        const cv::Vec3f p = cv::Vec3f(fraction) + cv::Vec3f(way * (1 / size));
        EXPECT_NEAR(noiseOctaves<NoiseKind::Perlin>(p, lattice, 3), truth, 1e-6 + std::abs(far) * 1e-13);
    }
}

// χ² of the 16 gradients over a plane, and no correlation between neighbours.
TEST(Noise, HashIsUniform) {
    double counts[16] = {}, together[16] = {};
    const int side = 256;
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++) {
            const uint32_t h = latticeHash(x, y, 77, 1);
            counts[h & 15]++;
            together[(h ^ latticeHash(x + 1, y, 77, 1)) & 15]++;
        }
    double chi = 0, chiTogether = 0;
    const double expected = side * side / 16.;
    for (int k = 0; k < 16; k++) {
        chi += std::pow(counts[k] - expected, 2) / expected;
        chiTogether += std::pow(together[k] - expected, 2) / expected;
    }
    EXPECT_LT(chi, 37.7);  // .1 % of a χ² with 15 degrees of freedom
    EXPECT_LT(chiTogether, 37.7);
}

}  // namespace
}  // namespace brume
