#include "frame/exr_limits.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>

#include "error.hpp"
#include "frame/image_file.hpp"

namespace brume {

namespace {

// OpenEXR reads these by what they are, whatever size is stated: past a wrong one it would read another
// header than we do.
const std::map<std::string, int> fixedSizes = {{"box2f", 16},
                                               {"box2i", 16},
                                               {"chromaticities", 32},
                                               {"compression", 1},
                                               {"deepImageState", 1},
                                               {"double", 8},
                                               {"envmap", 1},
                                               {"float", 4},
                                               {"int", 4},
                                               {"keycode", 28},
                                               {"m33d", 72},
                                               {"m33f", 36},
                                               {"m44d", 128},
                                               {"m44f", 64},
                                               {"lineOrder", 1},
                                               {"rational", 8},
                                               {"tiledesc", 9},
                                               {"timecode", 8},
                                               {"v2d", 16},
                                               {"v2f", 8},
                                               {"v2i", 8},
                                               {"v3d", 24},
                                               {"v3f", 12},
                                               {"v3i", 12}};

class Header {
  public:
    Header(const std::string& path, double raised)
        : in_(path, std::ios::binary),
          path_(path),
          mostParts_(int(256 * raised)),
          mostChannels_(int(1024 * raised)),
          mostMebibytes_(int(16 * raised)) {
        left_ = int64_t(std::filesystem::file_size(path));
    }

    std::optional<int32_t> number() {
        unsigned char b[4];
        if (left_ < 4 || !in_.read(reinterpret_cast<char*>(b), 4)) return {};
        left_ -= 4;
        return int32_t(b[0] | b[1] << 8 | b[2] << 16 | uint32_t(b[3]) << 24);
    }
    std::optional<std::string> name() {
        std::string name;
        for (char c; left_ > 0 && name.size() < 256 && in_.get(c); name += c) {
            --left_;
            if (c == '\0') return name;
        }
        return {};
    }
    bool skip(int64_t bytes) {
        left_ -= bytes;
        return left_ >= 0 && in_.seekg(bytes, std::ios::cur);
    }
    /// Channels' names, each with 16 bytes after it, until an empty one.
    bool channels() {
        for (auto one = name(); one; one = name()) {
            if (one->empty()) return true;
            if (++channels_ > mostChannels_) failIo(path_, ": has more than ", mostChannels_, " channels");
            if (!skip(16)) return false;
        }
        return false;
    }
    bool preview(int64_t bytes) {
        const auto width = number(), height = number();
        if (!width || !height) return false;
        const uint64_t pixels = uint64_t(uint32_t(*width)) * uint32_t(*height);
        if (bytes < 8 || bytes % 4 || pixels != uint64_t(bytes - 8) / 4)
            failIo(path_, ": is a damaged EXR: its preview is not of the size it states");
        return skip(bytes - 8);
    }
    /// False at the header's end, or where it makes no sense.
    bool attribute() {
        const auto key = name();
        if (!key || key->empty()) {
            isOver_ = !key || isFresh_;
            return false;
        }
        // OpenEXR's two readers would each take another of them.
        if (isFresh_) names_.clear();
        if (!names_.insert(*key).second)
            failIo(path_, ": is a damaged EXR: its attribute ", *key, " is there twice");
        isFresh_ = false;
        const auto type = name();
        const auto bytes = number();
        if (!type || !bytes || *bytes < 0) return stop();
        if (*bytes > left_)
            failIo(path_, ": its attribute ", *key, " claims ", *bytes, " bytes, more than the file holds");
        if (*bytes >> 20 >= mostMebibytes_)
            failIo(path_, ": its attribute ", *key, " claims ", *bytes, " bytes, more than the limit of ",
                   mostMebibytes_, " MiB");
        const int64_t end = left_ - *bytes;
        const auto fixed = fixedSizes.find(*type);
        const bool isRead = *type == "chlist"    ? channels()
                            : *type == "preview" ? preview(*bytes)
                                                 : skip(fixed == fixedSizes.end() ? *bytes : fixed->second);
        if (isRead && left_ != end)
            failIo(path_, ": is a damaged EXR: its attribute ", *key, " is not of the size it states");
        return isRead || stop();
    }
    void all() {
        const auto magic = number(), version = number();
        const bool isMultipart = version && (*version & 0x1000);
        for (int part = 0; magic && version && (*version & 0xff) == 2 && !isOver_; ++part) {
            if (part > mostParts_) failIo(path_, ": has more than ", mostParts_, " parts");
            isFresh_ = true;
            while (attribute()) {
            }
            if (!isMultipart) return;
        }
    }

  private:
    bool stop() {
        isOver_ = true;
        return false;
    }

    std::ifstream in_;
    std::string path_;
    const int mostParts_, mostChannels_, mostMebibytes_;
    int64_t left_ = 0;
    int channels_ = 0;
    std::set<std::string> names_;  ///< of this part's attributes
    bool isFresh_ = true;          ///< no attribute of this part read
    bool isOver_ = false;          ///< an empty header, after the last part's, or nonsense
};

}  // namespace

void requireModestHeaders(const std::string& path, size_t maxPixels) {
    Header(path, raisedBy(maxPixels)).all();
}

void requireModestBlocks(exr_const_context_t file, int part, const std::string& path, size_t maxPixels) {
    const exr_attr_chlist_t* channels = nullptr;
    exr_attr_box2i_t data{};
    if (exr_get_channels(file, part, &channels) != EXR_ERR_SUCCESS ||
        exr_get_data_window(file, part, &data) != EXR_ERR_SUCCESS)
        return;
    uint64_t width = uint64_t(int64_t(data.max.x) - data.min.x + 1),
             height = uint64_t(int64_t(data.max.y) - data.min.y + 1);
    uint32_t tileWidth = 0, tileHeight = 0;
    int32_t lines = 0;
    exr_tile_level_mode_t levels{};
    exr_tile_round_mode_t rounding{};
    if (exr_get_tile_descriptor(file, part, &tileWidth, &tileHeight, &levels, &rounding) == EXR_ERR_SUCCESS) {
        width = tileWidth;  // of which OpenEXR takes the whole, beyond the image too
        height = tileHeight;
    } else if (exr_get_scanlines_per_chunk(file, part, &lines) == EXR_ERR_SUCCESS) {
        height = std::min(height, uint64_t(std::max(lines, 1)));
    }
    uint64_t pixel = 0;
    for (int c = 0; c < channels->num_channels; ++c)
        pixel += channels->entries[c].pixel_type == EXR_PIXEL_HALF ? 2 : 4;
    const double bytes =
                     double(width) * double(height) * double(pixel),  // beyond 64 bits where a header says so
        most = double(std::min<uint64_t>(maxPixels, uint64_t(1) << 40) * 32 + (1 << 20));
    if (bytes > most)
        failIo(path, ": its blocks of ", width, " × ", height, " pixels in ", channels->num_channels,
               " channels take ", std::floor(bytes / (1 << 20)), " MiB each, more than the limit of ",
               std::floor(most / (1 << 20)));
}

}  // namespace brume
