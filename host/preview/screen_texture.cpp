#include "preview/screen_texture.hpp"

#include <algorithm>
#include <cmath>

namespace brume::preview {

void ScreenTexture::upload(const GlFunctions& gl, const cv::Mat& image) {
    if (name_ && image.data == image_.data && image.size() == image_.size()) return;
    gl_ = &gl;
    if (!name_ || allocated_ != image.size()) {
        release();
        gl_ = &gl;
        allocated_ = image.size();
        gl.CreateTextures(GL_TEXTURE_2D, 1, &name_);
        const int levels = 1 + int(std::log2(std::max(image.cols, image.rows)));
        gl.TextureStorage2D(name_, levels, GL_RGB8, image.cols, image.rows);
        gl.TextureParameteri(name_, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        gl.TextureParameteri(name_, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    }
    image_ = image;
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl.PixelStorei(GL_UNPACK_ROW_LENGTH, 0);
    gl.TextureSubImage2D(name_, 0, 0, 0, image.cols, image.rows, GL_RGB, GL_UNSIGNED_BYTE, image.data);
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
    hasMipmaps_ = false;
}

void ScreenTexture::release() {
    if (name_) gl_->DeleteTextures(1, &name_);
    name_ = 0;
    image_.release();
}

void ScreenTexture::setSampling(bool isSharp, bool isSmall) {
    if (!name_) return;
    if (isSmall && !hasMipmaps_) {
        gl_->GenerateTextureMipmap(name_);
        hasMipmaps_ = true;
    }
    gl_->TextureParameteri(name_, GL_TEXTURE_MIN_FILTER, isSmall ? GL_LINEAR_MIPMAP_LINEAR : GL_LINEAR);
    gl_->TextureParameteri(name_, GL_TEXTURE_MAG_FILTER, isSharp ? GL_NEAREST : GL_LINEAR);
}

}  // namespace brume::preview
