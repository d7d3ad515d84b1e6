// Triangle meshes and the few solids the scenes are built of.
#pragma once

#include <cstdint>
#include <functional>
#include <opencv2/core/matx.hpp>
#include <vector>

namespace scenes {

struct Vertex {
    cv::Vec3f position;   ///< m, world
    cv::Vec3f normal;     ///< unit, outward
    cv::Vec3f albedo;     ///< scene-linear; of Glow the emitted radiance
    float occlusion = 1;  ///< how much of the sky it sees, 0 to 1
    cv::Vec2f uv;         ///< m along the surface
};

struct Mesh {
    std::vector<Vertex> vertices;
    std::vector<uint32_t> indices;  ///< three a triangle, counter-clockwise from outside
};

/// A flat quadrilateral with corners a, b, c, d counter-clockwise from outside; uv in metres from a, u along
/// ab.
void addQuad(Mesh& mesh, cv::Vec3f a, cv::Vec3f b, cv::Vec3f c, cv::Vec3f d, cv::Vec3f albedo,
             float occlusion = 1);

/// A box standing on its base's centre, turned by `yaw` (radians, counter-clockwise from above).
void addBox(Mesh& mesh, cv::Vec3f base, cv::Vec3f size, float yaw, cv::Vec3f albedo);

/// A cylinder, or a frustum where the radii differ, along an axis from `bottom` to `top`; capped.
struct Cylinder {
    cv::Vec3f bottom, top;
    float bottomRadius = 1, topRadius = 1;
    int sides = 12;
    float bottomOcclusion = 1, topOcclusion = 1;
    /// Scallops the lower rim: every other corner is drawn in and up by this share. Makes branches of a
    /// layer.
    float scallop = 0;
    float turn = 0;  ///< radians
};
void addCylinder(Mesh& mesh, const Cylinder& shape, cv::Vec3f albedo);

void addSphere(Mesh& mesh, cv::Vec3f centre, float radius, int sides, cv::Vec3f albedo);

/// A height field over a grid whose lines may be spaced freely (both ascending, at least two): `height(x, z)`
/// at every crossing, normals from the crossings around it. Rows are computed in parallel.
void addHeightField(Mesh& mesh, const std::vector<float>& xs, const std::vector<float>& zs,
                    const std::function<float(float, float)>& height, cv::Vec3f albedo);

/// The point turned about the vertical axis, counter-clockwise seen from above.
cv::Vec3f turned(cv::Vec3f point, float yaw);

}  // namespace scenes
