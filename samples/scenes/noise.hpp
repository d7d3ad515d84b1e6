// Repeatable randomness for building scenes: an integer hash, a sequence, gradient noise.
#pragma once

#include <cstdint>

namespace scenes {

/// Uniform numbers; the same seed gives the same ones everywhere.
class Random {
  public:
    explicit Random(uint32_t seed) : state_(seed) {}
    float unit();  ///< [0, 1)
    float between(float low, float high) { return low + (high - low) * unit(); }

  private:
    uint32_t state_;
};

uint32_t hash(uint32_t x, uint32_t y, uint32_t seed);

/// Gradient noise over the plane, cells of 1, about -1 to 1; and its slope.
struct Noise {
    float value, dx, dy;
};
Noise gradientNoise(float x, float y, uint32_t seed);

/// A sum of `octaves`, each half as high and twice as fine as the last: about -1 to 1.
float fractalNoise(float x, float y, int octaves, uint32_t seed);

/// Mountains: octaves fade where the coarser ones are steep, as erosion leaves slopes smooth and tops rough.
/// About -1 to 1.
float erodedNoise(float x, float y, int octaves, uint32_t seed);

}  // namespace scenes
