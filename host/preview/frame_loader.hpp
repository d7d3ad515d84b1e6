// Reads frames on a thread of its own, keeps the last few, and looks into what they are.
#pragma once

#include <condition_variable>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "frame/capture.hpp"
#include "frame/inspect.hpp"
#include "frame/sequence.hpp"

namespace brume::preview {

/// One frame of the sequence, read. Never changed once made.
struct LoadedFrame {
    size_t index = 0;
    Capture capture;
    FramePair frame;         ///< as the chain gets it
    DepthEncoding encoding;  ///< what its depth was read as
    std::string assumed;     ///< the reading's name where nothing states it and the file has no habit
    bool isStated = false;   ///< the capture says what its depth means
    uint64_t sequence = 0;   ///< of FrameLoader::open
};

/// What `brume inspect` says of it.
struct Inspection {
    size_t index = 0;
    uint64_t sequence = 0;
    DepthStatistics statistics;
    std::vector<Doubt> doubts;
    std::vector<Reading> readings;    ///< where the encoding is not stated, likeliest first
    std::vector<cv::Mat> thumbnails;  ///< CV_8UC3 RGB, one a reading
};

/// Safe to call from one thread; works on another.
class FrameLoader {
  public:
    /// `onNews` is called on the loader's thread when something is ready.
    explicit FrameLoader(std::function<void()> onNews);
    ~FrameLoader();
    FrameLoader(const FrameLoader&) = delete;
    FrameLoader& operator=(const FrameLoader&) = delete;

    /// A new sequence: what was read before is forgotten.
    void open(std::vector<FrameFiles> files, const ReadOptions& options, double framesPerSecond);
    /// Ask for a frame; an older wish that has not begun is dropped. `inspect`: look into it as well, once
    /// it is there and nothing else is wanted. `next` is read ahead.
    void want(size_t index, bool inspect, std::optional<size_t> next = {});

    /// The wanted frame, or null while it is being read or if it could not be.
    std::shared_ptr<const LoadedFrame> frame() const;
    std::shared_ptr<const Inspection> inspection() const;
    /// Why the wanted frame could not be read; empty: it could, or is not there yet.
    std::string error() const;

  private:
    struct Sequence {
        std::vector<FrameFiles> files;
        ReadOptions options;
        double framesPerSecond = 24;
        uint64_t number = 0;
    };
    void work();
    std::shared_ptr<const LoadedFrame> cached(size_t index) const;
    void load(std::unique_lock<std::mutex>& lock, size_t index, bool isWanted);
    void inspect(std::unique_lock<std::mutex>& lock, std::shared_ptr<const LoadedFrame> frame);

    std::function<void()> onNews_;
    mutable std::mutex mutex_;
    std::condition_variable wake_;
    Sequence sequence_;
    std::optional<size_t> wanted_, next_;
    bool mayInspect_ = false, stopping_ = false;
    std::list<std::shared_ptr<const LoadedFrame>> cache_;  // newest first
    std::shared_ptr<const Inspection> inspection_;
    std::optional<size_t> failed_;
    std::string error_;
    std::thread thread_;
};

/// What a file of a frame is: "picture", "depth file", "sidecar", "light map", or "file", which is picture
/// and depth.
const char* roleOf(const std::string& file, const Capture& capture);

/// Reads one frame as `brume apply` would; integers of unstated meaning by the likeliest reading. Throws
/// Error (Io).
std::shared_ptr<const LoadedFrame> loadFrame(const FrameFiles& files, size_t index,
                                             const ReadOptions& options, double framesPerSecond);
std::shared_ptr<const Inspection> inspectFrame(const LoadedFrame& frame);

}  // namespace brume::preview
