#include "cpu/image_pool.hpp"

namespace brume {

cv::Mat ImagePool::take(cv::Size size, int type) {
    const cv::Mat* spare = nullptr;
    for (const auto& image : images_) {
        bool isFree = image.u && image.u->refcount == 1;
        if (isFree && image.size() == size && image.type() == type) return image;
        if (isFree && !spare) spare = &image;
    }
    // Memory of a size no longer asked for goes first.
    if (spare) images_.erase(images_.begin() + (spare - images_.data()));
    return images_.emplace_back(size, type);
}

}  // namespace brume
