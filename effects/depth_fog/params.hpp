// depth_fog's parameters, as depth_fog.fs declares them.
#pragma once

#include <opencv2/core/matx.hpp>

namespace depthFog {

enum Model { exponential, exponentialSquared, linear, power };
enum Sun { noSun, powerSun, henyeyGreenstein };

struct DepthFog {
    int model, measure, distanceAlong, sun, mixing;
    float visibility, extinction, maxOpacity, start, cutoff;
    cv::Vec3f tint, color, sunDirection, sunColor;
    float near, far, linearStart, curve, powerDistance, powerExponent;
    float sunExponent, sunAnisotropy, sunOffset;
};

}  // namespace depthFog
