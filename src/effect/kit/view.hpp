// What an effect's CPU half knows of the camera and the frame; twin of view.glsl.
#pragma once

#include <cmath>
#include <cstdint>
#include <opencv2/core/matx.hpp>

#include "frame/camera.hpp"

namespace brume {

/// fp32 constants, each rounded once from fp64 and given to GLSL bit for bit; `camera` is the fp64 original,
/// for `derive` and `reference`.
struct View {
    int width = 0, height = 0;            ///< px of the image being worked on
    int frameWidth = 0, frameHeight = 0;  ///< px of the whole frame: what radii in px refer to
    float inverseFx = 0, inverseFy = 0;   ///< 1/fx, 1/fy
    float originX = 0, originY = 0;       ///< .5 - cx, .5 - cy
    cv::Matx33f worldFromView;            ///< rotation
    cv::Vec3f eye;                        ///< m, world
    float time = 0;                       ///< s
    int frameIndex = 0;
    uint32_t seed = 0;
    Camera camera;  ///< at width × height
    double exactTime = 0;

    static View of(const Camera& camera, int width, int height, int frameWidth, int frameHeight);

    /// px of this image per px of the frame.
    float pixelScale() const { return float(width) / float(frameWidth); }

    // 1. the ray of a pixel: ((i + .5 - cx)/fx, -(j + .5 - cy)/fy, -1)
    float rayX(int i) const { return (float(i) + originX) * inverseFx; }
    float rayY(int j) const { return -((float(j) + originY) * inverseFy); }
    // 2. its length: distance along the ray per metre of planar depth
    static float rayLength(float x, float y) { return std::sqrt(x * x + (y * y + 1.0f)); }
    // 3. its unit direction in the world
    cv::Vec3f direction(float x, float y) const {
        return worldFromView * (cv::Vec3f(x, y, -1.0f) * (1.0f / rayLength(x, y)));
    }
};

}  // namespace brume
