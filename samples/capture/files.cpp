#include "files.hpp"

#include <png.h>

#include <cstdio>
#include <cstring>

namespace capture {
namespace {

bool complain(const std::string& path) {
    std::fprintf(stderr, "brume_capture: %s cannot be written\n", path.c_str());
    return false;
}

bool writeBytes(const std::string& path, const std::string& head, const void* bytes, size_t count) {
    const std::string partial = path + ".part";
    std::FILE* file = std::fopen(partial.c_str(), "wb");
    if (!file) return complain(path);
    bool ok = std::fwrite(head.data(), 1, head.size(), file) == head.size();
    ok = ok && std::fwrite(bytes, 1, count, file) == count;
    ok = std::fclose(file) == 0 && ok;
    ok = ok && std::rename(partial.c_str(), path.c_str()) == 0;
    if (!ok) std::remove(partial.c_str());
    return ok || complain(path);
}

}  // namespace

bool writePng(const std::string& path, int width, int height, const std::vector<uint8_t>& rgb) {
    png_image image;
    std::memset(&image, 0, sizeof image);
    image.version = PNG_IMAGE_VERSION;
    image.width = png_uint_32(width);
    image.height = png_uint_32(height);
    image.format = PNG_FORMAT_RGB;
    const std::string partial = path + ".part";
    if (png_image_write_to_file(&image, partial.c_str(), 0, rgb.data(), 0, nullptr) &&
        std::rename(partial.c_str(), path.c_str()) == 0)
        return true;
    std::remove(partial.c_str());
    return complain(path);
}

bool writeNpy(const std::string& path, int width, int height, const std::vector<float>& values) {
    std::string head = "{'descr': '<f4', 'fortran_order': False, 'shape': (" + std::to_string(height) + ", " +
                       std::to_string(width) + "), }";
    head.resize((10 + head.size() + 1 + 63) / 64 * 64 - 11, ' ');
    head += '\n';
    const std::string magic =
        std::string("\x93NUMPY\x01\x00", 8) + char(head.size() & 255) + char(head.size() >> 8);
    return writeBytes(path, magic + head, values.data(), values.size() * sizeof(float));
}

bool writeText(const std::string& path, const std::string& text) {
    return writeBytes(path, "", text.data(), text.size());
}

}  // namespace capture
