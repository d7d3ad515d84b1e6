// Images on the GPU; gl/staging.hpp moves them there and back.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <tuple>
#include <vector>

#include "gl/functions.hpp"

namespace brume {

/// The bits that fillWithSentinel leaves: a quiet NaN, so that copies keep it, unlike the NaN of any
/// hardware.
constexpr uint32_t sentinelBits = 0x7fe5b3a1u;

/// One level, bilinear, edges clamped. Lives and dies on its context's thread.
class Texture {
  public:
    /// `format`: GL_RGBA32F, GL_R32F or GL_RGBA8. Throws Error (Usage) if the driver cannot hold that size.
    Texture(const GlFunctions& gl, cv::Size size, GLenum format);
    /// A volume of GL_R32F.
    Texture(const GlFunctions& gl, cv::Vec3i size);
    ~Texture();
    Texture(const Texture&) = delete;
    Texture& operator=(const Texture&) = delete;

    GLuint name() const { return name_; }
    cv::Size size() const { return size_; }
    GLenum format() const { return format_; }
    bool isVolume() const { return depth_ > 0; }

    /// Values of a volume, x fastest.
    void upload(const std::vector<float>& volume);
    void fill(const cv::Vec4f& value);
    /// What Staging::download recognises as never drawn.
    void fillWithSentinel();

  private:
    void setSampling();

    const GlFunctions& gl_;
    GLuint name_ = 0;
    cv::Size size_;
    int depth_ = 0;
    GLenum format_;
};

using TexturePtr = std::shared_ptr<Texture>;

/// Keeps textures that nobody holds for the next who needs one of that size and format.
class TexturePool {
  public:
    explicit TexturePool(const GlFunctions& gl) : gl_(gl) {}
    /// Contents are undefined. The pool must outlive what it hands out.
    TexturePtr take(cv::Size size, GLenum format);
    /// Frees what has lain unused since the last call.
    void trim();

  private:
    using Key = std::tuple<int, int, GLenum>;
    struct Spare {
        std::unique_ptr<Texture> texture;
        bool usedSinceTrim = true;
    };
    const GlFunctions& gl_;
    std::multimap<Key, Spare> spares_;
};

}  // namespace brume
