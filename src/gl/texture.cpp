#include "gl/texture.hpp"

#include <bit>

#include "error.hpp"

namespace brume {

Texture::Texture(const GlFunctions& gl, cv::Size size, GLenum format)
    : gl_(gl), size_(size), format_(format) {
    GLint largest = 0;
    gl_.GetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
    if (size.width < 1 || size.height < 1 || size.width > largest || size.height > largest)
        failUsage("OpenGL: an image of ", size.width, "x", size.height, " px; this driver holds 1 to ",
                  largest, " px a side");
    gl_.CreateTextures(GL_TEXTURE_2D, 1, &name_);
    gl_.TextureStorage2D(name_, 1, format, size.width, size.height);
    setSampling();
    if (format != GL_R32F) return;
    for (GLenum channel : {GL_TEXTURE_SWIZZLE_G, GL_TEXTURE_SWIZZLE_B})
        gl_.TextureParameteri(name_, channel, GL_RED);  // one channel stands for grey
    gl_.TextureParameteri(name_, GL_TEXTURE_SWIZZLE_A, GL_ONE);
}

Texture::Texture(const GlFunctions& gl, cv::Vec3i size)
    : gl_(gl), size_(size[0], size[1]), depth_(size[2]), format_(GL_R32F) {
    GLint largest = 0;
    gl_.GetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &largest);
    for (int side : size.val)
        if (side < 1 || side > largest)
            failUsage("OpenGL: a volume of ", size[0], "x", size[1], "x", size[2],
                      "; this driver holds 1 to ", largest, " a side");
    gl_.CreateTextures(GL_TEXTURE_3D, 1, &name_);
    gl_.TextureStorage3D(name_, 1, GL_R32F, size[0], size[1], size[2]);
    setSampling();
}

Texture::~Texture() { gl_.DeleteTextures(1, &name_); }

void Texture::setSampling() {
    gl_.TextureParameteri(name_, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl_.TextureParameteri(name_, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    for (GLenum direction : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
        gl_.TextureParameteri(name_, direction, GL_CLAMP_TO_EDGE);
}

void Texture::upload(const std::vector<float>& volume) {
    CV_Assert(isVolume() && volume.size() == size_t(size_.width) * size_.height * depth_);
    gl_.TextureSubImage3D(name_, 0, 0, 0, 0, size_.width, size_.height, depth_, GL_RED, GL_FLOAT,
                          volume.data());
}

void Texture::fill(const cv::Vec4f& value) { gl_.ClearTexImage(name_, 0, GL_RGBA, GL_FLOAT, value.val); }

void Texture::fillWithSentinel() {
    const float pattern = std::bit_cast<float>(sentinelBits);
    const float value[] = {pattern, pattern, pattern, pattern};
    gl_.ClearTexImage(name_, 0, GL_RGBA, GL_FLOAT, value);
}

TexturePtr TexturePool::take(cv::Size size, GLenum format) {
    const Key key{size.width, size.height, format};
    std::unique_ptr<Texture> texture;
    if (auto spare = spares_.find(key); spare != spares_.end()) {
        texture = std::move(spare->second.texture);
        spares_.erase(spare);
    } else {
        texture = std::make_unique<Texture>(gl_, size, format);
    }
    return TexturePtr(texture.release(), [this, key](Texture* returned) {
        spares_.emplace(key, Spare{std::unique_ptr<Texture>(returned)});
    });
}

void TexturePool::trim() {
    for (auto spare = spares_.begin(); spare != spares_.end();)
        if (spare->second.usedSinceTrim) {
            spare->second.usedSinceTrim = false;
            ++spare;
        } else {
            spare = spares_.erase(spare);
        }
}

}  // namespace brume
