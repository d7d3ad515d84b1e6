// The parameters of noise_fog, as its header declares them.
#pragma once

#include <opencv2/core/matx.hpp>
#include <vector>

namespace brume::noise_fog {

enum Model { exponential, power };
enum Where { atTheSurface, alongTheRay, asAProduct };
enum Mode { modulate, ocean, additive, subtractive };
enum Method { procedural, baked };
enum Extent { volumeExtent, ground };
enum AxisProfile { constantAxis, exponentialAxis, rampAxis, tableAxis, noiseAxis };

struct Axis {
    int profile = 0;
    float density = 1, origin = 0, falloff = 0;
};
struct Point {
    int axis = 0;
    float position = 0, density = 0;
};

struct NoiseFog {
    cv::Vec3f color, colorHigh;
    int model = 0, where = 0, mode = 0;
    float low = 0, high = 0, strength = 0, start = 0, density = 0, powerDistance = 1, powerExponent = 1,
          maxOpacity = 1;
    int noise = 0;
    float size = 1;
    int octaves = 1;
    cv::Vec3f wind;
    int seed = 0, tile = 16, extent = 0, method = 0, resolution = 128, smoothing = 0, steps = 1;
    float range = 0;
    // x, y, z; bound one by one
    int xProfile = 0, yProfile = 0, zProfile = 0;
    float xDensity = 1, yDensity = 1, zDensity = 1, xOrigin = 0, yOrigin = 0, zOrigin = 0;
    float xFalloff = 0, yFalloff = 0, zFalloff = 0;
    std::vector<Point> points;
    cv::Vec3f sunDirection, sunColor;
    float sunExponent = 1, sunOffset = 0;

    Axis axis(int a) const {
        if (a == 0) return {xProfile, xDensity, xOrigin, xFalloff};
        if (a == 1) return {yProfile, yDensity, yOrigin, yFalloff};
        return {zProfile, zDensity, zOrigin, zFalloff};
    }
    bool isGround() const { return extent == ground && where != asAProduct; }
    bool isBaked() const { return method == baked && where != asAProduct; }
    bool hasSun() const { return sunColor != cv::Vec3f(0, 0, 0); }
    /// Pascal's row is 2·this.
    int smoothingRow() const { return where == atTheSurface ? smoothing : 0; }
    int edge() const { return std::max(resolution, tile); }
};

}  // namespace brume::noise_fog
