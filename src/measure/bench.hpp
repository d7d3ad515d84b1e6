// How long a chain takes on a backend, as a ratio to copying the frame.
#pragma once

#include <vector>

#include "effect/runner.hpp"
#include "measure/timer.hpp"

namespace brume {

/// Eight different frames of a plane, walls and sky as a standing camera sees them; noisy colours incl. HDR.
std::vector<FramePair> benchFrames(cv::Size size);

struct BenchResult {
    Timing copy;    ///< RGBA float frame to frame, by rows, with the threads OpenCV has
    Timing chain;   ///< Runner::run, wall time: on GL with upload and read-back
    Timing passes;  ///< the sum of the steps' (GL: passes', GPU timer queries) times of each run
    std::vector<StepTiming> steps;  ///< median of each step (CPU) or pass (GPU timer queries)
    double megapixels = 0;          ///< of one frame
    double ratio() const { return chain.median() / copy.median(); }
};

/// Copy and chain take turns over the same preallocated frames; outputs rotate likewise. `chain` is planned
/// on the first frame. Frames must be of one size, their depth without NaN.
BenchResult benchChain(Runner& runner, const Chain& chain, const std::vector<FramePair>& frames,
                       int repetitions = 24, double seconds = 10);
/// The same of a chain that has been planned: every step runs, seen or not.
BenchResult benchPlanned(Runner& runner, const Chain& planned, const std::vector<FramePair>& frames,
                         int repetitions = 24, double seconds = 10);

/// What "auto" becomes on this frame; unlike planChain it leaves nothing out that cannot be seen.
Chain plannedWhole(Chain chain, const FramePair& frame, Backend backend);

/// The sum of the steps' times.
double sumOf(const std::vector<StepTiming>& timings);

/// For people who compare times: the processor and its threads, or the GL renderer.
std::string deviceName(const Runner& runner);

}  // namespace brume
