// One writer a format, for write.cpp: each fills `path` or throws Error (Io) about it.
#pragma once

#include <map>
#include <opencv2/core/mat.hpp>
#include <string>

#include "frame/exr_attributes.hpp"

namespace brume {

using TextAttributes = std::map<std::string, std::string>;

/// CV_8UC(1, 3 or 4), as stored; or CV_16UC(1, 3 or 4) numbers, big-endian already.
void writePng(const std::string& path, const cv::Mat& pixels, const TextAttributes& attributes);

/// CV_32FC(n).
void writeNpy(const std::string& path, const cv::Mat& pixels);

struct ExrContent {
    cv::Mat color;  ///< CV_32FC4 premultiplied, or empty
    bool alpha = true;
    bool halfColor = true;
    cv::Mat grey;   ///< CV_32F as channel Y, or empty
    cv::Mat depth;  ///< CV_32F as channel Z, or empty
    ExrStatements statements;
    std::string folder;  ///< where the file will stand
    TextAttributes attributes;
};
void writeExr(const std::string& path, const ExrContent& content);

/// Through OpenImageIO: .jpg, .tif.
void writeThroughOpenImageIo(const std::string& path, const cv::Mat& pixels, bool srgb,
                             const TextAttributes& attributes);

}  // namespace brume
