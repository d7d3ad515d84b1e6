// Runs chains on a thread of its own: the newest wish wins, slow ones run smaller first and are then refined.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "effect/runner.hpp"
#include "preview/display.hpp"

namespace brume::preview {

using Clock = std::chrono::steady_clock;

/// What to show.
struct RenderJob {
    uint64_t revision = 0;  ///< grows with every change of anything below
    Chain chain;
    std::shared_ptr<const FramePair> frame;  ///< as captured
    std::string backend = "gl";              ///< what RunnerMaker knows
    std::string image = "color";             ///< the image to show, "depth", or another that the chain makes
    bool difference = false;                 ///< run GLSL and CPU, show where they differ
    bool withCaptured = false;               ///< the frame as captured is wanted beside
    bool keepTransmittance = false;          ///< wanted besides, for the probe
    bool isHurried = false;  ///< something is being dragged: a slow chain runs smaller, refined on idling as
                             ///< far as that is quick; the rest is for a job that is not hurried
    uint64_t programs = 0;   ///< another number: plugins were loaded anew, so nothing derived may be kept
};

struct Rendered {
    RenderJob job;
    std::string error;                      ///< a sentence; empty: done
    int scale = 1;                          ///< the picture's sides were divided by this
    cv::Mat shown;                          ///< CV_8UC3 RGB
    cv::Mat captured;                       ///< CV_8UC3 RGB, whole, if asked for
    std::map<std::string, cv::Mat> images;  ///< float32, at that scale: "color", what was asked for
    cv::Mat depth;                          ///< CV_32F as effects saw it, at that scale
    std::optional<Difference> difference;   ///< without its heat, which is `shown`
    std::vector<StepTiming> timings;
    std::vector<StepPlan> decisions;
    double runMilliseconds = 0;   ///< the chain, plan and all
    double showMilliseconds = 0;  ///< making 8 bits of it
    std::string runner;           ///< what ran it
    bool isFinal = true;          ///< no finer one follows by itself
};

/// "gl", "cpu", "osmesa", "egl". Called on the renderer's thread. Throws Error.
using RunnerMaker = std::function<std::unique_ptr<Runner>(const std::string& backend)>;

/// submit and latest may be called from any thread.
class Renderer {
  public:
    /// `onNews` is called on the renderer's thread when latest() has something new.
    Renderer(RunnerMaker make, std::function<void()> onNews);
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    /// Replaces whatever waits.
    void submit(RenderJob job);
    /// The newest result that has not been taken, or null.
    std::shared_ptr<const Rendered> take();
    bool isBusy() const;

    /// A hurried job aims at this; ms.
    double budget = 60;
    /// How long nothing new must be asked for before a hurried job is refined.
    std::chrono::milliseconds idle{150};

  private:
    void work();
    std::shared_ptr<Rendered> render(const RenderJob& job, int scale);
    Runner& runnerFor(const RenderJob& job, const std::string& backend);
    const ReadyFrame& readyFor(const RenderJob& job, int scale);
    int scaleWithin(double milliseconds) const;
    int firstScale(const RenderJob& job) const;
    int nextScale(const RenderJob& job, int scale) const;
    void learn(const RenderJob& job, const Rendered& rendered, double milliseconds);
    bool waitForNewer(std::chrono::milliseconds time);

    RunnerMaker make_;
    std::function<void()> onNews_;
    mutable std::mutex mutex_;
    std::condition_variable wake_;
    std::optional<RenderJob> waiting_;
    std::shared_ptr<const Rendered> news_;
    bool stopping_ = false, isBusy_ = false;

    // The worker's own:
    std::map<std::string, std::unique_ptr<Runner>> runners_;
    uint64_t programs_ = 0;
    struct Ready {
        std::shared_ptr<const FramePair> captured;
        DepthPolicy policy;
        std::map<int, ReadyFrame> frames;  // by scale
        cv::Mat bytes;                     // of the captured colour
    } ready_;
    double fullMilliseconds_ = 0;  // what a whole picture lately took, or would take
    std::string lastRun_;          // what ran lately: a new one's first time compiles, too
    std::thread thread_;
};

/// A smaller version of a frame made ready: `scale` divides its sides; radii keep their meaning.
ReadyFrame smaller(const ReadyFrame& ready, int scale);

}  // namespace brume::preview
