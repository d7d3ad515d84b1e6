#include "contact_sheet.hpp"

#include <algorithm>

namespace brume::host {

cv::Mat contactSheet(const std::vector<cv::Mat>& images, int columns) {
    const int gap = 8;
    cv::Size cell;
    for (const cv::Mat& image : images) {
        cell.width = std::max(cell.width, image.cols);
        cell.height = std::max(cell.height, image.rows);
    }
    columns = std::min(columns, int(images.size()));
    int rows = (int(images.size()) + columns - 1) / std::max(columns, 1);
    cv::Mat sheet(gap + rows * (cell.height + gap), gap + columns * (cell.width + gap), CV_32FC4,
                  cv::Scalar(.02, .02, .02, 1));
    for (size_t k = 0; k < images.size(); k++) {
        int column = int(k) % columns, row = int(k) / columns;
        cv::Point corner(gap + column * (cell.width + gap) + (cell.width - images[k].cols) / 2,
                         gap + row * (cell.height + gap) + (cell.height - images[k].rows) / 2);
        images[k].copyTo(sheet(cv::Rect(corner, images[k].size())));
    }
    return sheet;
}

}  // namespace brume::host
