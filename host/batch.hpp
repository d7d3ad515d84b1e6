// Many frames through one chain: reading, effects and writing overlap, memory is bounded, nothing is lost.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "output_names.hpp"
#include "record.hpp"

namespace brume::host {

/// One output to make.
struct Task {
    size_t frame = 0;    ///< place in Batch::inputs
    size_t variant = 0;  ///< place in the frame's variants
    Settings settings;   ///< to apply to the chain; its making's may name earlier ones besides
    Making making;
    std::string output;
    std::string missing;  ///< FrameFiles::missing
};

struct Outcome {
    enum class State { Made, UpToDate, Failed } state = State::Made;
    std::string error;
    int status = 0;  ///< the exit status that the error asks for
    double readSeconds = 0, runSeconds = 0, writeSeconds = 0;
    std::vector<std::string> files;  ///< written
    std::vector<std::string> notes;  ///< what the reader assumed
    bool cameraIsStated = true;
    std::vector<StepPlan> decisions;  ///< for --explain
    cv::Mat thumbnail;                ///< CV_32FC4 scene-linear, of the first frames
    cv::Size size;
    std::string
        hardlyShows;  ///< of the first frame: why its picture looks like what it was made from, or empty
};

struct Batch {
    std::vector<Task> tasks;  ///< all variants of a frame stand together
    Chain chain;              ///< before any setting
    std::vector<Kept> keep;
    BackendOption backend;
    std::shared_ptr<Runner> runner;  ///< the first of that backend
    int jobs = 0;                    ///< 0: as many as there are processors
    size_t memory = 0;               ///< bytes; 0: a quarter of the machine's
    bool resume = false;
    size_t thumbnails = 0;  ///< of how many tasks
};

/// Makes every task's output and calls `done` in the tasks' order, from one thread at a time; stops early
/// when `done` returns false or `stop` becomes true, after finishing what was begun. Frames are independent
/// (the same bytes whatever `jobs` is) unless a step is PERSISTENT: then they pass in order.
void runBatch(const Batch& batch, const std::atomic<bool>& stop,
              const std::function<bool(const Task&, const Outcome&)>& done);

}  // namespace brume::host
