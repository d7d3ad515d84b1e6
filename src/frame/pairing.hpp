// Which depth file belongs to a colour file.
#pragma once

#include <string>
#include <vector>

namespace brume {

/// The endings a depth file may have.
bool isImageEnding(const std::string& ending);

/// A file's name without folder and ending.
std::string stemOf(const std::string& path);

/// The depth file that a pattern with {stem} names, relative to the colour file's folder or else to the
/// current one. Throws Error (Io) where there is no such file.
std::string depthFileFor(const std::string& colorPath, const std::string& pattern);

/// The depth beside a colour file: NAME.depth.EXT or NAME_depth.EXT beside NAME.EXT, or NAME_depth.EXT beside
/// NAME_color.EXT or NAME_rgb.EXT; several where the first of these names is there with several endings.
std::vector<std::string> depthFilesBeside(const std::string& colorPath);

/// The sentence for a colour file that two depth files claim.
std::string ambiguity(const std::string& colorPath, const std::string& one, const std::string& other);

/// Whether a file is the depth of a colour file that lies beside it, by those names; a name in .depth always.
bool isDepthBeside(const std::string& path);

}  // namespace brume
