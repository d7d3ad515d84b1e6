// The way of images to the GPU and back: memory that the GPU reaches by itself, filled and emptied by all
// cores. From pageable memory a driver copies on one core, through a buffer of its own: six times slower.
#pragma once

#include <cstddef>
#include <string>

#include "frame/image_pool.hpp"
#include "gl/functions.hpp"

namespace brume {

class Texture;

/// Lives and dies on its context's thread.
class Staging {
  public:
    explicit Staging(const GlFunctions& gl) : up_{gl, GL_MAP_WRITE_BIT}, down_{gl, GL_MAP_READ_BIT} {}
    Staging(const Staging&) = delete;
    Staging& operator=(const Staging&) = delete;

    /// CV_32FC4 into GL_RGBA32F, CV_32F into GL_R32F; returns before the GPU has it.
    void upload(Texture& texture, const cv::Mat& image);
    /// CV_32FC4, or CV_32F of GL_R32F. Throws Error (CheckFailed) naming `what` where a pixel still holds the
    /// sentinel: a pass that should have written it did not run on the GPU.
    cv::Mat download(const Texture& texture, const std::string& what);

  private:
    // A buffer mapped for as long as it lives, and what the GPU was last told to do with it.
    struct Mapped {
        const GlFunctions& gl;
        GLbitfield access;
        GLuint buffer = 0;
        size_t bytes = 0;
        void* memory = nullptr;
        GLsync used = nullptr;

        ~Mapped() { release(); }
        void release();
        void wait();
        void* reserve(size_t wanted);
        void markUsed();
    };
    Mapped up_, down_;
    ImagePool images_;
};

}  // namespace brume
