// Small pictures side by side: the first frames of a long run, to look at before it is too late.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace brume::host {

/// CV_32FC4 images in rows of `columns`, each centred in a cell of the largest's size, on dark grey.
cv::Mat contactSheet(const std::vector<cv::Mat>& images, int columns);

}  // namespace brume::host
