// Images in memory that two processes share: written by one, read by the other without a copy, then written
// again. Memory goes round because fresh pages cost a 1920×1080 frame more than unpacking does.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace brume {

/// The writer's end: images of 64 KiB and more lie in memory behind a file descriptor. Thread-safe.
class SharedImages final : public cv::MatAllocator {
  public:
    /// As the process's cv::Mat::setDefaultAllocator; never ends.
    static SharedImages& ofThisProcess();

    /// Whether an image can be handed over as it is.
    bool isShared(const cv::Mat& image) const;
    /// How an image is handed over. The image itself stays the caller's to release.
    struct Handed {
        int buffer = -1;  ///< its number
        int file = -1;    ///< to send along; -1 where the other side has this buffer already
    };
    /// Of an image that isShared: from now on its memory stays as it is, image or not, until takeBack.
    Handed handOver(const cv::Mat& image);
    /// The other side is done with it.
    void takeBack(int buffer);
    /// To be called once a file: gives up memory that was idle for several. The numbers of those buffers that
    /// the other side knew.
    std::vector<int> tidy();

    cv::UMatData* allocate(int dims, const int* sizes, int type, void* data, size_t* step,
                           cv::AccessFlag flags, cv::UMatUsageFlags usage) const override;
    bool allocate(cv::UMatData* memory, cv::AccessFlag, cv::UMatUsageFlags) const override {
        return memory != nullptr;
    }
    void deallocate(cv::UMatData* memory) const override;

  private:
    struct Buffer {
        void* data = nullptr;
        size_t bytes = 0;
        bool isUsed = false, isAbroad = false, isKnown = false;
        int idleFor = 0;
    };
    mutable std::mutex mutex_;
    mutable std::map<int, Buffer> buffers_;  // by file descriptor
};

/// The reader's end. Images may outlive it. Thread-safe.
class AdoptedImages {
  public:
    /// The image that lies in `buffer`; `file`, closed here, is -1 where the buffer came before. Throws Error
    /// (Io) where the buffer is unknown, holds less than that, or could still shrink.
    cv::Mat adopt(int buffer, int file, cv::Size size, int type);
    /// The writer has given it up.
    void forget(int buffer);
    /// Buffers whose images are gone since the last call.
    std::vector<int> released();

  private:
    struct Memory;
    struct Returns;
    class Allocator;
    std::map<int, std::shared_ptr<Memory>> memory_;
    std::shared_ptr<Returns> returns_ = makeReturns();
    static std::shared_ptr<Returns> makeReturns();
};

}  // namespace brume
