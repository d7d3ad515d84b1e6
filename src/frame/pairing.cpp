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

std::string depthFileFor(const std::string& colorPath, const std::string& depth) {
    const fs::path folder = fs::path(colorPath).parent_path();
    const std::string stem = stemOf(colorPath);
    const size_t hole = depth.find("{stem}");
    if (hole != std::string::npos) {
        std::string name = depth;
        name.replace(hole, 6, stem);
        const fs::path path = fs::path(name).is_absolute() ? fs::path(name) : folder / name;
        if (fs::exists(path)) return path.string();
        if (fs::exists(name)) return name;  // relative to where we are
        failIo(colorPath, ": its depth ", path.string(), " does not exist");
    }
    if (!fs::is_directory(depth)) return depth;
    for (const std::string& ending : endings) {
        const fs::path path = fs::path(depth) / (stem + ending);
        if (fs::exists(path)) return path.string();
    }
    failIo(colorPath, ": the folder ", depth, " has no depth named ", stem, ".EXT");
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
