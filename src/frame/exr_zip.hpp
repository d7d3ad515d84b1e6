// OpenEXR's ZIP compression of blocks of rows, by libdeflate: the same format as zlib's, at twice its speed
// both ways.
#pragma once

#include <openexr.h>

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace brume {

/// Blocks' rows, as a file's header orders them: row by row, in each the channels by name, tightly packed.
struct ExrRows {
    enum class Type { Half, Float, Uint };
    struct Channel {
        Type type = Type::Half;
        float* first = nullptr;  ///< component of the image's first pixel in float, nullptr to skip
        size_t xStride = 1;      ///< in floats, from pixel to pixel
        size_t yStride = 0;      ///< in floats, from row to row
    };
    std::vector<Channel> channels;
    cv::Size size;
    int rowsABlock = 16;

    size_t bytesARow() const;
    int blocks() const { return (size.height + rowsABlock - 1) / rowsABlock; }
};

/// Reads a part of ZIP (or ZIPS) scan lines, all cores at work. Halves and integers become float.
/// Throws Error (Io) naming `path`.
void readZipRows(exr_const_context_t file, int part, int firstRow, const ExrRows& rows,
                 const std::string& path);

/// Every block as it stands in the file: row, size, bytes. Floats become halves as OpenEXR rounds, finite
/// ones beyond the half range clipped to it; the same bytes with any number of threads.
std::vector<std::vector<uint8_t>> zipRows(const ExrRows& rows);

}  // namespace brume
