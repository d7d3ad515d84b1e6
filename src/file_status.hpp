// What a path means, where "it cannot be told" is "no": the standard's questions throw for a name that is too
// long.
#pragma once

#include <filesystem>

namespace brume {

inline bool isThere(const std::filesystem::path& path) {
    std::error_code none;
    return std::filesystem::exists(path, none);
}

inline bool isFolder(const std::filesystem::path& path) {
    std::error_code none;
    return std::filesystem::is_directory(path, none);
}

inline bool isFile(const std::filesystem::path& path) {
    std::error_code none;
    return std::filesystem::is_regular_file(path, none);
}

}  // namespace brume
