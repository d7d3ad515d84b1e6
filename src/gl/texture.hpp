// Images on the GPU. Rows are reversed on the way in and out, so that a texture's row 0 is the picture's
// lowest.
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

    /// CV_32FC4 into GL_RGBA32F or GL_RGBA8, CV_32F into GL_R32F.
    void upload(const cv::Mat& image);
    /// Values of a volume, x fastest.
    void upload(const std::vector<float>& volume);
    /// CV_32FC4, or CV_32F of GL_R32F. Throws Error (CheckFailed) naming `what` where a pixel still holds the
    /// sentinel: a pass that should have written it did not run on the GPU.
    cv::Mat download(const std::string& what) const;

    void fill(const cv::Vec4f& value);
    /// What download recognises as never drawn.
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
