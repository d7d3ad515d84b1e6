// A scene to try fog on: geometry with materials, light, sky, and a camera path. World space is brume's:
// metres, right-handed, +y up; the camera starts looking along about -z.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mesh.hpp"

namespace scenes {

/// What a mesh is made of: each is a function of shaders/surface.glsl.
enum class Material {
    ForestFloor,
    Foliage,
    Bark,
    Plank,
    Metal,
    Terrain,
    Water,
    Asphalt,
    Paving,
    Facade,
    Glow,
};

struct Batch {
    Material material;
    Mesh mesh;
    bool castsShadow = true;
};

struct PointLight {
    cv::Vec3f position;
    cv::Vec3f color;        ///< radiance of a white surface facing it, before attenuation
    cv::Vec3f attenuation;  ///< constant, linear, quadratic
    float range;            ///< m
};

struct Sky {
    cv::Vec3f zenith, horizon, ground;  ///< radiance straight up, at the horizon, and below it
    cv::Vec3f glow;                     ///< added around the sun
    float clouds = 0;                   ///< share of the sky they cover
    bool night = false;                 ///< stars, and the horizon's glow of a town
};

struct View {
    cv::Vec3f eye, target;
};

struct Scene {
    std::string name;
    std::vector<Batch> batches;
    Sky sky;
    cv::Vec3f sunDirection;  ///< unit, towards the sun (or moon)
    cv::Vec3f sunColor;      ///< radiance of a white surface facing it
    cv::Vec3f ambientUp;     ///< of a white surface facing up that sees the whole sky
    cv::Vec3f ambientDown;   ///< of one facing down
    std::vector<PointLight> lights;
    std::optional<float> mirrorHeight;        ///< y of the water or wet road, rendered as a plane mirror
    std::function<View(double)> path;         ///< for 0 to 1, the start to the end of the camera's way
    double horizontalView = 60;               ///< degrees
    double nearPlane = .2, farPlane = 20000;  ///< m
    cv::Vec3f shadowMin, shadowMax;           ///< what the sun's depth map must cover
};

Scene forestDay();
Scene streetNight();
Scene valley();

/// The scenes' names, and one by its name. Throws brume::Error (Usage) with the nearest name.
std::vector<std::string> sceneNames();
Scene makeScene(const std::string& name);

}  // namespace scenes
