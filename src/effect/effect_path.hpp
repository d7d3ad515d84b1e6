// What on the command line is an effect's path, and what its name.
#pragma once

#include <filesystem>
#include <string>

namespace brume {

/// A path holds a `/`, ends in .fs or is `.` or `..`. Anything else is a name, looked up in the search path
/// alone: a folder that lies here under that name may be a stranger's, with native code in it.
inline bool isEffectPath(const std::string& nameOrPath) {
    return nameOrPath.find('/') != std::string::npos ||
           std::filesystem::path(nameOrPath).extension() == ".fs" || nameOrPath == "." || nameOrPath == "..";
}

}  // namespace brume
