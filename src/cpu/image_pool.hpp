// Image memory that is used again once nobody holds it: fresh pages cost more than a fog does.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace brume {

class ImagePool {
  public:
    /// An image of that size and type, contents undefined, that no one else refers to.
    cv::Mat take(cv::Size size, int type);

  private:
    std::vector<cv::Mat> images_;
};

}  // namespace brume
