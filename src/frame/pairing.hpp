// Which depth file belongs to a colour file.
#pragma once

#include <string>

namespace brume {

/// The endings a depth file may have.
bool isImageEnding(const std::string& ending);

/// A file's name without folder and ending.
std::string stemOf(const std::string& path);

/// The depth file that a pattern with {stem} names, relative to the colour file's folder or else to the
/// current one. Throws Error (Io) where there is no such file.
std::string depthFileFor(const std::string& colorPath, const std::string& pattern);

/// NAME.depth.EXT beside NAME.EXT, or empty.
std::string depthFileBeside(const std::string& colorPath);

}  // namespace brume
