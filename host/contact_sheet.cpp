#include "contact_sheet.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace brume::host {

namespace {

constexpr int gap = 8, captionHeight = 22, font = cv::FONT_HERSHEY_SIMPLEX;
constexpr double fontScale = .45;

int widthOf(const std::string& words) {
    int baseline = 0;
    return cv::getTextSize(words, font, fontScale, 1, &baseline).width;
}

// OpenCV's letters are those of ASCII: a byte of any other is shown as one '?'.
void write(cv::Mat& sheet, std::string words, cv::Point corner, int width) {
    while (words.size() > 4 && widthOf(words) > width) words = "..." + words.substr(4);
    if (widthOf(words) > width) return;
    cv::Mat mask(sheet.size(), CV_8U, cv::Scalar(0));
    cv::putText(mask, words, {corner.x, corner.y + captionHeight - 8}, font, fontScale, cv::Scalar(255), 1,
                cv::LINE_AA);
    const cv::Rect line(corner.x, corner.y, std::min(width + gap, sheet.cols - corner.x), captionHeight);
    for (int j = line.y; j < line.y + line.height; j++)
        for (int i = line.x; i < line.x + line.width; i++)
            sheet.at<cv::Vec4f>(j, i) += .35f * float(mask.at<uchar>(j, i)) / 255 * cv::Vec4f(1, 1, 1, 0);
}

}  // namespace

cv::Mat contactSheet(const std::vector<Thumbnail>& thumbnails, int columns) {
    cv::Size cell;
    for (const auto& [image, caption] : thumbnails) {
        cell.width = std::max(cell.width, image.cols);
        cell.height = std::max(cell.height, image.rows);
    }
    columns = std::min(columns, int(thumbnails.size()));
    const int rows = (int(thumbnails.size()) + columns - 1) / std::max(columns, 1);
    const cv::Size step(cell.width + gap, cell.height + captionHeight + gap);
    cv::Mat sheet(gap + rows * step.height, gap + columns * step.width, CV_32FC4,
                  cv::Scalar(.02, .02, .02, 1));
    for (size_t k = 0; k < thumbnails.size(); k++) {
        const cv::Mat& image = thumbnails[k].image;
        const cv::Point corner(gap + int(k) % columns * step.width, gap + int(k) / columns * step.height);
        const cv::Point inset((cell.width - image.cols) / 2, (cell.height - image.rows) / 2);
        image.copyTo(sheet(cv::Rect(corner + inset, image.size())));
        write(sheet, thumbnails[k].caption, {corner.x, corner.y + cell.height}, cell.width);
    }
    return sheet;
}

}  // namespace brume::host
