#include "preview/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "apply/apply.hpp"
#include "error.hpp"
#include "frame/inspect.hpp"

namespace brume::preview {

namespace {

double millisecondsSince(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

bool samePolicy(const DepthPolicy& a, const DepthPolicy& b) {
    return a.unknown == b.unknown && a.sky == b.sky && a.skyDistance == b.skyDistance && a.smooth == b.smooth;
}

// Work that looks forward from frame to frame cannot be shown small first.
bool isPersistent(const Chain& chain) {
    for (const Step& step : chain.steps)
        for (const Pass& pass : step.effect->header.passes)
            if (step.enabled && pass.persistent) return true;
    return false;
}

constexpr int smallest = 8;

}  // namespace

ReadyFrame smaller(const ReadyFrame& ready, int scale) {
    if (scale == 1) return ready;
    ReadyFrame small = ready;
    FramePair& frame = small.frame;
    const cv::Size size(std::max(1, frame.color.cols / scale), std::max(1, frame.color.rows / scale));
    frame.fullSize = ready.frame.statedSize();
    cv::resize(ready.frame.color, frame.color, size, 0, 0, cv::INTER_AREA);
    frame.depth = resampleNearest(ready.frame.depth, size);
    if (!ready.restore.empty()) small.restore = resampleNearest(ready.restore, size);
    return small;
}

Renderer::Renderer(RunnerMaker make, std::function<void()> onNews)
    : make_(std::move(make)), onNews_(std::move(onNews)), thread_([this] { work(); }) {}

Renderer::~Renderer() {
    {
        std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    wake_.notify_one();
    thread_.join();
}

void Renderer::submit(RenderJob job) {
    {
        std::lock_guard lock(mutex_);
        waiting_ = std::move(job);
    }
    wake_.notify_one();
}

std::shared_ptr<const Rendered> Renderer::take() {
    std::lock_guard lock(mutex_);
    return std::move(news_);
}

bool Renderer::isBusy() const {
    std::lock_guard lock(mutex_);
    return isBusy_ || waiting_;
}

bool Renderer::waitForNewer(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return wake_.wait_for(lock, time, [&] { return stopping_ || waiting_; });
}

void Renderer::work() {
    for (;;) {
        RenderJob job;
        {
            std::unique_lock lock(mutex_);
            isBusy_ = false;
            wake_.wait(lock, [&] { return stopping_ || waiting_; });
            if (stopping_) break;
            job = std::move(*waiting_);
            waiting_.reset();
            isBusy_ = true;
        }
        for (int scale = firstScale(job); scale > 0;) {
            auto rendered = render(job, scale);
            rendered->isFinal = scale == 1 || !rendered->error.empty();
            scale = rendered->isFinal ? 0 : nextScale(job, scale);
            {
                std::lock_guard lock(mutex_);
                news_ = std::move(rendered);
                if (scale == 0) isBusy_ = false;
            }
            onNews_();
            if (waitForNewer(job.isHurried && scale > 0 ? idle : std::chrono::milliseconds(0))) break;
        }
    }
    runners_.clear();  // on the thread that used them
}

// What is compiled in makes a variant of its own.
static std::string variantOf(const RenderJob& job) {
    std::string variant = job.backend + (job.difference ? " and the other" : "");
    for (const Step& step : job.chain.steps) {
        if (!step.enabled) continue;
        variant += text(" ", step.effect.get());
        for (const Parameter& parameter : step.effect->header.parameters)
            if (parameter.isCompiledIn())
                for (double number : step.values.at(parameter.name).numbers) variant += text(",", number);
    }
    return variant;
}

// A slow picture is worth a coarse look even when nobody drags.
int Renderer::scaleWithin(double milliseconds) const {
    int scale = 1;
    while (scale < smallest && fullMilliseconds_ / (scale * scale) > milliseconds) scale *= 2;
    return scale;
}

int Renderer::firstScale(const RenderJob& job) const {
    if (isPersistent(job.chain)) return 1;
    if (variantOf(job) != lastRun_)
        return job.frame->color.total() > 200000 ? 4 : 1;  // nobody knows what it takes
    return scaleWithin(job.isHurried ? budget : 10 * budget);
}

// 0: no finer one until the drag ends, for a chain cannot be interrupted.
int Renderer::nextScale(const RenderJob& job, int scale) const {
    const int within = scaleWithin(job.isHurried ? 5 * budget : 10 * budget);
    if (within < scale) return within;
    return job.isHurried ? 0 : scale / 2;
}

void Renderer::learn(const RenderJob& job, const Rendered& rendered, double milliseconds) {
    std::string variant = variantOf(job);
    if (variant != lastRun_) {  // its compiling is not to come again
        double passes = 0;
        for (const StepTiming& timing : rendered.timings) passes += timing.milliseconds;
        milliseconds = std::min(
            milliseconds, 1.25 * passes * (job.difference ? 2 : 1) + 40. / (rendered.scale * rendered.scale));
    }
    lastRun_ = std::move(variant);
    fullMilliseconds_ = milliseconds * rendered.scale * rendered.scale;
}

Runner& Renderer::runnerFor(const RenderJob& job, const std::string& backend) {
    if (job.programs != programs_) runners_.clear();
    programs_ = job.programs;
    auto& runner = runners_[backend];
    if (!runner) runner = make_(backend);
    return *runner;
}

const ReadyFrame& Renderer::readyFor(const RenderJob& job, int scale) {
    if (ready_.captured != job.frame || !samePolicy(ready_.policy, job.chain.policy)) {
        ready_ = {job.frame, job.chain.policy, {}, {}};
        ready_.frames[1] = resolveDepth(*job.frame, job.chain.policy);
    }
    auto& found = ready_.frames[scale];
    if (found.frame.color.empty()) found = smaller(ready_.frames[1], scale);
    return found;
}

std::shared_ptr<Rendered> Renderer::render(const RenderJob& job, int scale) {
    auto rendered = std::make_shared<Rendered>();
    rendered->job = job;
    rendered->scale = scale;
    try {
        const ReadyFrame& ready = readyFor(job, scale);
        rendered->depth = ready.frame.depth;
        std::vector<std::string> keep;
        if (job.keepTransmittance) keep.push_back("transmittance");
        if (job.image != "color" && job.image != "depth" && job.image != "captured" &&
            !(job.image == "transmittance" && job.keepTransmittance))
            keep.push_back(job.image);
        Runner& runner = runnerFor(job, job.backend);
        rendered->runner = runner.describe();
        auto start = Clock::now();
        RunResult result = applyChain(runner, job.chain, ready, keep, &rendered->decisions);
        rendered->runMilliseconds = millisecondsSince(start);
        rendered->images = std::move(result.images);
        rendered->timings = std::move(result.timings);
        if (!job.difference) learn(job, *rendered, rendered->runMilliseconds);
        start = Clock::now();
        if (job.difference) {
            const std::string other = job.backend == "cpu" ? "gl" : "cpu";
            auto second = applyChain(runnerFor(job, other), job.chain, ready, {}, nullptr);
            rendered->difference = differenceOf(rendered->images.at("color"), second.images.at("color"));
            rendered->shown = rendered->difference->heat;
            rendered->difference->heat.release();
            rendered->difference->where *= scale;
            learn(job, *rendered, rendered->runMilliseconds + millisecondsSince(start));
        } else if (job.image == "depth") {
            rendered->shown = depthColors(ready.frame.depth);
        } else {
            auto found = rendered->images.find(job.image);
            rendered->shown =
                pictureBytes(found == rendered->images.end() ? ready.frame.color : found->second,
                             job.frame->index, job.frame->seed);
        }
        if (job.withCaptured && ready_.bytes.empty())
            ready_.bytes = pictureBytes(job.frame->color, job.frame->index, job.frame->seed);
        if (job.withCaptured) rendered->captured = ready_.bytes;
        rendered->showMilliseconds = millisecondsSince(start);
        // The CPU's runner uses its images' memory again; others may still look at these.
        if (runner.backend() == Backend::Cpu)
            for (auto& [name, image] : rendered->images) image = image.clone();
    } catch (const std::exception& e) {
        rendered->error = e.what();
    }
    return rendered;
}

}  // namespace brume::preview
