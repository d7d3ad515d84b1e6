#include "frame/image_pool.hpp"

#include <sys/mman.h>

#include <algorithm>
#include <atomic>

namespace brume {
namespace {

constexpr int guardRows = 4;
constexpr uchar guardByte = 0xA5;

void fillBytes(cv::Mat image, uchar byte) {
    for (int j = 0; j < image.rows; j++) std::fill_n(image.ptr(j), image.cols * image.elemSize(), byte);
}

// A frame is thousands of small pages, which an effect that streams through three images misses half its time
// on.
void adviseLargePages(const cv::Mat& image) {
    const size_t page = 2 << 20;
    auto begin = (reinterpret_cast<size_t>(image.data) + page - 1) / page * page;
    auto end = reinterpret_cast<size_t>(image.dataend) / page * page;
    if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

// OpenCV lets go of images in code that is not instrumented, so that the thread sanitizer would take the next
// use for a race: it gets fresh memory.
#ifdef __SANITIZE_THREAD__
constexpr bool reuses = false;
#else
constexpr bool reuses = true;
#endif

// Whether the pool alone refers to it; whatever another thread did with it happened before.
bool isFree(const cv::Mat& image) {
    return image.u && std::atomic_ref(image.u->refcount).load(std::memory_order_acquire) == 1;
}

}  // namespace

cv::Mat ImagePool::allocate(cv::Size size, int type) const {
    if (!guarded_) {
        cv::Mat image(size, type);
        adviseLargePages(image);
        return image;
    }
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
    if (!reuses && !guarded_) std::erase_if(images_, isFree);
    const cv::Mat* spare = nullptr;
    for (const auto& image : images_) {
        if (!isFree(image)) continue;
        if (image.size() == size && image.type() == type) return started(image);
        if (!spare) spare = &image;
    }
    // A chain may ask for several sizes in turn, every frame; beyond a few, memory of a size no longer asked
    // for goes.
    if (spare && images_.size() >= 12) images_.erase(images_.begin() + (spare - images_.data()));
    return started(images_.emplace_back(allocate(size, type)));
}

bool ImagePool::guardsWereWhole() {
    if (!guarded_) return true;
    bool wereWhole = true;
    for (cv::Mat whole : images_) {
        const int rows = whole.rows;
        whole.adjustROI(guardRows, guardRows, 0, 0);
        for (const cv::Range& guard : {cv::Range(0, guardRows), cv::Range(guardRows + rows, whole.rows)})
            for (int j = guard.start; j < guard.end; j++) {
                const uchar *row = whole.ptr(j), *end = row + whole.cols * whole.elemSize();
                if (std::all_of(row, end, [](uchar b) { return b == guardByte; })) continue;
                wereWhole = false;
                fillBytes(whole.row(j), guardByte);
            }
    }
    return wereWhole;
}

}  // namespace brume
