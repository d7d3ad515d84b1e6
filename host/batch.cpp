#include "batch.hpp"

#include <tbb/collaborative_call_once.h>
#include <tbb/global_control.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "apply/apply.hpp"
#include "cpu/cpu_runner.hpp"
#include "error.hpp"
#include "frame/attributes.hpp"
#include "frame/sequence.hpp"
#include "frame/write.hpp"
#include "measure/encoded_error.hpp"
#include "memory.hpp"

namespace brume::host {
namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

// A captured frame that several variants share; read by whoever comes first.
struct SharedFrame {
    tbb::collaborative_once_flag once;
    FramePair captured;
    ReadyFrame ready;
    nlohmann::ordered_json files;
    std::string error;
    int status = 0;
    double seconds = 0;
};

// What passes through the pipeline.
struct Token {
    std::mutex mutex;
    const Task* task = nullptr;
    std::shared_ptr<SharedFrame> frame;
    size_t bytes = 0;
    bool wantsThumbnail = false;
    RunResult result;
    Outcome outcome;
    bool isOpen() const { return outcome.status == 0 && outcome.state == Outcome::State::Made; }
    void fail(const std::string& error, int status) {
        outcome.state = Outcome::State::Failed;
        outcome.error = error;
        outcome.status = status;
    }
};

template <class F>
void guarded(Token& token, F work) {
    if (!token.isOpen()) return;
    try {
        work();
    } catch (const Error& e) {
        token.fail(e.what(), int(e.kind()));
    } catch (const std::bad_alloc&) {
        token.fail(text("'", token.task->making.input, "': not enough memory"), int(ErrorKind::Io));
    } catch (const std::exception& e) {
        token.fail(text("'", token.task->making.input, "': ", e.what()), int(ErrorKind::Io));
    }
}

// Lets in as many bytes as there are; a single larger frame passes alone.
class MemoryGate {
  public:
    explicit MemoryGate(size_t budget) : budget_(budget) {}
    void enter(size_t bytes) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return used_ == 0 || used_ + bytes <= budget_; });
        used_ += bytes;
    }
    void leave(size_t bytes) {
        std::lock_guard lock(mutex_);
        used_ -= bytes;
        changed_.notify_all();
    }

  private:
    size_t budget_, used_ = 0;
    std::mutex mutex_;
    std::condition_variable changed_;
};

// Where so many pixels change by less, in 8-bit steps and of the picture's middle level, nobody will see it
// without looking for it. (Judged by eye: of fog 28 of 170 hardly shows in a bright room, 26 of 40 does at
// night; a blur of radius 1 shows, by 17 to 50 at its hundredth pixel, one of .5, by 6 to 18, hardly does.)
struct Seen {
    double pixels, change;
    const char* words;
};
constexpr Seen seenFog = {.9, 32, "nine pixels in ten"}, seenAtEdges = {.99, 16, "99 pixels in 100"};
constexpr double seenShare = .25;

bool has(const Chain& chain, bool isFog) {
    return std::any_of(chain.steps.begin(), chain.steps.end(), [&](const Step& step) {
        return step.enabled && step.effect->header.writesTransmittance == isFog;
    });
}

// A fog for a street is nothing in a room: said once, before somebody looks for what went wrong.
std::string hardlyShows(const Chain& chain, const FramePair& frame, const cv::Mat& color) {
    if (color.size() != frame.color.size()) return {};
    std::vector<double> changes, levels, depths;
    for (const cv::Point& p : sampleGrid(color.size(), 10000).pixels) {
        changes.push_back(encodedDifference(color.at<cv::Vec4f>(p), frame.color.at<cv::Vec4f>(p)));
        levels.push_back(encodedDifference(frame.color.at<cv::Vec4f>(p), {0, 0, 0, 0}));
        if (const float z = frame.depth.at<float>(p); std::isfinite(z)) depths.push_back(double(z));
    }
    // Fog covers a picture; what else there is, such as a blur or a glow, changes edges and what is around
    // lamps.
    const Seen seen = has(chain, false) ? seenAtEdges : seenFog;
    const double change = percentileOf(changes, seen.pixels), middle = percentileOf(levels, .5);
    if (!(change < std::min(seen.change, std::max(1., seenShare * middle)))) return {};
    const std::string what =
        text(seen.words, " change by less than ", std::floor(change) + 1, " of 255 steps");
    if (depths.empty() || !has(chain, true)) return what;
    char range[120];
    std::snprintf(range, sizeof range,
                  "; its surfaces lie at %.2g to %.2g m, and fog for such distances shows more",
                  percentileOf(depths, .05), percentileOf(depths, .95));
    return what + range;
}

class Run {
  public:
    Run(const Batch& batch, const std::atomic<bool>& stop,
        const std::function<bool(const Task&, const Outcome&)>& done)
        : batch_(batch), stop_(stop), done_(done), gate_(batch.memory ? batch.memory : machineMemory() / 4) {
        for (const Step& step : batch.chain.steps)
            for (const Pass& pass : step.effect->header.passes)
                isPersistent_ |= pass.persistent && step.enabled;
        isParallel_ = !isPersistent_ && batch.runner->backend() == Backend::Cpu;
        jobs_ = batch.jobs > 0 ? batch.jobs : tbb::this_task_arena::max_concurrency();
        for (const Kept& kept : batch.keep)
            if (kept.image != "depth") images_.push_back(kept.image);
        free_.push_back(batch.runner);
    }

    void run() {
        using tbb::filter_mode;
        tbb::global_control limit(tbb::global_control::max_allowed_parallelism, size_t(std::max(jobs_, 2)));
        // Frames side by side need no threads within a frame.
        int threadsBefore = cv::getNumThreads();
        bool isSideBySide = isParallel_ && jobs_ > 1 && batch_.tasks.size() >= size_t(2 * jobs_);
        if (isSideBySide || jobs_ == 1) cv::setNumThreads(1);
        filter_mode runMode = isParallel_     ? filter_mode::parallel
                              : isPersistent_ ? filter_mode::serial_in_order
                                              : filter_mode::serial_out_of_order;
        tbb::task_arena arena(jobs_);
        arena.execute([&] {
            // Finished frames wait for their turn to be reported, so there are more of them than workers.
            tbb::parallel_pipeline(
                jobs_ == 1 ? 1 : size_t(2 * jobs_),
                tbb::make_filter<void, Token*>(filter_mode::serial_in_order, [this](tbb::flow_control& flow) {
                    const std::lock_guard turn(nextTurn_);
                    return next(flow);
                }) & tbb::make_filter<Token*, Token*>(filter_mode::parallel, [this](Token* t) {
                    const std::lock_guard held(t->mutex);
                    return read(t);
                }) & tbb::make_filter<Token*, Token*>(runMode, [this](Token* t) {
                    const std::lock_guard held(t->mutex);
                    std::unique_lock turn(applyTurn_, std::defer_lock);
                    if (!isParallel_) turn.lock();
                    return apply(t);
                }) & tbb::make_filter<Token*, Token*>(filter_mode::parallel, [this](Token* t) {
                    const std::lock_guard held(t->mutex);
                    return write(t);
                }) & tbb::make_filter<Token*, void>(filter_mode::serial_in_order, [this](Token* t) {
                    const std::lock_guard turn(finishTurn_);
                    finish(t);
                }));
        });
        cv::setNumThreads(threadsBefore);
        const std::scoped_lock all(nextTurn_, applyTurn_, finishTurn_, runnersMutex_);
    }

  private:
    Token* next(tbb::flow_control& flow) {
        if (stop_ || isEnough_ || at_ == batch_.tasks.size()) {
            flow.stop();
            return nullptr;
        }
        const Task& task = batch_.tasks[at_];
        if (at_ == 0 || batch_.tasks[at_ - 1].frame != task.frame) {
            current_ = std::make_shared<SharedFrame>();
            currentBytes_ = bytesNeeded(task.making.input);
        }
        at_++;
        auto token = new Token;
        const std::lock_guard held(token->mutex);
        token->task = &task;
        token->wantsThumbnail = at_ <= batch_.thumbnails;
        token->frame = current_;
        if (currentBytes_ > machineMemory())
            token->fail(text("'", task.making.input, "': needs ", currentBytes_ >> 30,
                             " GiB of memory, more than this machine has"),
                        int(ErrorKind::Io));
        else
            token->bytes = currentBytes_;
        gate_.enter(token->bytes);
        return token;
    }

    // Colour as stored and decoded, depth twice, the outputs, and one of them encoded: an upper estimate.
    size_t bytesNeeded(const std::string& input) const {
        std::error_code none;
        cv::Size size;
        try {
            size = declaredSize(input);
        } catch (const Error&) {  // reading will say it
        }
        size_t pixels = size_t(size.width) * size_t(size.height);
        if (!pixels) {  // no reason to refuse it: reading may have a better one
            const bool isFile = std::filesystem::is_regular_file(input, none);
            const uintmax_t bytes = isFile ? std::filesystem::file_size(input, none) : 0;
            return size_t(std::min<uintmax_t>(bytes, machineMemory() / 24) * 24);
        }
        return pixels * (16 + 16 + 8 + 16 * (1 + batch_.keep.size()) + 12);
    }

    Token* read(Token* token) {
        guarded(*token, [&] {
            if (batch_.resume && isUpToDate(*token)) return;
            SharedFrame& frame = *token->frame;
            const Making& making = token->task->making;
            tbb::collaborative_call_once(frame.once, [&] {
                auto start = Clock::now();
                try {
                    frame.captured = readFrame(
                        FrameFiles{making.input, making.frame.depth, making.time, token->task->missing},
                        int(making.index), making.frame.read());
                    frame.captured.seed = making.seed;
                    if (frame.captured.time == 0 && !making.time)
                        frame.captured.time = double(making.index) / making.framesPerSecond;
                    frame.files = describeFiles(frame.captured.files);
                    frame.ready = resolveDepth(frame.captured, batch_.chain.policy);
                } catch (const Error& e) {
                    frame.error = e.what();
                    frame.status = int(e.kind());
                } catch (const std::exception& e) {
                    frame.error = text("'", making.input, "': ", e.what());
                    frame.status = int(ErrorKind::Io);
                }
                frame.seconds = secondsSince(start);
            });
            token->outcome.readSeconds = frame.seconds;
            token->outcome.notes = frame.captured.notes;
            token->outcome.cameraIsStated = frame.captured.cameraIsStated;
            token->outcome.size = frame.captured.size();
            if (frame.status) token->fail(frame.error, frame.status);
        });
        return token;
    }

    bool isUpToDate(Token& token) const {
        const Task& task = *token.task;
        std::error_code none;
        if (!std::filesystem::exists(task.output, none) || !canHoldAttributes(task.output)) return false;
        auto record = readRecord(task.output);
        std::string why = record ? staleness(*record, task.making) : "does not say how it was made";
        if (!why.empty())
            failIo("--resume: '", task.output, "' exists, but ", why, "; remove it or write elsewhere");
        for (const Kept& kept : batch_.keep) {
            const std::string path = OutputNames::keptBeside(task.output, kept);
            if (!std::filesystem::exists(path, none) || !wasKeptBeside(*record, path)) return false;
        }
        token.outcome.state = Outcome::State::UpToDate;
        return true;
    }

    std::shared_ptr<Runner> takeRunner(size_t variant) {
        if (isPersistent_) {  // each variant has a history of its own
            if (variant >= byVariant_.size()) byVariant_.resize(variant + 1);
            if (!byVariant_[variant])
                byVariant_[variant] = variant == 0 ? batch_.runner : batch_.backend.makeRunner(batch_.chain);
            return byVariant_[variant];
        }
        if (!isParallel_) return batch_.runner;
        std::lock_guard lock(runnersMutex_);
        if (free_.empty()) return makeCpuRunner();
        auto runner = free_.back();
        free_.pop_back();
        return runner;
    }

    void giveBack(const std::shared_ptr<Runner>& runner) {
        if (!isParallel_) return;
        std::lock_guard lock(runnersMutex_);
        free_.push_back(runner);
    }

    Token* apply(Token* token) {
        guarded(*token, [&] {
            auto start = Clock::now();
            const Task& task = *token->task;
            auto runner = takeRunner(task.variant);
            Chain chain = withSettings(batch_.chain, task.settings);
            // A worker that waits inside must not pick up another frame: it would need this runner.
            tbb::this_task_arena::isolate([&] {
                token->result =
                    applyChain(*runner, chain, token->frame->ready, images_, &token->outcome.decisions);
            });
            giveBack(runner);
            token->outcome.runSeconds = secondsSince(start);
        });
        return token;
    }

    Token* write(Token* token) {
        guarded(*token, [&] {
            auto start = Clock::now();
            const Task& task = *token->task;
            WriteOptions options;
            options.frameIndex = int(task.making.index);
            options.seed = task.making.seed;
            std::vector<std::string> keptFiles;
            for (const Kept& kept : batch_.keep)
                keptFiles.push_back(OutputNames::keptBeside(task.output, kept));
            std::vector<std::string> outputs = keptFiles;
            outputs.push_back(task.output);
            for (const std::string& output : outputs) requireNotRead(output, token->frame->captured.files);
            options.attributes[recordKey] = writeRecord(task.making, token->frame->files, keptFiles);
            std::filesystem::path folder = std::filesystem::path(task.output).parent_path();
            std::error_code error;
            if (!folder.empty()) std::filesystem::create_directories(folder, error);
            if (error) failIo("'", folder.string(), "' cannot be made: ", error.message());
            // The picture comes last: where it is, everything beside it is.
            WriteOptions data = options;
            data.isData = true;
            for (size_t k = 0; k < keptFiles.size(); k++) {
                const std::string& image = batch_.keep[k].image;
                writeImage(
                    keptFiles[k],
                    image == "depth" ? token->frame->ready.frame.depth : token->result.images.at(image),
                    data);
                token->outcome.files.push_back(keptFiles[k]);
            }
            const cv::Mat& color = token->result.images.at("color");
            if (task.frame == 0)
                token->outcome.hardlyShows = hardlyShows(batch_.chain, token->frame->ready.frame, color);
            if (task.making.withDepth) {
                FramePair fogged = token->frame->captured;
                if (color.size() != fogged.size())
                    failUsage(task.output, ": --with-depth: the picture's size is not the depth's");
                fogged.color = color;
                writeFrame(task.output, fogged, options);
            } else {
                writeImage(task.output, color, options);
            }
            token->outcome.files.push_back(task.output);
            if (token->wantsThumbnail) {
                double scale = std::min(1., 480. / color.cols);
                cv::Size size(std::max(1, int(color.cols * scale)), std::max(1, int(color.rows * scale)));
                cv::resize(color, token->outcome.thumbnail, size, 0, 0, cv::INTER_AREA);
            }
            token->outcome.writeSeconds = secondsSince(start);
        });
        token->result = {};
        token->frame.reset();
        return token;
    }

    void finish(Token* raw) {
        raw->mutex.lock();
        raw->mutex.unlock();
        std::unique_ptr<Token> token(raw);
        gate_.leave(token->bytes);
        if (!done_(*token->task, token->outcome)) isEnough_ = true;
    }

    // TBB orders what happens to a token, and the turns of a serial stage. These, and each token's, are
    // locked for that time and never waited for: they say so to the thread sanitizer, which does not see into
    // TBB.
    std::mutex nextTurn_, applyTurn_, finishTurn_;
    const Batch& batch_;
    const std::atomic<bool>& stop_;
    const std::function<bool(const Task&, const Outcome&)>& done_;
    MemoryGate gate_;
    bool isPersistent_ = false, isParallel_ = false;
    int jobs_ = 1;
    std::vector<std::string> images_;
    size_t at_ = 0, currentBytes_ = 0;
    std::shared_ptr<SharedFrame> current_;
    std::atomic<bool> isEnough_ = false;
    std::mutex runnersMutex_;
    std::vector<std::shared_ptr<Runner>> free_, byVariant_;
};

}  // namespace

void runBatch(const Batch& batch, const std::atomic<bool>& stop,
              const std::function<bool(const Task&, const Outcome&)>& done) {
    Run(batch, stop, done).run();
}

}  // namespace brume::host
