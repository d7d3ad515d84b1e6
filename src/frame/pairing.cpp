#include "frame/pairing.hpp"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "error.hpp"
#include "file_status.hpp"

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
    if (isThere(beside)) return beside.lexically_normal().string();
    if (isThere(name)) return name;
    if (beside == fs::path(name)) failIo(colorPath, ": its depth ", name, " does not exist");
    failIo(colorPath, ": its depth is neither ", name, " nor ", beside.string());
}

namespace {

// Endings of a colour's and its depth's stem that belong together.
const std::vector<std::pair<std::string, std::string>> twins = {
    {"", ".depth"}, {"", "_depth"}, {"_color", "_depth"}, {"_rgb", "_depth"}};

std::string upper(std::string text) {
    for (char& c : text) c = char(std::toupper(static_cast<unsigned char>(c)));
    return text;
}

// The images of that folder and stem, whatever their formats.
std::vector<std::string> imagesAt(const fs::path& folder, const std::string& stem) {
    std::vector<std::string> found;
    for (const std::string& ending : endings)
        for (const std::string& written : {ending, upper(ending)})
            if (fs::path path = folder / (stem + written); isThere(path)) found.push_back(path.string());
    return found;
}

// The stem with `from` at its end replaced by `to`, or empty where it does not end so.
std::string exchanged(const std::string& stem, const std::string& from, const std::string& to) {
    if (!stem.ends_with(from) || stem.size() == from.size()) return "";
    return stem.substr(0, stem.size() - from.size()) + to;
}

}  // namespace

std::vector<std::string> depthFilesBeside(const std::string& colorPath) {
    for (const auto& [color, depth] : twins) {
        const std::string stem = exchanged(stemOf(colorPath), color, depth);
        if (stem.empty()) continue;
        std::vector<std::string> paths = imagesAt(fs::path(colorPath).parent_path(), stem);
        if (!paths.empty()) return paths;
    }
    return {};
}

std::string ambiguity(const std::string& colorPath, const std::string& one, const std::string& other) {
    return text(colorPath, ": its depth could be ", one, " or ", other,
                "; say which, as --depth 'FOLDER/{stem}.EXT'");
}

bool isDepthBeside(const std::string& path) {
    const std::string stem = stemOf(path);
    if (stem.ends_with(".depth")) return true;
    for (const auto& [color, depth] : twins) {
        const std::string partner = exchanged(stem, depth, color);
        if (!partner.empty() && !imagesAt(fs::path(path).parent_path(), partner).empty()) return true;
    }
    return false;
}

}  // namespace brume
