// The files of a captured pair. Each appears under its name only when whole.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace capture {

/// 8-bit RGB, rows from the top. False, with a word on stderr, where it cannot be written.
bool writePng(const std::string& path, int width, int height, const std::vector<uint8_t>& rgb);
/// float32, rows from the top, NumPy's format.
bool writeNpy(const std::string& path, int width, int height, const std::vector<float>& values);
bool writeText(const std::string& path, const std::string& text);

}  // namespace capture
