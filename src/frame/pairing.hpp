// Which depth file belongs to a colour file.
#pragma once

#include <string>

namespace brume {

/// The endings a depth file may have.
bool isImageEnding(const std::string& ending);

/// A file's name without folder and ending.
std::string stemOf(const std::string& path);

/// The depth file that `depth` (ReadOptions::depth) names for a colour file. Throws Error (Io) where a
/// pattern or folder has no such file.
std::string depthFileFor(const std::string& colorPath, const std::string& depth);

/// NAME.depth.EXT beside NAME.EXT, or empty.
std::string depthFileBeside(const std::string& colorPath);

}  // namespace brume
