#include "frame/shared_image.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <opencv2/core.hpp>

#include "error.hpp"

namespace brume {

namespace {

constexpr size_t smallest = 64 << 10;
constexpr int seals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;

}  // namespace

SharedImages& SharedImages::ofThisProcess() {
    static auto* images = new SharedImages;  // outlives every image
    return *images;
}

cv::UMatData* SharedImages::allocate(int dims, const int* sizes, int type, void* data, size_t* step,
                                     cv::AccessFlag flags, cv::UMatUsageFlags usage) const {
    size_t bytes = CV_ELEM_SIZE(type);
    for (int k = dims - 1; k >= 0; --k) {
        if (step) step[k] = bytes;
        bytes *= size_t(sizes[k]);
    }
    if (data || bytes < smallest)
        return cv::Mat::getStdAllocator()->allocate(dims, sizes, type, data, step, flags, usage);
    const std::lock_guard lock(mutex_);
    Buffer* buffer = nullptr;
    int file = -1;
    for (auto& [number, idle] : buffers_)  // the warmest
        if (!idle.isUsed && !idle.isAbroad && idle.bytes == bytes &&
            (!buffer || idle.idleFor < buffer->idleFor)) {
            buffer = &idle;
            file = number;
        }
    if (!buffer) {
        file = memfd_create("brume-image", MFD_CLOEXEC | MFD_ALLOW_SEALING);
        if (file < 0 && (errno == EMFILE || errno == ENFILE)) failIo(std::strerror(errno));
        if (file < 0) throw std::bad_alloc();
        void* place = MAP_FAILED;
        if (ftruncate(file, off_t(bytes)) == 0 && fcntl(file, F_ADD_SEALS, seals) == 0)
            place = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        if (place == MAP_FAILED) {
            close(file);
            throw std::bad_alloc();
        }
        buffer = &buffers_[file];
        buffer->data = place;
        buffer->bytes = bytes;
    }
    buffer->isUsed = true;
    auto* memory = new cv::UMatData(this);
    memory->data = memory->origdata = static_cast<uchar*>(buffer->data);
    memory->size = bytes;
    memory->userdata = reinterpret_cast<void*>(intptr_t(file));
    return memory;
}

void SharedImages::deallocate(cv::UMatData* memory) const {
    if (!memory) return;
    {
        const std::lock_guard lock(mutex_);
        buffers_.at(int(reinterpret_cast<intptr_t>(memory->userdata))).isUsed = false;
    }
    delete memory;
}

bool SharedImages::isShared(const cv::Mat& image) const {
    return image.u && image.u->currAllocator == this && image.isContinuous() && image.data == image.u->data;
}

SharedImages::Handed SharedImages::handOver(const cv::Mat& image) {
    const int file = int(reinterpret_cast<intptr_t>(image.u->userdata));
    const std::lock_guard lock(mutex_);
    Buffer& buffer = buffers_.at(file);
    buffer.isAbroad = true;
    return {file, std::exchange(buffer.isKnown, true) ? -1 : file};
}

void SharedImages::takeBack(int buffer) {
    const std::lock_guard lock(mutex_);
    if (const auto found = buffers_.find(buffer); found != buffers_.end()) found->second.isAbroad = false;
}

std::vector<int> SharedImages::tidy() {
    constexpr int longEnough = 8;  // a frame takes several images of several sizes
    const std::lock_guard lock(mutex_);
    std::vector<int> known;
    for (auto it = buffers_.begin(); it != buffers_.end();) {
        auto& [file, buffer] = *it;
        buffer.idleFor = buffer.isUsed || buffer.isAbroad ? 0 : buffer.idleFor + 1;
        if (buffer.idleFor <= longEnough) {
            ++it;
            continue;
        }
        munmap(buffer.data, buffer.bytes);
        close(file);
        if (buffer.isKnown) known.push_back(file);
        it = buffers_.erase(it);
    }
    return known;
}

struct AdoptedImages::Memory {
    void* data = nullptr;
    size_t bytes = 0;

    Memory(int file, int buffer) {
        struct stat status {};
        const bool isSound =
            fstat(file, &status) == 0 && status.st_size > 0 && (fcntl(file, F_GET_SEALS) & F_SEAL_SHRINK);
        bytes = isSound ? size_t(status.st_size) : 0;
        data = isSound ? mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, file, 0)
                       : MAP_FAILED;
        close(file);
        if (!isSound) failIo("the reader's process handed over buffer ", buffer, ", which is no memory");
        if (data == MAP_FAILED) throw std::bad_alloc();
    }
    ~Memory() { munmap(data, bytes); }
    Memory(const Memory&) = delete;
    Memory& operator=(const Memory&) = delete;
};

struct AdoptedImages::Returns {
    std::mutex mutex;
    std::vector<int> buffers;
};

class AdoptedImages::Allocator final : public cv::MatAllocator {
  public:
    struct Owner {
        std::shared_ptr<Memory> memory;
        std::shared_ptr<Returns> returns;
        int buffer;
    };
    static const Allocator& only() {
        static const auto* allocator = new Allocator;  // outlives every image
        return *allocator;
    }
    cv::UMatData* allocate(int dims, const int* sizes, int type, void* data, size_t* step,
                           cv::AccessFlag flags, cv::UMatUsageFlags usage) const override {
        return cv::Mat::getStdAllocator()->allocate(dims, sizes, type, data, step, flags, usage);
    }
    bool allocate(cv::UMatData* memory, cv::AccessFlag, cv::UMatUsageFlags) const override {
        return memory != nullptr;
    }
    void deallocate(cv::UMatData* memory) const override {
        if (!memory) return;
        const std::unique_ptr<Owner> owner(static_cast<Owner*>(memory->userdata));
        delete memory;
        const std::lock_guard lock(owner->returns->mutex);
        owner->returns->buffers.push_back(owner->buffer);
    }
};

std::shared_ptr<AdoptedImages::Returns> AdoptedImages::makeReturns() { return std::make_shared<Returns>(); }

cv::Mat AdoptedImages::adopt(int buffer, int file, cv::Size size, int type) {
    if (file >= 0) memory_[buffer] = std::make_shared<Memory>(file, buffer);
    const auto found = memory_.find(buffer);
    const uint64_t pixels = uint64_t(std::max(size.width, 0)) * uint64_t(std::max(size.height, 0));
    if (found == memory_.end() || pixels == 0 || CV_MAT_CN(type) > 4 || type != CV_MAT_TYPE(type) ||
        pixels > found->second->bytes / CV_ELEM_SIZE(type))
        failIo("the reader's process handed over an image that is not there");
    auto* memory = new cv::UMatData(&Allocator::only());
    memory->data = memory->origdata = static_cast<uchar*>(found->second->data);
    memory->size = found->second->bytes;
    memory->userdata = new Allocator::Owner{found->second, returns_, buffer};
    cv::Mat image(size, type, memory->data);
    image.u = memory;
    image.addref();
    return image;
}

void AdoptedImages::forget(int buffer) { memory_.erase(buffer); }

std::vector<int> AdoptedImages::released() {
    const std::lock_guard lock(returns_->mutex);
    return std::exchange(returns_->buffers, {});
}

}  // namespace brume
