// Deep EXR pixels, any number of samples each, flattened to colour and depth.
#pragma once

#include <ImfForward.h>

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace brume {

/// One plane (CV_32F, the data window's size) for each channel name of a deep scan line part: colour and
/// alpha composited front to back (samples are premultiplied), Z of the sample where half of the view is
/// covered, or the last that covers anything; 0 where there is none. Throws Error (Io), also of more than
/// mostSamples samples or more than the file can hold, and what OpenEXR throws.
std::vector<cv::Mat> flattenDeep(Imf::MultiPartInputFile& file, int part,
                                 const std::vector<std::string>& names, const std::string& path,
                                 size_t mostSamples);

}  // namespace brume
