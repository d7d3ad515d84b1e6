// A ReShade preset (.ini), and what of it brume has effects for.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace brume::host {

/// One value, and the line it stands in, counted from 1.
struct IniValue {
    std::string text;
    int line = 0;
};

struct ReshadePreset {
    std::string path;
    std::vector<std::pair<std::string, std::string>>
        techniques;                          ///< name and file ("" if not said), as they run
    std::map<std::string, IniValue> global;  ///< above the first section
    std::map<std::string, std::map<std::string, IniValue>> sections;  ///< by effect file
    std::map<std::string, std::string> definitions;                   ///< PreprocessorDefinitions
};

/// Comments (;, #, //) and blank lines are left out; of a key that stands twice the last counts. Techniques
/// are those that are on, in the order of TechniqueSorting. Throws Error (Io) if it cannot be read, (Usage)
/// if it names no technique.
ReshadePreset readReshadePreset(const std::string& path);

struct ConvertedPreset {
    std::string text;                ///< brume's JSON, with a comment for each thing not carried
    std::vector<std::string> steps;  ///< "AdaptiveFog: depth_fog"
    std::vector<std::string> lost;   ///< one sentence each
    std::string note;                ///< which far plane its distances are for; empty where it has none
};

/// `far`: metres at ReShade's depth 1, instead of what the preset defines. Throws Error (Usage): a value that
/// is no number, with file and line; nothing that brume knows.
ConvertedPreset convertPreset(const ReshadePreset& preset, std::optional<double> far = {});

}  // namespace brume::host
