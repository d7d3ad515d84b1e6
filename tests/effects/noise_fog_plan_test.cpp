// What noise_fog's plan foretells, against what it foretells.
#include <gtest/gtest.h>

#include <random>

#include "common/noise_reference.hpp"
#include "common/noise_volume.hpp"
#include "noise_fog/plan.hpp"

namespace brume {
using namespace noise_fog;
namespace {

// The largest error of interpolation is at most what is foretold, and no small part of it.
TEST(NoiseFogPlan, BoundsWhatInterpolatingAVolumeErrs) {
    for (int kind : {0, 1})
        for (int tile : {4, 16})
            for (int edge : {32, 128})
                for (int octaves : {1, 3}) {
                    NoiseFog p;
                    p.noise = kind, p.tile = tile, p.resolution = edge, p.octaves = octaves;
                    const std::vector<double> exact = bakeNoise(NoiseKind(kind), octaves, tile, edge, 0, 5);
                    const std::vector<float> volume(exact.begin(), exact.end());
                    std::mt19937 random(4);
                    std::uniform_real_distribution<double> place(0, tile);
                    NoiseLattice lattice;
                    lattice.mask = uint32_t(tile) - 1, lattice.seed = 5;
                    double worst = 0;
                    for (int k = 0; k < 20000; k++) {
                        const cv::Vec3d q(place(random), place(random), place(random));
                        const double truth = kind == 0
                                                 ? noiseOctaves<NoiseKind::Perlin>(q, lattice, octaves)
                                                 : noiseOctaves<NoiseKind::Simplex>(q, lattice, octaves);
                        const cv::Vec3f t(q * (double(edge) / tile));
                        worst = std::max(
                            worst,
                            std::abs(volumeNoise(volume.data(), edge, t[0], t[1], t[2], 0, 0, 0) - truth));
                    }
                    const std::string what = text("kind ", kind, ", tile ", tile, ", edge ", edge,
                                                  ", octaves ", octaves, ": ", worst, " of ", bakedError(p));
                    EXPECT_LE(worst, bakedError(p)) << what;
                    // measured with twenty times the places, all tiles and octaves: .48 to 1.0 of it
                    EXPECT_GE(worst, .35 * bakedError(p)) << what;
                }
}

}  // namespace
}  // namespace brume
