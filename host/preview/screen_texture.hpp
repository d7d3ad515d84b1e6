// An 8-bit picture that ImGui can draw.
#pragma once

#include <opencv2/core/mat.hpp>

#include "gl/functions.hpp"

namespace brume::preview {

/// Lives and dies on the window's thread; empty until the first upload.
class ScreenTexture {
  public:
    ScreenTexture() = default;
    ~ScreenTexture() { release(); }
    ScreenTexture(const ScreenTexture&) = delete;
    ScreenTexture& operator=(const ScreenTexture&) = delete;

    /// CV_8UC3 RGB, top row first. Nothing happens if it is the same image as last time.
    void upload(const GlFunctions& gl, const cv::Mat& image);
    void release();
    /// Sharp pixels, or smooth ones. `isSmall`: it will be shrunk, so average.
    void setSampling(bool isSharp, bool isSmall);
    bool isEmpty() const { return name_ == 0; }
    void* id() const { return reinterpret_cast<void*>(uintptr_t(name_)); }
    cv::Size size() const { return image_.size(); }
    const cv::Mat& image() const { return image_; }

  private:
    const GlFunctions* gl_ = nullptr;
    GLuint name_ = 0;
    cv::Size allocated_;
    cv::Mat image_;  // kept, so that its memory cannot be another image's
    bool hasMipmaps_ = false;
};

}  // namespace brume::preview
