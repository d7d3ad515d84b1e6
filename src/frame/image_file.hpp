// One image file as stored: what every format's reader gives, and how a format is told.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace brume {

constexpr size_t usualMaxPixels = size_t(1) << 28;  ///< as in ReadOptions

struct StoredImage {
    cv::Mat pixels;  ///< CV_8U, CV_16U or CV_32F, 1 to 4 channels: grey, grey + alpha, RGB, RGBA
    bool premultiplied = false;
    std::optional<bool> srgb;  ///< the transfer curve, where the format or the file states it
};

enum class FileFormat { Unknown, Exr, Png, Jpeg, Tiff, Hdr, Pfm, Npy, Dpt };

/// By the first bytes, whatever the name ends in. Throws Error (Io): missing, a folder, not permitted, empty.
FileFormat formatOf(const std::string& path);

/// Any format but EXR's layers: an EXR gives its main colour, or its only channel. Throws Error (Io) naming
/// the file and the reason, before memory is taken where the header asks for more than maxPixels.
/// EXR, JPEG, TIFF and HDR are decoded in the reader's process (decode.hpp).
StoredImage loadImage(const std::string& path, size_t maxPixels);
/// All formats in this process.
StoredImage loadImageHere(const std::string& path, size_t maxPixels);

/// "FILE: declares 46340 × 46340 pixels, more than the limit of N" unless 1 ≤ width·height ≤ maxPixels; nor
/// may they be more than 32768 for each byte of the file: sound files have a quarter of that at most (a PNG
/// of one bit a pixel, all black). `what` is what declares them, where not the file itself.
void requireSize(const std::string& path, int64_t width, int64_t height, size_t maxPixels,
                 const std::string& what = "");

/// How far maxPixels raises the other limits: in proportion to its usual value, 1 to 16 times.
inline double raisedBy(size_t maxPixels) {
    return std::clamp(double(maxPixels) / double(usualMaxPixels), 1., 16.);
}

// One reader a family; loadImageHere chooses.
StoredImage loadPng(const std::string& path, size_t maxPixels);
StoredImage loadNpy(const std::string& path, size_t maxPixels);
StoredImage loadPfm(const std::string& path, size_t maxPixels);
StoredImage loadDpt(const std::string& path, size_t maxPixels);
StoredImage loadExr(const std::string& path, size_t maxPixels);
StoredImage loadThroughOpenImageIo(const std::string& path, size_t maxPixels);

/// The whole file, at most `limit` bytes. Throws Error (Io).
std::vector<unsigned char> readBytes(const std::string& path, size_t limit = SIZE_MAX);
/// A whole text file, which must be a regular one of at most so many MiB, without zero bytes. Throws Error
/// (Io).
std::string readText(const std::string& path, int mostMebibytes);
/// The pieces in order. Throws Error (Io); what was written stays (see PendingFile).
void writeBytes(const std::string& path, const std::vector<std::span<const unsigned char>>& pieces);

}  // namespace brume
