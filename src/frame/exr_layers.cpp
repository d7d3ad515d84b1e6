// Which channels of an EXR are the picture and its depth: the names that programs write.
#include <ImfHeader.h>

#include <algorithm>
#include <cctype>
#include <tuple>

#include "error.hpp"
#include "frame/exr_file.hpp"
#include "frame/image_file.hpp"

namespace brume {

namespace {

std::string plain(const std::string& name) {  // "View_Layer" and "viewlayer" are the same
    std::string out;
    for (const char c : name)
        if (std::isalnum(static_cast<unsigned char>(c)))
            out += char(std::tolower(static_cast<unsigned char>(c)));
    return out;
}

std::string lastComponent(const std::string& layer) { return layer.substr(layer.rfind('.') + 1); }
std::string firstComponent(const std::string& layer) {
    const size_t dot = layer.find('.');
    return dot == std::string::npos ? "" : layer.substr(0, dot);
}

bool endsWith(const std::string& s, const std::string& end) {
    return s.size() >= end.size() && s.compare(s.size() - end.size(), end.size(), end) == 0;
}

constexpr int never = 1000;

/// R, G, B, A as 0..3; luminance counts as R.
int colorComponent(const std::string& base) {
    const std::string name = plain(base);
    if (name == "r" || name == "red" || name == "y") return 0;
    if (name == "g" || name == "green") return 1;
    if (name == "b" || name == "blue") return 2;
    if (name == "a" || name == "alpha") return 3;
    return -1;
}

int pictureRank(const std::string& layer) {
    const std::string name = plain(lastComponent(layer));
    if (layer.empty()) return 0;
    for (const char* known : {"rgba", "rgb", "combined", "beauty", "color", "colour", "main", "finalimage"})
        if (name == known) return 1;
    // Blender's, Nuke's, Arnold's and Unreal's names of what is no picture.
    for (const char* data :
         {"depth", "normal", "mask", "matte", "crypto", "uv", "vector", "motion", "velocity", "position",
          "disparity", "index", "object", "material", "mist", "forward"})
        if (name.find(data) != std::string::npos) return never;
    return name == "z" || name == "n" || name == "p" ? never : 5;
}

bool namesDepth(const std::string& layer) {
    const std::string name = plain(lastComponent(layer));
    return name == "z" || endsWith(name, "depth") || endsWith(name, "depthz") ||
           name.find("worlddepth") != std::string::npos || name.find("scenedepth") != std::string::npos;
}

int depthRank(const ExrChannel& c) {
    const std::string base = plain(c.base);
    if (base == "z") return c.layer.empty() ? 0 : namesDepth(c.layer) ? 1 : 4;
    if (base == "depth" || base == "zdepth" || base == "pz") return 2;
    if (namesDepth(c.layer))
        for (const char* value : {"v", "r", "red", "x", "y", "value"})
            if (base == value) return 3;
    return never;
}

int bestDepth(const ExrFile& file, const std::string& view, const std::string& colorLayer) {
    int best = -1, bestRank = never;
    for (size_t i = 0; i < file.channels().size(); ++i) {
        const ExrChannel& c = file.channels()[i];
        if (!view.empty() && !c.view.empty() && c.view != view) continue;
        int rank = depthRank(c);
        if (rank >= never) continue;
        if (firstComponent(c.layer) != firstComponent(colorLayer) && c.layer != colorLayer) rank += 10;
        if (rank < bestRank) std::tie(best, bestRank) = std::tuple(int(i), rank);
    }
    return best;
}

}  // namespace

ExrSelection selectLayers(const ExrFile& file) {
    const std::vector<ExrChannel>& channels = file.channels();
    ExrSelection best;
    std::string bestLayer;
    int bestRank = never;
    for (const ExrChannel& leader : channels) {
        if (colorComponent(leader.base) < 0 || colorComponent(leader.base) > 2) continue;
        const int rank = pictureRank(leader.layer) + (leader.view == file.defaultView() ? 0 : 100);
        if (rank >= std::min(bestRank, never)) continue;
        bestRank = rank;
        bestLayer = leader.layer;
        best = ExrSelection();
        best.view = leader.view;
        for (size_t i = 0; i < channels.size(); ++i) {
            const ExrChannel& c = channels[i];
            const int component = colorComponent(c.base);
            if (component >= 0 && c.part == leader.part && c.layer == leader.layer && c.view == leader.view &&
                best.color[component] < 0)
                best.color[component] = int(i);
        }
    }
    best.depth = bestDepth(file, best.view, bestLayer);
    if (best.depth >= 0) {
        const std::string name = plain(lastComponent(channels[best.depth].layer));
        best.depthInCentimetres =
            name.find("worlddepth") != std::string::npos || name.find("worldunits") != std::string::npos;
    }
    return best;
}

int selectDepthOnly(const ExrFile& file) {
    const int named = bestDepth(file, file.defaultView(), "");
    if (named >= 0) return named;
    if (file.channels().size() == 1) return 0;
    const ExrSelection selection = selectLayers(file);
    if (selection.color[0] >= 0) return selection.color[0];
    failIo(file.path(), ": holds no channel that could be depth");
}

StoredImage loadExr(const std::string& path, size_t maxPixels) {
    ExrFile file(path, maxPixels);
    const ExrSelection selection = selectLayers(file);
    StoredImage image;
    image.srgb = false;
    if (!selection.hasColor()) {
        image.pixels = cv::Mat::zeros(file.size(), CV_32F);
        file.read({{selectDepthOnly(file), &image.pixels, 0}});
        return image;
    }
    const bool grey = selection.color[1] < 0 && selection.color[2] < 0, alpha = selection.color[3] >= 0;
    const int count = grey ? (alpha ? 2 : 1) : (alpha ? 4 : 3);
    image.premultiplied = alpha;
    image.pixels = cv::Mat::zeros(file.size(), CV_32FC(count));
    std::vector<ExrFile::Request> requests;
    for (int c = 0; c < 4; ++c)
        if (selection.color[c] >= 0)
            requests.push_back({selection.color[c], &image.pixels, c == 3 ? count - 1 : c});
    file.read(requests);
    return image;
}

}  // namespace brume
