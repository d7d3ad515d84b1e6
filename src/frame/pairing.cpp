#include "frame/pairing.hpp"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "error.hpp"

namespace brume {

namespace fs = std::filesystem;

namespace {

const std::vector<std::string> endings = {".exr", ".png", ".tif", ".tiff", ".pfm",
                                          ".npy", ".dpt", ".jpg", ".jpeg", ".hdr"};

}  // namespace

bool isImageEnding(const std::string& ending) {
    std::string lower = ending;
    for (char& c : lower) c = char(std::tolower(static_cast<unsigned char>(c)));
    return std::find(endings.begin(), endings.end(), lower) != endings.end();
}

std::string stemOf(const std::string& path) { return fs::path(path).stem().string(); }

std::string depthFileFor(const std::string& colorPath, const std::string& pattern) {
    std::string name = pattern;
    const size_t hole = name.find("{stem}");
    if (hole != std::string::npos) name.replace(hole, 6, stemOf(colorPath));
    const fs::path beside = fs::path(colorPath).parent_path() / name;
    if (fs::exists(beside)) return beside.lexically_normal().string();
    if (fs::exists(name)) return name;
    failIo(colorPath, ": its depth ", beside.string(), " does not exist");
}

std::string depthFileBeside(const std::string& colorPath) {
    const fs::path base = fs::path(colorPath).parent_path() / stemOf(colorPath);
    for (const std::string& ending : endings) {
        const std::string path = base.string() + ".depth" + ending;
        if (fs::exists(path)) return path;
    }
    return "";
}

}  // namespace brume
