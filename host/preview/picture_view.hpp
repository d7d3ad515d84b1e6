// Where the picture lies in its part of the window.
#pragma once

#include <opencv2/core/types.hpp>

namespace brume::preview {

/// Window px per picture px, and which picture point is in the middle. All of it plain arithmetic.
class PictureView {
  public:
    /// Once a frame: the part of the window that the picture has, and the picture's size.
    void place(cv::Rect2d area, cv::Size picture);

    void fit() { isFit_ = true, place(area_, picture_); }
    bool isFit() const { return isFit_; }
    double zoom() const { return zoom_; }
    /// Window px a picture px, keeping the picture point under `at` (window px) where it is.
    void zoomTo(double zoom, cv::Point2d at);
    void zoomBy(double factor, cv::Point2d at) { zoomTo(zoom_ * factor, at); }
    void pan(cv::Point2d by);

    /// Picture px (whole numbers are pixels' upper left corners) of a window point and back.
    cv::Point2d toPicture(cv::Point2d window) const { return (window - origin()) * (1 / zoom_); }
    cv::Point2d toWindow(cv::Point2d picture) const { return picture * zoom_ + origin(); }
    cv::Rect2d area() const { return area_; }
    cv::Size picture() const { return picture_; }
    cv::Point2d middle() const { return {area_.x + area_.width / 2, area_.y + area_.height / 2}; }

  private:
    // The window point of the picture's upper left corner; whole at 1:1 and above, so that pixels are sharp.
    cv::Point2d origin() const;

    cv::Rect2d area_{0, 0, 1, 1};
    cv::Size picture_{1, 1};
    double zoom_ = 1;
    cv::Point2d centre_{.5, .5};  // picture px
    bool isFit_ = true;
};

}  // namespace brume::preview
