// Writing images whole or not at all.
#pragma once

#include <map>
#include <opencv2/core/mat.hpp>
#include <string>

#include "frame/frame_pair.hpp"

namespace brume {

struct WriteOptions {
    int frameIndex = 0;  ///< with seed, decides the dither of 8-bit output
    uint32_t seed = 0;
    bool isData = false;  ///< numbers, not a picture: stored without sRGB encoding or dither
    std::map<std::string, std::string> attributes;  ///< text metadata, where the format can hold it
};

/// Writes RGBA (CV_32FC4, scene-linear, alpha unassociated) or one channel (CV_32F) by the ending of `path`:
/// .exr (premultiplied half RGB(A)), .png, .jpg (sRGB-encoded, dithered to 8 bits), .tif, .npy. The file
/// appears under its name only when whole; throws Error (Io) naming path and reason and leaves nothing behind
/// otherwise.
void writeImage(const std::string& path, const cv::Mat& image, const WriteOptions& options = {});

/// The one-file form: RGBA half + Z float and camera attributes.
void writeFrame(const std::string& path, const FramePair& frame, const WriteOptions& options = {});

}  // namespace brume
