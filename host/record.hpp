// How an output was made, as its own metadata says: enough to make it again and to tell whether it is stale.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "effect/chain.hpp"
#include "frame/attributes.hpp"
#include "options.hpp"
#include "sweep.hpp"

namespace brume::host {

/// One output: everything that decides its pixels.
struct Making {
    std::string input;
    FrameOptions frame;          ///< its depth is the file itself, no pattern
    std::optional<double> time;  ///< s, where the frames' names or list say it
    size_t index = 0;            ///< place among all frames of the run: decides time and dither
    double framesPerSecond = 24;
    uint32_t seed = 0;
    std::string backend;                         ///< "cpu" or "gl"
    bool withDepth = false;                      ///< an EXR output holds depth and camera, too
    std::shared_ptr<const std::string> preset;   ///< JSON with all settings applied
    std::shared_ptr<const std::string> effects;  ///< JSON of effectFiles
    Settings settings;                           ///< what --set said and drew, for people and name patterns
};

/// Content hashes of each effect's shader, includes and plugin, by its name: that a changed effect is
/// noticed. Throws Error (Io, Usage).
nlohmann::ordered_json effectFiles(const Chain& chain);

/// Files' names, sizes, times and content hashes, so that a changed input is noticed. Throws Error (Io).
nlohmann::ordered_json describeFiles(const std::vector<std::string>& files);

/// The record's text. `files` from describeFiles; `kept`: the names of files that were written before it.
std::string writeRecord(const Making& making, const nlohmann::ordered_json& files,
                        const std::vector<std::string>& kept);

/// Whether the file `kept` was written beside the picture with this record, and just before it.
bool wasKeptBeside(const nlohmann::ordered_json& record, const std::string& kept);

/// The record in an image file; none if it has none. Throws Error (Io) if the file cannot be read.
std::optional<nlohmann::ordered_json> readRecord(const std::string& path);

/// Back to what made it. Throws Error (Io) naming `path` if the record lacks something.
Making makingOf(const nlohmann::ordered_json& record, const std::string& path);

/// Empty if the record says that exactly `making` made it from files as they are now; otherwise what differs.
std::string staleness(const nlohmann::ordered_json& record, const Making& making);

}  // namespace brume::host
