#include "preview/frame_loader.hpp"

#include <filesystem>
#include <opencv2/imgproc.hpp>

#include "error.hpp"
#include "frame/inspect_evidence.hpp"

namespace brume::preview {

static constexpr size_t cacheBytes = size_t(512) << 20;

std::shared_ptr<const LoadedFrame> loadFrame(const FrameFiles& files, size_t index,
                                             const ReadOptions& options, double framesPerSecond) {
    ReadOptions withFiles = options;
    if (!files.depth.empty()) withFiles.depth = files.depth;
    auto loaded = std::make_shared<LoadedFrame>();
    loaded->index = index;
    loaded->capture = readCapture(files.color, withFiles);
    const Capture& capture = loaded->capture;
    loaded->isStated = capture.stated.has_value();
    if (capture.stated) {
        loaded->encoding = *capture.stated;
    } else if (capture.habit) {
        loaded->encoding = *capture.habit;
    } else {
        const std::vector<Reading> readings = rankReadings(capture);
        if (readings.empty()) failIo(capture.depthPath, ": holds no number above 0");
        loaded->encoding = readings.front().encoding;
        loaded->assumed = readings.front().name;
    }
    loaded->frame = decodeCapture(capture, loaded->encoding);
    loaded->frame.index = int(index);
    if (files.time) loaded->frame.time = *files.time;
    if (loaded->frame.time == 0 && !files.time) loaded->frame.time = double(index) / framesPerSecond;
    return loaded;
}

const char* roleOf(const std::string& file, const Capture& capture) {
    if (file == capture.frame.files[0]) return file == capture.depthPath ? "file" : "picture";
    if (file == capture.depthPath) return "depth file";
    return std::filesystem::path(file).extension() == ".json" ? "sidecar" : "light map";
}

std::shared_ptr<const Inspection> inspectFrame(const LoadedFrame& frame) {
    auto result = std::make_shared<Inspection>();
    result->index = frame.index;
    result->sequence = frame.sequence;
    result->statistics = depthStatistics(frame.frame.depth);
    result->doubts = findDoubts(frame.capture, frame.encoding);
    if (frame.isStated) return result;
    result->readings = rankReadings(frame.capture);
    for (const Reading& reading : result->readings) {
        const cv::Mat depth = thinnedReading(frame.capture, reading.encoding).depth;
        cv::Mat thumbnail;
        cv::resize(depthColors(depth), thumbnail, {168, std::max(1, 168 * depth.rows / depth.cols)}, 0, 0,
                   cv::INTER_NEAREST);
        result->thumbnails.push_back(thumbnail);
    }
    return result;
}

FrameLoader::FrameLoader(std::function<void()> onNews)
    : onNews_(std::move(onNews)), thread_([this] { work(); }) {}

FrameLoader::~FrameLoader() {
    {
        std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    wake_.notify_one();
    thread_.join();
}

void FrameLoader::open(std::vector<FrameFiles> files, const ReadOptions& options, double framesPerSecond) {
    std::lock_guard lock(mutex_);
    sequence_ = {std::move(files), options, framesPerSecond, sequence_.number + 1};
    wanted_.reset();
    next_.reset();
    cache_.clear();
    inspection_.reset();
    failed_.reset();
}

void FrameLoader::want(size_t index, bool inspect, std::optional<size_t> next) {
    {
        std::lock_guard lock(mutex_);
        if (wanted_ != index) failed_.reset();
        wanted_ = index;
        next_ = next;
        mayInspect_ = inspect;
    }
    wake_.notify_one();
}

std::shared_ptr<const LoadedFrame> FrameLoader::cached(size_t index) const {
    for (const auto& frame : cache_)
        if (frame->index == index) return frame;
    return nullptr;
}

std::shared_ptr<const LoadedFrame> FrameLoader::frame() const {
    std::lock_guard lock(mutex_);
    return wanted_ ? cached(*wanted_) : nullptr;
}

std::shared_ptr<const Inspection> FrameLoader::inspection() const {
    std::lock_guard lock(mutex_);
    return inspection_ && wanted_ == inspection_->index ? inspection_ : nullptr;
}

std::string FrameLoader::error() const {
    std::lock_guard lock(mutex_);
    return failed_ && failed_ == wanted_ ? error_ : "";
}

void FrameLoader::work() {
    std::unique_lock lock(mutex_);
    while (!stopping_) {
        const bool isMissing = wanted_ && failed_ != wanted_ && !cached(*wanted_);
        const bool isAhead = !isMissing && next_ && !cached(*next_);
        const bool isUnknown =
            wanted_ && mayInspect_ && cached(*wanted_) &&
            (!inspection_ || inspection_->index != *wanted_ || inspection_->sequence != sequence_.number);
        if (isMissing) {
            load(lock, *wanted_, true);
        } else if (isAhead) {
            const size_t index = *next_;
            next_.reset();
            load(lock, index, false);
        } else if (isUnknown) {
            inspect(lock, cached(*wanted_));
        } else {
            wake_.wait(lock);
        }
    }
}

void FrameLoader::load(std::unique_lock<std::mutex>& lock, size_t index, bool isWanted) {
    if (index >= sequence_.files.size()) {
        wanted_.reset();
        return;
    }
    const FrameFiles files = sequence_.files[index];
    const ReadOptions options = sequence_.options;
    const double framesPerSecond = sequence_.framesPerSecond;
    const uint64_t number = sequence_.number;
    lock.unlock();
    std::shared_ptr<const LoadedFrame> loaded;
    std::string error;
    try {
        auto made = std::const_pointer_cast<LoadedFrame>(loadFrame(files, index, options, framesPerSecond));
        made->sequence = number;
        loaded = made;
    } catch (const std::exception& e) {
        error = e.what();
    }
    lock.lock();
    if (number != sequence_.number) return;
    if (loaded) {
        cache_.push_front(loaded);
        size_t bytes = 0, kept = 0;
        for (auto at = cache_.begin(); at != cache_.end();) {
            bytes += (*at)->frame.color.total() * 24;
            at = bytes > cacheBytes && ++kept > 2 ? cache_.erase(at) : std::next(at);
        }
    } else if (isWanted) {
        failed_ = index;
        error_ = error;
    }
    lock.unlock();
    onNews_();
    lock.lock();
}

void FrameLoader::inspect(std::unique_lock<std::mutex>& lock, std::shared_ptr<const LoadedFrame> frame) {
    lock.unlock();
    std::shared_ptr<const Inspection> inspection;
    try {
        inspection = inspectFrame(*frame);
    } catch (const std::exception& e) {
        auto failed = std::make_shared<Inspection>();
        failed->index = frame->index;
        failed->sequence = frame->sequence;
        failed->doubts = {{"inspection", e.what()}};
        inspection = failed;
    }
    lock.lock();
    if (frame->sequence == sequence_.number) inspection_ = inspection;
    lock.unlock();
    onNews_();
    lock.lock();
}

}  // namespace brume::preview
