// What an image file says of itself, read without its pixels.
#pragma once

#include <map>
#include <opencv2/core/types.hpp>
#include <string>

namespace brume {

/// The text attribute in which apply's outputs say how they were made: JSON, whose "kept" names the files
/// that were written beside.
inline constexpr const char* recordKey = "brume:made";

/// True where writeImage keeps WriteOptions::attributes so that readAttributes finds them: .exr, .png.
bool canHoldAttributes(const std::string& path);

/// Text attributes: an EXR's string attributes, a PNG's iTXt and tEXt; nothing for other formats. Throws
/// Error (Io) for a missing or damaged file.
std::map<std::string, std::string> readAttributes(const std::string& path);

/// Width and height in px as an EXR or PNG header declares them; 0 × 0 for other formats. Throws Error (Io)
/// for a missing or damaged file.
cv::Size declaredSize(const std::string& path);

}  // namespace brume
