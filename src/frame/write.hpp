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
    bool isData = false;  ///< numbers, not a picture: stored as float without curve or dither (.exr, .tif,
                          ///< .npy), or as 16 bits (.png): number = stored·scale, the attribute "brume:scale"
                          ///< says the scale; one channel keeps 0 for NaN and 65535 for +inf
    bool halfColor =
        true;  ///< EXR colour as half (finite values beyond ±65504 are clipped there), else float
    std::map<std::string, std::string> attributes;  ///< text metadata, where the format can hold it
};

/// Writes RGBA (CV_32FC4, scene-linear, alpha unassociated) or one channel (CV_32F) by the ending of `path`:
/// .exr (premultiplied RGB(A)), .png, .jpg (sRGB-encoded, dithered to 8 bits), .tif, .npy (float32, linear,
/// unassociated). Alpha is left out where it is 1 everywhere, and in JPEG. The file appears under its name
/// only when whole; throws Error (Io) naming path and reason and leaves nothing behind otherwise. Safe to
/// call from several threads.
void writeImage(const std::string& path, const cv::Mat& image, const WriteOptions& options = {});

/// The one-file form: RGB(A) + float Z, camera attributes (docs/FRAMES.md). `path` must end in .exr.
void writeFrame(const std::string& path, const FramePair& frame, const WriteOptions& options = {});

/// Throws Error (Usage) unless writeImage knows the ending of `path`.
void requireWritableEnding(const std::string& path);

}  // namespace brume
