// Small pictures side by side: the first frames of a long run, to look at before it is too late.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace brume::host {

struct Thumbnail {
    cv::Mat image;  ///< CV_32FC4, scene-linear
    std::string caption;
};

/// Images in rows of `columns`, each centred above its caption in a cell of the largest's size, on dark grey.
/// Captions longer than their cell keep their end, where names of frames differ.
cv::Mat contactSheet(const std::vector<Thumbnail>& thumbnails, int columns);

}  // namespace brume::host
