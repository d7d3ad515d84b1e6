#include "cpu/image_pool.hpp"

#include <algorithm>

namespace brume {
namespace {

constexpr int guardRows = 4;
constexpr uchar guardByte = 0xA5;

void fillBytes(cv::Mat image, uchar byte) {
    for (int j = 0; j < image.rows; j++) std::fill_n(image.ptr(j), image.cols * image.elemSize(), byte);
}

}  // namespace

cv::Mat ImagePool::allocate(cv::Size size, int type) const {
    if (!guarded_) return cv::Mat(size, type);
    cv::Mat whole(size.height + 2 * guardRows, size.width, type);
    fillBytes(whole, guardByte);
    return whole.rowRange(guardRows, guardRows + size.height);
}

cv::Mat ImagePool::take(cv::Size size, int type) {
    const uchar nanByte = 0xFF;
    auto started = [&](const cv::Mat& image) {
        if (guarded_) fillBytes(image, nanByte);
        return image;
    };
    const cv::Mat* spare = nullptr;
    for (const auto& image : images_) {
        bool isFree = image.u && image.u->refcount == 1;
        if (isFree && image.size() == size && image.type() == type) return started(image);
        if (isFree && !spare) spare = &image;
    }
    // A chain may ask for several sizes in turn, every frame; beyond a few, memory of a size no longer asked
    // for goes.
    if (spare && images_.size() >= 12) images_.erase(images_.begin() + (spare - images_.data()));
    return started(images_.emplace_back(allocate(size, type)));
}

bool ImagePool::guardsAreWhole() const {
    if (!guarded_) return true;
    for (cv::Mat whole : images_) {
        int rows = whole.rows;
        whole.adjustROI(guardRows, guardRows, 0, 0);
        for (int j = 0; j < whole.rows; j++) {
            if (j == guardRows) j += rows;
            const uchar* row = whole.ptr(j);
            if (std::any_of(row, row + whole.cols * whole.elemSize(), [](uchar b) { return b != guardByte; }))
                return false;
        }
    }
    return true;
}

}  // namespace brume
