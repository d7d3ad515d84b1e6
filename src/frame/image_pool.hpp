// Image memory that is used again once nobody holds it: fresh pages cost more than a fog does.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace brume {

class ImagePool {
  public:
    /// With guards every image starts as NaN and has rows above and below that nobody may write.
    explicit ImagePool(bool guarded = false) : guarded_(guarded) {}

    /// An image of that size and type, contents undefined, that no one else refers to.
    cv::Mat take(cv::Size size, int type);
    /// False if anybody wrote a guard row since the last call, and mends it, so that the next one to be
    /// blamed is the next to do so. Always true without guards.
    bool guardsWereWhole();

  private:
    cv::Mat allocate(cv::Size size, int type) const;

    bool guarded_;
    std::vector<cv::Mat> images_;
};

}  // namespace brume
