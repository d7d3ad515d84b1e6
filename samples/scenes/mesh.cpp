#include "mesh.hpp"

#include <cmath>
#include <opencv2/core/utility.hpp>

namespace scenes {
namespace {

uint32_t add(Mesh& mesh, cv::Vec3f position, cv::Vec3f normal, cv::Vec3f albedo, float occlusion,
             cv::Vec2f uv) {
    mesh.vertices.push_back({position, normal, albedo, occlusion, uv});
    return uint32_t(mesh.vertices.size() - 1);
}

void triangle(Mesh& mesh, uint32_t a, uint32_t b, uint32_t c) {
    mesh.indices.insert(mesh.indices.end(), {a, b, c});
}

}  // namespace

cv::Vec3f turned(cv::Vec3f p, float yaw) {
    const float c = std::cos(yaw), s = std::sin(yaw);
    return {c * p[0] + s * p[2], p[1], -s * p[0] + c * p[2]};
}

void addQuad(Mesh& mesh, cv::Vec3f a, cv::Vec3f b, cv::Vec3f c, cv::Vec3f d, cv::Vec3f albedo,
             float occlusion) {
    const cv::Vec3f normal = cv::normalize((b - a).cross(d - a));
    const float width = float(cv::norm(b - a)), height = float(cv::norm(d - a));
    const uint32_t first = add(mesh, a, normal, albedo, occlusion, {0, 0});
    add(mesh, b, normal, albedo, occlusion, {width, 0});
    add(mesh, c, normal, albedo, occlusion, {width, height});
    add(mesh, d, normal, albedo, occlusion, {0, height});
    triangle(mesh, first, first + 1, first + 2);
    triangle(mesh, first, first + 2, first + 3);
}

void addBox(Mesh& mesh, cv::Vec3f base, cv::Vec3f size, float yaw, cv::Vec3f albedo) {
    const auto corner = [&](float x, float y, float z) {
        return base + turned({x * size[0] / 2, y * size[1], z * size[2] / 2}, yaw);
    };
    const auto side = [&](cv::Vec3f a, cv::Vec3f b, cv::Vec3f c, cv::Vec3f d) {
        addQuad(mesh, corner(a[0], a[1], a[2]), corner(b[0], b[1], b[2]), corner(c[0], c[1], c[2]),
                corner(d[0], d[1], d[2]), albedo);
    };
    side({-1, 0, 1}, {1, 0, 1}, {1, 1, 1}, {-1, 1, 1});
    side({1, 0, -1}, {-1, 0, -1}, {-1, 1, -1}, {1, 1, -1});
    side({1, 0, 1}, {1, 0, -1}, {1, 1, -1}, {1, 1, 1});
    side({-1, 0, -1}, {-1, 0, 1}, {-1, 1, 1}, {-1, 1, -1});
    side({-1, 1, 1}, {1, 1, 1}, {1, 1, -1}, {-1, 1, -1});
    side({-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1});
}

void addCylinder(Mesh& mesh, const Cylinder& shape, cv::Vec3f albedo) {
    const cv::Vec3f axis = cv::normalize(shape.top - shape.bottom);
    const cv::Vec3f helper = std::abs(axis[1]) < .9f ? cv::Vec3f(0, 1, 0) : cv::Vec3f(0, 0, 1);
    const cv::Vec3f across = cv::normalize(helper.cross(axis)), along = axis.cross(across);
    const float length = float(cv::norm(shape.top - shape.bottom));
    const float slope = (shape.bottomRadius - shape.topRadius) / length;
    const uint32_t first = uint32_t(mesh.vertices.size());
    const int n = shape.sides;
    for (int k = 0; k < n; k++) {
        const float angle = shape.turn + float(2 * CV_PI) * k / n;
        const cv::Vec3f out = across * std::cos(angle) + along * std::sin(angle);
        const cv::Vec3f normal = cv::normalize(out + axis * slope);
        const float drawn = k % 2 ? shape.scallop : 0;
        const cv::Vec3f lower =
            shape.bottom + out * (shape.bottomRadius * (1 - drawn)) + axis * (length * drawn * .35f);
        const cv::Vec3f upper = shape.top + out * shape.topRadius;
        const float u = angle * shape.bottomRadius;
        add(mesh, lower, normal, albedo, shape.bottomOcclusion * (1 - drawn), {u, 0});
        add(mesh, upper, normal, albedo, shape.topOcclusion, {u, length});
    }
    const uint32_t below = add(mesh, shape.bottom + axis * (shape.scallop * length * .3f), -axis, albedo,
                               shape.bottomOcclusion * .5f, {0, 0});
    const uint32_t above = add(mesh, shape.top, axis, albedo, shape.topOcclusion, {0, length});
    for (int k = 0; k < n; k++) {
        const uint32_t a = first + 2 * k, b = first + 2 * ((k + 1) % n);
        triangle(mesh, a, b, b + 1);
        if (shape.topRadius > 0) {
            triangle(mesh, a, b + 1, a + 1);
            triangle(mesh, above, a + 1, b + 1);
        }
        triangle(mesh, below, b, a);
    }
}

void addSphere(Mesh& mesh, cv::Vec3f centre, float radius, int sides, cv::Vec3f albedo) {
    const int rings = sides / 2;
    const uint32_t first = uint32_t(mesh.vertices.size());
    for (int r = 0; r <= rings; r++) {
        for (int k = 0; k <= sides; k++) {
            const float polar = float(CV_PI) * r / rings, angle = float(2 * CV_PI) * k / sides;
            const cv::Vec3f out(std::sin(polar) * std::sin(angle), std::cos(polar),
                                std::sin(polar) * std::cos(angle));
            add(mesh, centre + out * radius, out, albedo, 1, {angle * radius, polar * radius});
        }
    }
    const uint32_t row = uint32_t(sides + 1);
    for (int r = 0; r < rings; r++) {
        for (int k = 0; k < sides; k++) {
            const uint32_t a = first + r * row + k;
            triangle(mesh, a, a + row, a + row + 1);
            triangle(mesh, a, a + row + 1, a + 1);
        }
    }
}

void addHeightField(Mesh& mesh, const std::vector<float>& xs, const std::vector<float>& zs,
                    const std::function<float(float, float)>& height, cv::Vec3f albedo) {
    const uint32_t first = uint32_t(mesh.vertices.size()), row = uint32_t(xs.size());
    mesh.vertices.resize(first + xs.size() * zs.size());
    const auto vertex = [&](size_t i, size_t j) -> Vertex& { return mesh.vertices[first + j * row + i]; };
    cv::parallel_for_({0, int(zs.size())}, [&](const cv::Range& range) {
        for (int j = range.start; j < range.end; j++)
            for (size_t i = 0; i < xs.size(); i++)
                vertex(i, j) = {{xs[i], height(xs[i], zs[j]), zs[j]}, {}, albedo, 1, {xs[i], zs[j]}};
    });
    for (size_t j = 0; j < zs.size(); j++) {
        for (size_t i = 0; i < xs.size(); i++) {
            const size_t left = i ? i - 1 : 0, right = std::min(i + 1, xs.size() - 1);
            const size_t back = j ? j - 1 : 0, front = std::min(j + 1, zs.size() - 1);
            const cv::Vec3f across = vertex(right, j).position - vertex(left, j).position;
            const cv::Vec3f along = vertex(i, front).position - vertex(i, back).position;
            vertex(i, j).normal = cv::normalize(along.cross(across));
        }
    }
    mesh.indices.reserve(mesh.indices.size() + 6 * (xs.size() - 1) * (zs.size() - 1));
    for (uint32_t j = 0; j + 1 < zs.size(); j++) {
        for (uint32_t i = 0; i + 1 < xs.size(); i++) {
            const uint32_t a = first + j * row + i;
            triangle(mesh, a, a + row, a + row + 1);
            triangle(mesh, a, a + row + 1, a + 1);
        }
    }
}

}  // namespace scenes
