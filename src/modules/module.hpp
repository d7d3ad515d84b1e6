// Heavy dependencies are loaded when first needed: linking OpenImageIO or OpenCV's ximgproc costs every start
// of the program .1 to .3 s (they bring GDAL, FFmpeg, OpenVDB, ...).
#pragma once

#include <map>
#include <opencv2/core/mat.hpp>
#include <string>

#include "frame/image_file.hpp"

namespace brume {

/// The address of a C symbol of <folder of libbrume>/brume/modules/<module>.so, which stays loaded. Throws
/// Error (Io) naming the module. Thread-safe.
void* moduleFunction(const std::string& module, const std::string& symbol);

// What the modules export.

/// image_formats, "brumeReadImage": OpenImageIO reads JPEG, TIFF, HDR.
using ReadImageFunction = void(const std::string& path, size_t maxPixels, StoredImage& image);
/// image_formats, "brumeWriteImage": writes CV_8U, CV_16U or CV_32F pixels, text metadata where it fits.
using WriteImageFunction = void(const std::string& path, const cv::Mat& pixels, bool srgb,
                                const std::map<std::string, std::string>& attributes);
/// edge_filters, "brumeSmooth": OpenCV's fast global smoother; guide CV_8UC3 or CV_8U, image CV_32FC(n).
using SmoothFunction = void(const cv::Mat& guide, const cv::Mat& image, double lambda, double sigmaColor,
                            cv::Mat& smooth);

template <class Function>
Function& moduleFunction(const std::string& module, const std::string& symbol) {
    return *reinterpret_cast<Function*>(moduleFunction(module, symbol));
}

}  // namespace brume
