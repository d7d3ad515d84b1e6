// Draws a scene as a game would and captures it: linear HDR colour of 2×2 samples a pixel, the depth buffer
// of one sample a pixel, the sun's depth map.
#pragma once

#include <map>
#include <opencv2/core/mat.hpp>

#include "frame/camera.hpp"
#include "gl/context.hpp"
#include "scene.hpp"

namespace scenes {

struct Capture {
    cv::Mat color;  ///< CV_32FC4, scene-linear, alpha 1
    cv::Mat depth;  ///< CV_32F, device depth, reversed: 1 at the near plane, 0 at the far one and in the sky
    brume::Camera camera;
};

/// The sun's view of the whole scene, as docs/FRAMES.md says.
struct ShadowMap {
    cv::Mat depth;              ///< CV_32F, 0 nearest to the sun, 1 where it meets nothing
    cv::Matx44d worldToShadow;  ///< to (u, v, depth, 1), v from the top
};

/// The camera of a size at a place of the scene's path (0 to 1).
brume::Camera cameraAt(const Scene& scene, cv::Size size, double place);

/// Belongs to the thread of its context.
class Renderer {
  public:
    Renderer(brume::GlContext& context, const Scene& scene);
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    Capture capture(const brume::Camera& camera, cv::Size size);
    const ShadowMap& shadowMap() const { return wide_.map; }

  private:
    struct Drawable {
        Material material;
        bool castsShadow;
        unsigned vertexArray, vertices, indices;
        int count;
    };
    struct Shadow {
        ShadowMap map;
        unsigned texture = 0;
    };
    struct Target {
        unsigned framebuffer = 0, color = 0, depth = 0;
        cv::Size size;
    };

    unsigned compile(const std::string& vertex, const std::string& fragment, const std::string& what);
    void upload(const Batch& batch);
    Target makeTarget(cv::Size size, bool withColor);
    void release(Target& target);
    Shadow renderShadow(cv::Vec3f low, cv::Vec3f high, int size, bool readBack);
    void set(unsigned program, const char* name, const cv::Matx44d& matrix);
    void set(unsigned program, const char* name, cv::Vec3f value);
    void setScene(unsigned program, const brume::Camera& camera, const cv::Matx44d& clipFromWorldWhole);
    void drawDepth(const cv::Matx44d& clipFromWorld, bool shadowCasters);
    void drawColor(const Target& target, const cv::Matx44d& clipFromWorld,
                   const cv::Matx44d& clipFromWorldWhole, const brume::Camera& camera, cv::Vec4f clipPlane,
                   bool mirrors);

    brume::GlContext& context_;
    const brume::GlFunctions& gl_;
    const Scene& scene_;
    std::vector<Drawable> drawables_;
    std::map<Material, unsigned> programs_;
    unsigned skyProgram_ = 0, depthProgram_ = 0, emptyArray_ = 0;
    Shadow near_, wide_;
    unsigned mirror_ = 0;
};

}  // namespace scenes
