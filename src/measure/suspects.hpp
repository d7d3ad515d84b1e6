// Where a picture is likely farthest from the truth. Pixels spread evenly miss the worst one, which may be
// the rim of one lamp; but where methods are known to be good, what differs most from the best of them is it.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace brume {

/// The pixels where two CV_32FC4 images differ most after clipping and encoding, the most first: at most
/// `count`, and one in each square of 16×16 pixels. Pixels that do not differ are none.
std::vector<cv::Point> farthestApart(const cv::Mat& a, const cv::Mat& b, size_t count);

}  // namespace brume
