// The fog of one view ray in fp64, written from the model and in world space, for the reference: density,
// light, and the places where either is not smooth.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/noise.hpp"
#include "effect/plugin.hpp"
#include "volume_fog/volume_fog.hpp"

namespace volume_fog::truth {

/// Σ of the reach-limited kernels (1/2 - r²)⁴·slope over the lattice points and the half points near p, in
/// cells.
inline double latticeNoise(const cv::Vec3d& p, uint32_t seed) {
    static const int edges[16][3] = {
        {1, 1, 0}, {-1, 1, 0}, {1, -1, 0}, {-1, -1, 0}, {1, 0, 1}, {-1, 0, 1}, {1, 0, -1}, {-1, 0, -1},
        {0, 1, 1}, {0, -1, 1}, {0, 1, -1}, {0, -1, -1}, {1, 1, 0}, {0, -1, 1}, {-1, 1, 0}, {0, -1, -1}};
    double sum = 0;
    for (int half = 0; half < 2; half++) {
        const double offset = .5 * half;
        const int64_t x0 = int64_t(std::floor(p[0] - offset)), y0 = int64_t(std::floor(p[1] - offset)),
                      z0 = int64_t(std::floor(p[2] - offset));
        for (int corner = 0; corner < 8; corner++) {
            const int64_t x = x0 + (corner & 1), y = y0 + (corner >> 1 & 1), z = z0 + (corner >> 2);
            const double dx = p[0] - x - offset, dy = p[1] - y - offset, dz = p[2] - z - offset;
            const double t = .5 - dx * dx - dy * dy - dz * dz;
            if (t <= 0) continue;
            const int* e = edges[brume::latticeHash(uint32_t(x & 1023), uint32_t(y & 1023),
                                                    uint32_t(z & 1023), half ? seed ^ 0x68e31da4u : seed) &
                                 15];
            sum += t * t * t * t * (e[0] * dx + e[1] * dy + e[2] * dz);
        }
    }
    return .5 + .5 * 76.88073 * sum;
}

struct Wall {  // a box of fog; the whole scene is one without walls
    cv::Vec3d low, high, albedo;
    double density;
    int heightFalloff, edgeFalloff;
    double heightStart, heightDistance;  // world y, m
    cv::Vec2d centre, half, edgeStart;   // x and z: m, m, m from the centre
};

struct Shadow {
    bool exists = false;
    cv::Matx44d fromWorld;
    double bias = 0;  // of δ
    cv::Mat map;      // of one channel, or of four that begin with it
    double depthAt(int u, int v) const { return map.ptr<float>(v)[map.channels() * u]; }
};

/// What does not depend on the pixel.
struct Scene {
    const Params& p;
    std::vector<Wall> walls;
    Shadow shadow;
    cv::Vec3d eye, sun, drift;  // drift: how far the noise has blown, m

    Scene(const Params& params, const brume::ReferenceContext& c) : p(params), eye(c.camera.eye()) {
        const double inf = std::numeric_limits<double>::infinity();
        if (p.density > 0)
            walls.push_back({{-inf, -inf, -inf},
                             {inf, inf, inf},
                             {p.albedo[0], p.albedo[1], p.albedo[2]},
                             p.density,
                             p.height_falloff,
                             NoFalloff,
                             p.height_start,
                             p.height_distance,
                             {},
                             {},
                             {}});
        for (const Box& box : p.boxes) {
            const cv::Vec3d centre = box.center, half = cv::Vec3d(box.size) * .5;
            if (!(box.density > 0) || half[0] <= 0 || half[1] <= 0 || half[2] <= 0) continue;
            walls.push_back({centre - half,
                             centre + half,
                             {box.albedo[0], box.albedo[1], box.albedo[2]},
                             box.density,
                             box.height_falloff,
                             box.edge_falloff,
                             centre[1] - half[1] + box.height_start,
                             std::min(double(box.height_distance), 2 * half[1] - box.height_start),
                             {centre[0], centre[2]},
                             {half[0], half[2]},
                             {half[0] * std::clamp(box.edge_start_x / 100., 0., 1.),
                              half[2] * std::clamp(box.edge_start_z / 100., 0., 1.)}});
        }
        sun = cv::Vec3d(p.sun_direction);
        const double length = cv::norm(sun);
        sun = length > 0 ? sun * (1 / length) : cv::Vec3d(0, 1, 0);
        drift = cv::Vec3d(p.wind) * c.time;
        if (p.shadow_strength > 0 && c.extras && c.extras->contains("lights"))
            for (const auto& light : c.extras->at("lights")) {
                if (light.value("type", "") != "directional") continue;
                if (light.contains("world_to_shadow") && c.images.count("shadow_map")) {
                    shadow.exists = true;
                    for (int k = 0; k < 16; k++) shadow.fromWorld.val[k] = light["world_to_shadow"][k];
                    const double* r = shadow.fromWorld.val + 8;
                    shadow.bias = p.shadow_bias * std::hypot(r[0], r[1], r[2]);
                    shadow.map = c.image("shadow_map");
                }
                break;
            }
    }
};

inline double falloff(int kind, double beyond, double distance) {
    if (kind == NoFalloff || beyond <= 0) return 1;
    if (!(distance > 0)) return 0;
    return kind == Linear ? std::max(0., 1 - beyond / distance) : std::exp(-7.5 * beyond / distance);
}

/// 4π·p/4, p the phase function for cos θ.
inline double share(const Params& p, double cosine) {
    const double g = p.anisotropy;
    if (p.phase == HenyeyGreenstein) return .25 * (1 - g * g) / std::pow(1 + g * g - 2 * g * cosine, 1.5);
    if (p.phase == Rayleigh) return .25 * .75 * (1 + cosine * cosine);
    return .25;
}

struct Ray {
    const Scene& s;
    cv::Vec3d d;
    double far;

    cv::Vec3d at(double t) const { return s.eye + d * t; }

    /// Density of one box at t without noise; 0 outside.
    double density(const Wall& w, double t) const {
        const cv::Vec3d q = at(t);
        for (int k = 0; k < 3; k++)
            if (q[k] < w.low[k] || q[k] > w.high[k]) return 0;
        return insideDensity(w, t);
    }
    /// Where its falloffs have come `farther` along each axis, m.
    double insideDensity(const Wall& w, double t, const cv::Vec3d& farther = {}) const {
        const cv::Vec3d q = at(t);
        double density =
            w.density * falloff(w.heightFalloff, q[1] - w.heightStart + farther[1], w.heightDistance);
        for (int k = 0; k < 2; k++)
            density *=
                falloff(w.edgeFalloff, std::abs(q[2 * k] - w.centre[k]) - w.edgeStart[k] + farther[2 * k],
                        w.half[k] - w.edgeStart[k]);
        return density;
    }
    double noise(double t) const {
        const Params& p = s.p;
        if (p.noise == NoNoise) return 1;
        const double n = latticeNoise((at(t) - s.drift) * (1. / p.noise_size), uint32_t(p.noise_seed));
        return 1 + (p.noise == Additive ? n : -n) * p.noise_strength;
    }
    /// Place in the shadow map: texels, texels, δ.
    cv::Vec3d shadowPlace(double t) const {
        const cv::Vec3d q = at(t);
        const cv::Vec4d uvd = s.shadow.fromWorld * cv::Vec4d(q[0], q[1], q[2], 1);
        return {uvd[0] * s.shadow.map.cols, uvd[1] * s.shadow.map.rows, uvd[2]};
    }
    static bool isShadowed(const Shadow& shadow, const cv::Vec3d& place) {
        if (place[0] < 0 || place[1] < 0 || place[0] >= shadow.map.cols || place[1] >= shadow.map.rows)
            return false;
        const double d = place[2] - shadow.bias;
        return d <= 1 && d > shadow.depthAt(int(place[0]), int(place[1]));
    }
    double sunShare(double t) const {
        return s.shadow.exists && isShadowed(s.shadow, shadowPlace(t)) ? 1. - s.p.shadow_strength : 1.;
    }
    cv::Vec3d skyLight(double t) const {
        const Params& p = s.p;
        cv::Vec3d light;
        const double sun = p.sun_intensity * share(p, d.dot(s.sun)) * sunShare(t);
        for (int k = 0; k < 3; k++)
            light[k] = double(p.ambient[k]) * p.ambient_intensity + p.sun_color[k] * sun;
        return light;
    }
    static double attenuation(const PointLight& l, double r) {
        return std::max(double(l.attenuation[0]), 1e-4) + r * (l.attenuation[1] + r * l.attenuation[2]);
    }
    double lampLight(const PointLight& l, double t) const {
        const cv::Vec3d apart = cv::Vec3d(l.position) - at(t);
        const double r = cv::norm(apart);
        return l.intensity * share(s.p, r > 0 ? d.dot(apart) / r : 0) / attenuation(l, r);
    }
    double along(const PointLight& l) const { return d.dot(cv::Vec3d(l.position) - s.eye); }
    /// The part of the ray within a lamp's range; empty: first > second.
    std::pair<double, double> inRange(const PointLight& l) const {
        const double middle = along(l);
        const cv::Vec3d apart = cv::Vec3d(l.position) - s.eye - d * middle;
        const double half2 = double(l.range) * l.range - apart.dot(apart);
        if (half2 <= 0) return {1, -1};
        return {middle - std::sqrt(half2), middle + std::sqrt(half2)};
    }
    /// The part of the ray inside a box; empty: first >= second.
    std::pair<double, double> inside(const Wall& w) const {
        double enter = 0, leave = far;
        for (int k = 0; k < 3; k++) {
            double low = w.low[k] - s.eye[k], high = w.high[k] - s.eye[k];
            if (k == 1 && w.heightFalloff != NoFalloff &&
                (w.heightFalloff == Linear || !(w.heightDistance > 0)))
                high = std::min(high, w.heightStart + std::max(w.heightDistance, 0.) - s.eye[1]);
            if (d[k] == 0) {
                if (low > 0 || high <= 0) return {1, 0};
                continue;
            }
            enter = std::max(enter, std::min(low / d[k], high / d[k]));
            leave = std::min(leave, std::max(low / d[k], high / d[k]));
        }
        return {enter, leave};
    }
};

}  // namespace volume_fog::truth
