// What both C++ halves of volume_fog know of each other: the parameters, and nothing computed from them.
#pragma once

#include <opencv2/core/matx.hpp>
#include <vector>

namespace volume_fog {

enum Method { Left, Midpoint, GaussLegendre, Jittered, Equiangular, SharedNoise, P2 };
enum Falloff { NoFalloff, Linear, Exponential };
enum Noise { NoNoise, Additive, Subtractive };
enum Phase { Isotropic, HenyeyGreenstein, Rayleigh };

/// How often, at most, short rays' steps between knots of the noise are doubled; as in ray.glsl.
constexpr int mostDoublings = 6;

struct Box {
    cv::Vec3f center, size;  // m
    float density = 0;       // 1/m
    cv::Vec4f albedo;
    int height_falloff = NoFalloff;
    float height_start = 0, height_distance = 0;  // m, from the box's bottom
    int edge_falloff = NoFalloff;
    float edge_start_x = 0, edge_start_z = 0;  // % of the way from centre to edge
};

struct PointLight {
    cv::Vec3f position;  // m
    cv::Vec4f color;
    float intensity = 1;
    float range = 0;        // m
    cv::Vec3f attenuation;  // constant, linear, quadratic
};

struct Params {
    int method = Midpoint, steps = 32;
    bool early_stop = true;
    float max_distance = 0;  // m
    float density = 0;       // 1/m
    cv::Vec4f albedo;
    int height_falloff = NoFalloff;
    float height_start = 0, height_distance = 0;  // m
    std::vector<Box> boxes;
    int noise = NoNoise;
    float noise_strength = 0, noise_size = 1;  // -, m
    cv::Vec3f wind;                            // m/s
    int noise_seed = 0, noise_every = 1;
    cv::Vec3f sun_direction;
    cv::Vec4f sun_color;
    float sun_intensity = 1;
    float shadow_strength = 0, shadow_bias = 0;  // -, m
    cv::Vec4f ambient;
    float ambient_intensity = 1;
    std::vector<PointLight> point_lights;
    int phase = Isotropic;
    float anisotropy = 0;
};

}  // namespace volume_fog
