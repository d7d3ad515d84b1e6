#include "frame/attributes.hpp"

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "error.hpp"
#include "frame/decode.hpp"
#include "frame/image_file.hpp"

namespace brume {
namespace {

constexpr size_t maxPixels = size_t(1) << 40;  // as no pixels are read

uint32_t bigEndian(const unsigned char* p) {
    return uint32_t(p[0]) << 24 | uint32_t(p[1]) << 16 | uint32_t(p[2]) << 8 | p[3];
}

// Calls visit(type, length, stream) for each chunk until it returns false; the stream stands at its data.
template <class Visit>
void forEachChunk(const std::string& path, Visit visit) {
    std::ifstream in(path, std::ios::binary);
    uintmax_t size = std::filesystem::file_size(path);
    uintmax_t at = 8;
    for (std::array<char, 8> head{}; at + 12 <= size;) {
        in.seekg(std::streamoff(at));
        if (!in.read(head.data(), 8)) break;
        uint32_t length = bigEndian(reinterpret_cast<unsigned char*>(head.data()));
        if (at + 12 + length > size) failIo(path, ": the file is truncated");
        if (!visit(std::string(head.data() + 4, 4), length, in)) return;
        at += 12 + uintmax_t(length);
    }
}

// "key\0text", or iTXt's "key\0\0\0\0\0text" (uncompressed).
void addText(const std::string& type, const std::string& data, std::map<std::string, std::string>& found) {
    size_t end = data.find('\0');
    if (end == std::string::npos) return;
    size_t start = end + 1;
    if (type == "iTXt") {
        if (start + 2 > data.size() || data[start] != 0) return;
        size_t language = data.find('\0', start + 2);
        size_t translated = language == std::string::npos ? language : data.find('\0', language + 1);
        if (translated == std::string::npos) return;
        start = translated + 1;
    }
    found[data.substr(0, end)] = data.substr(start);
}

}  // namespace

bool canHoldAttributes(const std::string& path) {
    std::string ending = std::filesystem::path(path).extension().string();
    for (char& c : ending) c = char(std::tolower(static_cast<unsigned char>(c)));
    return ending == ".exr" || ending == ".png";
}

std::map<std::string, std::string> readAttributes(const std::string& path) {
    std::map<std::string, std::string> found;
    FileFormat format = formatOf(path);
    if (format == FileFormat::Exr) {
        const Decoded header = decode({Decode::Header, path, maxPixels});
        for (const auto& [name, value] : header.facts.at("attributes").items())
            if (value.is_string()) found[name] = value;
    } else if (format == FileFormat::Png) {
        forEachChunk(path, [&](const std::string& type, uint32_t length, std::ifstream& in) {
            if (type == "IDAT") return false;  // text after the pixels is not ours
            if ((type == "iTXt" || type == "tEXt") && length < 1 << 24) {
                std::string data(length, '\0');
                in.read(data.data(), length);
                addText(type, data, found);
            }
            return true;
        });
    }
    return found;
}

cv::Size declaredSize(const std::string& path) {
    FileFormat format = formatOf(path);
    if (format == FileFormat::Exr) {
        const Decoded header = decode({Decode::Header, path, maxPixels});
        return {header.facts.at("width"), header.facts.at("height")};
    }
    if (format != FileFormat::Png) return {};
    cv::Size size;
    forEachChunk(path, [&](const std::string& type, uint32_t length, std::ifstream& in) {
        unsigned char head[8] = {};
        if (type == "IHDR" && length >= 8 && in.read(reinterpret_cast<char*>(head), 8))
            size = {int(bigEndian(head) & 0x7fffffff), int(bigEndian(head + 4) & 0x7fffffff)};
        return false;
    });
    requireSize(path, size.width, size.height, maxPixels);
    return size;
}

}  // namespace brume
