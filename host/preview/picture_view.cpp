#include "preview/picture_view.hpp"

#include <algorithm>
#include <cmath>

namespace brume::preview {

void PictureView::place(cv::Rect2d area, cv::Size picture) {
    const bool isOther = picture != picture_;
    area_ = area;
    if (isOther && !isFit_) {  // the same part of a picture of another size
        centre_.x *= double(picture.width) / picture_.width;
        centre_.y *= double(picture.height) / picture_.height;
    }
    picture_ = picture;
    if (!isFit_) return;
    zoom_ = std::max(1e-3, std::min(area.width / picture.width, area.height / picture.height));
    centre_ = {picture.width / 2., picture.height / 2.};
}

void PictureView::zoomTo(double zoom, cv::Point2d at) {
    const cv::Point2d under = toPicture(at);
    zoom = std::clamp(zoom, 1. / 64, 64.);
    for (double whole = 1; whole <= 8; whole *= 2)  // round zooms are easy to meet again
        if (std::abs(zoom / whole - 1) < .02) zoom = whole;
    isFit_ = false;
    zoom_ = zoom;
    centre_ = under - (at - middle()) * (1 / zoom_);
    pan({0, 0});
}

void PictureView::pan(cv::Point2d by) {
    isFit_ = false;
    centre_ -= by * (1 / zoom_);
    centre_.x = std::clamp(centre_.x, 0., double(picture_.width));
    centre_.y = std::clamp(centre_.y, 0., double(picture_.height));
}

cv::Point2d PictureView::origin() const {
    const cv::Point2d exact = middle() - centre_ * zoom_;
    return zoom_ >= 1 ? cv::Point2d(std::round(exact.x), std::round(exact.y)) : exact;
}

}  // namespace brume::preview
