#include "frame/image_file.hpp"

#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "error.hpp"
#include "frame/decode.hpp"
#include "modules/module.hpp"
#include "nearest_name.hpp"

namespace brume {

namespace fs = std::filesystem;

namespace {
constexpr uint64_t mostPixelsAByte = 32768;
}

std::vector<unsigned char> readBytes(const std::string& path, size_t limit) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status))
        failIo(path, ": there is no such ", path.ends_with('/') ? "folder" : "file", suggestionBeside(path));
    if (fs::is_directory(status)) failIo(path, ": is a folder, not an image file");
    if (!fs::is_regular_file(status)) failIo(path, ": is not a regular file");
    const uintmax_t size = fs::file_size(path, error);
    if (error) failIo(path, ": ", error.message());
    if (size == 0) failIo(path, ": the file is empty");
    std::ifstream in(path, std::ios::binary);
    if (!in) failIo(path, ": ", std::strerror(errno));
    std::vector<unsigned char> bytes(std::min<uintmax_t>(size, limit));
    if (!in.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size())))
        failIo(path, ": cannot be read: ", std::strerror(errno));
    return bytes;
}

std::string readText(const std::string& path, int mostMebibytes) {
    const size_t most = size_t(mostMebibytes) << 20;
    const std::vector<unsigned char> bytes = readBytes(path, most + 1);
    if (bytes.size() > most) failIo(path, ": holds more than ", mostMebibytes, " MiB of text");
    if (std::find(bytes.begin(), bytes.end(), 0) != bytes.end())
        failIo(path, ": is no text: it holds zero bytes");
    return {bytes.begin(), bytes.end()};
}

void writeBytes(const std::string& path, const std::vector<std::span<const unsigned char>>& pieces) {
    std::ofstream out(path, std::ios::binary);
    for (const auto& bytes : pieces)
        out.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    out.close();
    if (!out) failIo(path, ": cannot be written: ", std::strerror(errno));
}

void requireSize(const std::string& path, int64_t width, int64_t height, size_t maxPixels,
                 const std::string& what) {
    const std::string declared =
        text(path, ": ", what, what.empty() ? "" : " ", "declares ", width, " × ", height, " pixels");
    if (width < 1 || height < 1) failIo(declared);
    if (uint64_t(width) > maxPixels / uint64_t(height))
        failIo(declared, ", more than the limit of ", maxPixels);
    std::error_code none;
    const uintmax_t bytes = fs::file_size(path, none);
    if (!none && uint64_t(width) * uint64_t(height) / mostPixelsAByte > bytes)
        failIo(declared, " but the file holds only ", bytes, " bytes");
}

FileFormat formatOf(const std::string& path) {
    const std::vector<unsigned char> head = readBytes(path, 16);
    const auto starts = [&](const std::string& magic, size_t at = 0) {
        return head.size() >= at + magic.size() &&
               std::memcmp(head.data() + at, magic.data(), magic.size()) == 0;
    };
    if (starts("\x76\x2f\x31\x01")) return FileFormat::Exr;
    if (starts("\x89PNG\r\n\x1a\n")) return FileFormat::Png;
    if (starts("\xff\xd8\xff")) return FileFormat::Jpeg;
    if (starts(std::string("II*\0", 4)) || starts(std::string("MM\0*", 4)) ||
        starts(std::string("II+\0", 4)) || starts(std::string("MM\0+", 4)))
        return FileFormat::Tiff;
    if (starts("#?RADIANCE") || starts("#?RGBE")) return FileFormat::Hdr;
    if (starts("\x93NUMPY")) return FileFormat::Npy;
    if (starts("PIEH")) return FileFormat::Dpt;
    if (head.size() >= 3 && head[0] == 'P' && (head[1] == 'F' || head[1] == 'f') &&
        (std::isspace(head[2]) || head[2] == '#'))
        return FileFormat::Pfm;
    return FileFormat::Unknown;
}

StoredImage loadThroughOpenImageIo(const std::string& path, size_t maxPixels) {
    StoredImage image;
    moduleFunction<ReadImageFunction>("image_formats", "brumeReadImage")(path, maxPixels, image);
    return image;
}

StoredImage loadImageHere(const std::string& path, size_t maxPixels) {
    switch (formatOf(path)) {
        case FileFormat::Exr:
            return loadExr(path, maxPixels);
        case FileFormat::Png:
            return loadPng(path, maxPixels);
        case FileFormat::Npy:
            return loadNpy(path, maxPixels);
        case FileFormat::Pfm:
            return loadPfm(path, maxPixels);
        case FileFormat::Dpt:
            return loadDpt(path, maxPixels);
        case FileFormat::Jpeg:
        case FileFormat::Tiff:
        case FileFormat::Hdr:
            return loadThroughOpenImageIo(path, maxPixels);
        case FileFormat::Unknown:
            break;
    }
    failIo(path, ": is not an image brume knows (EXR, PNG, JPEG, TIFF, HDR, PFM, NPY, DPT)");
}

StoredImage loadImage(const std::string& path, size_t maxPixels) {
    const FileFormat format = formatOf(path);
    const bool isApart = format == FileFormat::Exr || format == FileFormat::Jpeg ||
                         format == FileFormat::Tiff || format == FileFormat::Hdr;
    if (!isApart) return loadImageHere(path, maxPixels);
    const Decoded decoded = decode({Decode::Image, path, maxPixels});
    StoredImage image;
    image.pixels = decoded.images.at(0);
    image.premultiplied = decoded.facts.at("premultiplied");
    if (decoded.facts.contains("srgb")) image.srgb = decoded.facts["srgb"].get<bool>();
    return image;
}

}  // namespace brume
