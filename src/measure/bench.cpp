#include "measure/bench.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "apply/apply.hpp"
#include "error.hpp"

namespace brume {
namespace {

void copyByRows(const cv::Mat& from, cv::Mat to) {
    cv::parallel_for_({0, from.rows}, [&](cv::Range rows) {
        for (int j = rows.start; j < rows.end; j++)
            std::memcpy(to.ptr(j), from.ptr(j), size_t(from.cols) * from.elemSize());
    });
}

FramePair benchFrame(cv::Size size, int index) {
    FramePair frame;
    frame.name = "bench" + std::to_string(index);
    frame.index = index;
    frame.time = index / 24.;
    frame.camera = Camera::withHorizontalView(size, 75);
    frame.color.create(size, CV_32FC4);
    frame.depth.create(size, CV_32F);
    cv::RNG random(index + 1);
    for (int j = 0; j < size.height; j++)
        for (int i = 0; i < size.width; i++) {
            double up = frame.camera.ray(i, j)[1];
            float depth = up < 0 ? float(1.6 / -up) : std::numeric_limits<float>::infinity();
            // Blocks of different heights, 4 to 260 m away.
            int block = (i * 24 / size.width + index) % 24;
            float wall = 4.0f + float(block * 79 % 24) / 24 * 256, top = 2.0f + float(block * 53 % 24);
            if (wall < depth && 1.6f + wall * float(up) < top) depth = wall;
            float grain = random.uniform(.9f, 1.1f),
                  base = std::isinf(depth) ? .8f : .1f + .02f * float(block);
            bool isLamp = (i / 4 + j / 4 * 131 + index) % 997 == 0;
            cv::Vec3f color = cv::Vec3f(base, base * 1.1f, base * 1.3f) * grain * (isLamp ? 40.0f : 1.0f);
            frame.color.at<cv::Vec4f>(j, i) = {color[0], color[1], color[2], 1};
            frame.depth.at<float>(j, i) = depth;
        }
    return frame;
}

}  // namespace

std::vector<FramePair> benchFrames(cv::Size size) {
    std::vector<FramePair> frames(8);
    cv::parallel_for_({0, int(frames.size())}, [&](cv::Range range) {
        for (int k = range.start; k < range.end; k++) frames[k] = benchFrame(size, k);
    });
    return frames;
}

BenchResult benchChain(Runner& runner, const Chain& chain, const std::vector<FramePair>& frames,
                       int repetitions, double seconds) {
    return benchPlanned(runner, planChain(chain, frames[0], runner.backend(), {}), frames, repetitions,
                        seconds);
}

BenchResult benchPlanned(Runner& runner, const Chain& planned, const std::vector<FramePair>& frames,
                         int repetitions, double seconds) {
    std::vector<cv::Mat> copies(frames.size());
    std::vector<RunResult> results(frames.size());
    std::vector<Timing> steps;
    Timing passes{"passes", {}};
    bool isMeasuring = false;
    auto copy = [&](int slot) { copyByRows(frames[slot].color, copies[slot]); };
    auto run = [&](int slot) {
        results[slot] = {};  // its memory is what the runner writes next, so that outputs rotate
        results[slot] = runner.run(planned, frames[slot], {});
        if (!isMeasuring) return;
        double sum = 0;
        for (size_t k = 0; k < results[slot].timings.size(); k++) {
            if (k >= steps.size()) steps.resize(k + 1);
            steps[k].name = results[slot].timings[k].name;
            steps[k].milliseconds.push_back(results[slot].timings[k].milliseconds);
            sum += results[slot].timings[k].milliseconds;
        }
        passes.milliseconds.push_back(sum);
    };
    // All memory is touched, and every shader compiled, before the clock starts.
    for (size_t slot = 0; slot < frames.size(); slot++) {
        copies[slot].create(frames[slot].size(), CV_32FC4);
        copy(int(slot));
        run(int(slot));
    }
    isMeasuring = true;
    auto timings = takeTurns({{"copy", copy}, {"chain", run}}, int(frames.size()), repetitions, seconds);
    BenchResult result;
    result.copy = timings[0];
    result.chain = timings[1];
    result.passes = passes;
    for (const Timing& step : steps) result.steps.push_back({step.name, step.median()});
    result.megapixels = frames[0].size().area() * 1e-6;
    return result;
}

Chain plannedWhole(Chain chain, const FramePair& frame, Backend backend) {
    std::vector<StepPlan> decisions;
    planChain(chain, frame, backend, {}, &decisions);
    size_t next = 0;
    for (Step& step : chain.steps) {
        if (!step.enabled) continue;
        for (const auto& [name, value] : decisions.at(next++).plan.chosen)
            if (auto& parameter = step.values.at(name); parameter.automatic)
                parameter = ParameterValue{{double(value)}};
    }
    return chain;
}

double sumOf(const std::vector<StepTiming>& timings) {
    double sum = 0;
    for (const StepTiming& t : timings) sum += t.milliseconds;
    return sum;
}

std::string deviceName(const Runner& runner) {
    if (runner.backend() == Backend::Gl) return runner.describe();
    std::string processor = "CPU";
    std::ifstream in("/proc/cpuinfo");
    for (std::string line; std::getline(in, line);)
        if (line.starts_with("model name") && line.find(": ") != std::string::npos)
            processor = line.substr(line.find(": ") + 2);
    return text(processor, ", ", cv::getNumThreads(), " threads");
}

}  // namespace brume
