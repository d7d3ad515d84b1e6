#include "gl/staging.hpp"

#include <atomic>
#include <cstring>
#include <opencv2/core/utility.hpp>

#include "error.hpp"
#include "gl/texture.hpp"

namespace brume {
namespace {

int typeOf(const Texture& texture) { return texture.format() == GL_R32F ? CV_32F : CV_32FC4; }
GLenum channelsOf(const Texture& texture) { return texture.format() == GL_R32F ? GL_RED : GL_RGBA; }

}  // namespace

void Staging::Mapped::release() {
    wait();
    if (buffer) gl.DeleteBuffers(1, &buffer);
    buffer = 0;
    bytes = 0;
}

void Staging::Mapped::wait() {
    if (!used) return;
    while (gl.ClientWaitSync(used, GL_SYNC_FLUSH_COMMANDS_BIT, 1'000'000'000) == GL_TIMEOUT_EXPIRED) {
    }
    gl.DeleteSync(used);
    used = nullptr;
}

void* Staging::Mapped::reserve(size_t wanted) {
    wait();
    if (wanted <= bytes) return memory;
    release();
    const GLbitfield flags = access | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    gl.CreateBuffers(1, &buffer);
    gl.NamedBufferStorage(buffer, GLsizeiptr(wanted), nullptr, flags | GL_CLIENT_STORAGE_BIT);
    memory = gl.MapNamedBufferRange(buffer, 0, GLsizeiptr(wanted), flags);
    if (!memory) failUsage("OpenGL: no ", wanted, " bytes of memory to move an image through");
    bytes = wanted;
    return memory;
}

void Staging::Mapped::markUsed() { used = gl.FenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0); }

void Staging::upload(Texture& texture, const cv::Mat& image) {
    CV_Assert(image.size() == texture.size() && image.type() == typeOf(texture));
    const size_t rowBytes = image.cols * image.elemSize();
    auto* to = static_cast<std::byte*>(up_.reserve(rowBytes * image.rows));
    cv::parallel_for_({0, image.rows}, [&](cv::Range rows) {
        for (int row = rows.start; row < rows.end; row++)
            std::memcpy(to + rowBytes * row, image.ptr(row), rowBytes);
    });
    up_.gl.BindBuffer(GL_PIXEL_UNPACK_BUFFER, up_.buffer);
    up_.gl.TextureSubImage2D(texture.name(), 0, 0, 0, image.cols, image.rows, channelsOf(texture), GL_FLOAT,
                             nullptr);
    up_.gl.BindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
    up_.markUsed();
}

cv::Mat Staging::download(const Texture& texture, const std::string& what) {
    cv::Mat image = images_.take(texture.size(), typeOf(texture));
    const size_t rowBytes = image.cols * image.elemSize();
    const size_t bytes = rowBytes * image.rows;
    const auto* from = static_cast<const std::byte*>(down_.reserve(bytes));
    down_.gl.BindBuffer(GL_PIXEL_PACK_BUFFER, down_.buffer);
    down_.gl.GetTextureImage(texture.name(), 0, channelsOf(texture), GL_FLOAT, GLsizei(bytes), nullptr);
    down_.gl.BindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    down_.markUsed();
    down_.wait();
    std::atomic<int> unwritten = -1;
    cv::parallel_for_({0, image.rows}, [&](cv::Range rows) {
        for (int row = rows.start; row < rows.end; row++) {
            auto* to = image.ptr<uint32_t>(row);
            std::memcpy(to, from + rowBytes * row, rowBytes);
            unsigned untouched = 0;
            for (size_t k = 0; k < rowBytes / 4; k++) untouched |= to[k] == sentinelBits;
            if (untouched) unwritten = row;
        }
    });
    if (unwritten >= 0)
        throw Error(ErrorKind::CheckFailed,
                    text(what, ": row ", unwritten.load(),
                         " holds pixels that no shader wrote; every pass must store every pixel"));
    return image;
}

}  // namespace brume
