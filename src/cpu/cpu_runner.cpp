#include "cpu/cpu_runner.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <numeric>
#include <opencv2/core/utility.hpp>

#include "effect/missing_half.hpp"
#include "error.hpp"
#include "frame/image_pool.hpp"

namespace brume {

namespace {

using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// A step with all that its plugin needs to run.
struct Bound {
    const Step* step;
    PluginEffect::Params params;
    CpuContext context;
    // Images of another size that a pointwise step reads, resampled a few rows at a time where they are used.
    std::map<std::string, LinearRows> resampled;
};

void requireSameImage(const Step& step, const cv::Mat& now, const cv::Mat& given) {
    if (now.data != given.data || now.size() != given.size() || now.type() != given.type())
        throw Error(ErrorKind::CheckFailed, text(step.id, ": the plugin replaced its output image"));
}

// Memory of a few rows, addressed as those of a whole image.
cv::Mat asWhole(const cv::Mat& rows, int first, cv::Size size) {
    auto origin = reinterpret_cast<uintptr_t>(rows.data) - size_t(first) * rows.step[0];
    return {size, CV_32FC4, reinterpret_cast<void*>(origin), rows.step[0]};
}

class CpuRunner final : public Runner {
  public:
    explicit CpuRunner(bool guarded) : pool_(guarded) {}

    std::string describe() const override { return text("CPU, ", cv::getNumThreads(), " threads"); }
    Backend backend() const override { return Backend::Cpu; }

    RunResult run(const Chain& chain, const FramePair& frame, const std::vector<std::string>& keep) override {
        frame_ = &frame;
        images_ = frame.images;
        images_["color"] = images_["captured"] = frame.color;
        bool readsTransmittance = chain.readsTransmittance(keep);
        if (readsTransmittance) {
            auto& image = images_["transmittance"] = pool_.take(frame.size(), CV_32FC4);
            image.setTo(cv::Scalar::all(1));
        }
        RunResult result;
        std::vector<const Step*> steps;
        for (const Step& step : chain.steps)
            if (step.enabled) steps.push_back(&step);
        for (size_t first = 0; first < steps.size();) {
            size_t last = groupEnd(steps, first);
            auto start = Clock::now();
            runGroup({steps.begin() + first, steps.begin() + last}, readsTransmittance);
            std::string name;
            for (size_t k = first; k < last; k++) name += (name.empty() ? "" : "+") + steps[k]->id;
            result.timings.push_back({name, millisecondsSince(start)});
            first = last;
        }
        result.images["color"] = images_["color"];
        for (const auto& name : keep) {
            auto found = images_.find(name);
            if (found == images_.end()) failUsage("no step writes an image '", name, "' to keep");
            result.images[name] = fourChannels(found->second);
        }
        images_.clear();
        return result;
    }

  private:
    // The end of the longest run of pointwise steps from `first` on that work in place, one after the other.
    static size_t groupEnd(const std::vector<const Step*>& steps, size_t first) {
        auto isPointwise = [](const Step& step) { return step.effect->header.pointwise; };
        size_t end = first + 1;
        if (!isPointwise(*steps[first])) return end;
        const std::string& name = steps[first]->output;
        bool writesTransmittance = steps[first]->effect->header.writesTransmittance;
        for (; end < steps.size(); end++) {
            const Step& next = *steps[end];
            if (!isPointwise(next) || next.input != name || next.output != name) break;
            if (writesTransmittance && next.reads("transmittance")) break;
            if (readsBeside(next, name)) break;
            writesTransmittance |= next.effect->header.writesTransmittance;
        }
        return end;
    }
    // Another image parameter bound to the image that the group is changing.
    static bool readsBeside(const Step& step, const std::string& name) {
        const auto& header = step.effect->header;
        for (const auto& parameter : header.parameters)
            if (parameter.type == ParameterType::Image && parameter.name != header.mainImage() &&
                step.imageOf(parameter.name) == name)
                return true;
        return false;
    }

    const cv::Mat& imageNamed(const Step& step, const std::string& name) const {
        auto found = images_.find(name);
        if (found == images_.end())
            failUsage(step.id, ": reads the image '", name, "', which this frame does not have");
        return found->second;
    }

    Bound bind(const Step& step, bool readsTransmittance, const cv::Mat& input) {
        const Effect& effect = *step.effect;
        if (!effect.plugin) {
            const std::string unbuilt = unbuiltSource(effect.header.path);
            failUsage(effect.name(), " is GLSL only",
                      unbuilt.empty() ? "; run it with --backend gl" : ": " + unbuilt);
        }
        Bound bound{&step, effect.plugin->makeParams(step.values), {}, {}};
        CpuContext& context = bound.context;
        context.input = input;
        context.derivedValues = &derived_.get(step, bound.params, deriveContextFor(*frame_, input.size()));
        cv::Size size = outputSize(step, input.size(), *context.derivedValues);
        if (effect.header.pointwise && size != input.size())
            failUsage(step.id, ": a POINTWISE effect cannot change the image's size");
        context.view = viewFor(*frame_, size);
        context.depth = resampleNearest(frame_->depth, input.size());
        for (const auto& parameter : effect.header.parameters)
            if (parameter.type == ParameterType::Image && parameter.name != effect.header.mainImage()) {
                const cv::Mat& image = imageNamed(step, step.imageOf(parameter.name));
                if (!parameter.resample)
                    context.images[parameter.name] = image;
                else if (effect.header.pointwise && image.size() != size)
                    bound.resampled.emplace(parameter.name, LinearRows(fourChannels(image), size));
                else
                    context.images[parameter.name] = resampleLinear(fourChannels(image), size);
            }
        if (effect.header.writesTransmittance && readsTransmittance && size == frame_->size())
            context.transmittance = images_["transmittance"];
        return bound;
    }

    void runGroup(const std::vector<const Step*>& group, bool readsTransmittance) {
        const Step& first = *group.front();
        cv::Mat input = fourChannels(imageNamed(first, first.input));
        std::vector<Bound> bound = {bind(first, readsTransmittance, input)};
        cv::Size size = {bound[0].context.view.width, bound[0].context.view.height};
        cv::Mat output = mayWorkInPlace(first) ? input : pool_.take(size, CV_32FC4);
        bound[0].context.output = output;
        for (size_t k = 1; k < group.size(); k++) {
            bound.push_back(bind(*group[k], readsTransmittance, output));
            bound[k].context.output = output;
        }
        const size_t cacheBytes = 16 << 20;  // what caches will have kept of an image
        bound.back().context.outputIsStreamed =
            output.data != input.data && output.total() * output.elemSize() > cacheBytes;
        if (first.effect->header.pointwise)
            runRows(bound, size);
        else
            first.effect->plugin->run(bound[0].params, bound[0].context);
        requireSameImage(first, bound[0].context.output, output);
        if (!pool_.guardsWereWhole())
            throw Error(ErrorKind::CheckFailed,
                        text(first.id, ": the plugin wrote outside its output image"));
        images_[group.back()->output] = output;
    }

    // A pointwise step may overwrite its input unless another name, or the caller, still means that image.
    bool mayWorkInPlace(const Step& step) const {
        if (!step.effect->header.pointwise || step.input != step.output || readsBeside(step, step.output))
            return false;
        const uchar* data = images_.at(step.input).data;
        auto holders =
            std::count_if(images_.begin(), images_.end(), [&](auto& i) { return i.second.data == data; });
        return holders == 1 && data != frame_->color.data;
    }

    // All steps of a group visit a few rows before moving on, so that the rows stay in cache: what one step
    // leaves to the next is never a whole image.
    void runRows(const std::vector<Bound>& group, cv::Size size) {
        constexpr int cacheBytes = 128 << 10;
        int together = 1;
        for (const Bound& bound : group)
            together = std::lcm(together, bound.step->effect->plugin->rowsTogether());
        const int strip = std::lcm(8, together);
        const int strips = (size.height - 1) / strip + 1, bands = std::min(strips, 8 * cv::getNumThreads());
        const int fitting = std::clamp(cacheBytes / (size.width * 32), 1, strips * strip);
        const bool isOne = group.size() == 1 && group[0].resampled.empty();
        const int chunk = isOne ? size.height
                          : fitting >= strip
                              ? fitting - fitting % strip
                              : std::lcm(together, int(std::bit_floor(unsigned(fitting + fitting / 2))));
        const cv::Size memorySize(size.width, chunk * bands);
        const cv::Mat between = group.size() == 1 ? cv::Mat() : pool_.take(memorySize, CV_32FC4);
        std::vector<cv::Mat> resampled;
        for (const Bound& bound : group)
            for (size_t k = 0; k < bound.resampled.size(); k++)
                resampled.push_back(pool_.take(memorySize, CV_32FC4));
        // The input's rows of the next chunk, as those of this one.
        const cv::Mat& input = group[0].context.input;
        const cv::Mat upcoming(input.size(), CV_32FC4, input.data + chunk * input.step[0], input.step[0]);
        auto runBand = [&](int band) {
            const cv::Range memoryRows(band * chunk, (band + 1) * chunk);
            std::vector<CpuContext> contexts;
            for (const Bound& bound : group) contexts.push_back(bound.context);
            std::vector<LinearRows::Memory> memories(resampled.size());
            const int end = std::min(strips * (band + 1) / bands * strip, size.height);
            for (int y = strips * band / bands * strip; y < end; y += chunk) {
                const cv::Range rows(y, std::min(y + chunk, end));
                size_t next = 0;
                for (size_t k = 0; k < group.size(); k++) {
                    CpuContext& context = contexts[k];
                    if (k > 0) {
                        context.input = asWhole(between.rowRange(memoryRows), y, size);
                        context.upcoming = upcoming;
                    }
                    if (k + 1 < group.size()) context.output = asWhole(between.rowRange(memoryRows), y, size);
                    for (const auto& [name, whole] : group[k].resampled) {
                        cv::Mat few = resampled[next].rowRange(memoryRows);
                        for (int j = rows.start; j < rows.end; j++)
                            whole.write(j, few.ptr<float>(j - y), memories[next]);
                        context.images[name] = asWhole(few, y, size);
                        next++;
                    }
                    const cv::Mat given = context.output;
                    group[k].step->effect->plugin->rows(group[k].params, context, rows);
                    requireSameImage(*group[k].step, context.output, given);
                }
            }
        };
        cv::parallel_for_(
            cv::Range(0, bands),
            [&](const cv::Range& range) {
                for (int band = range.start; band < range.end; band++) runBand(band);
            },
            bands);
    }

    const FramePair* frame_ = nullptr;
    std::map<std::string, cv::Mat> images_;
    ImagePool pool_;
    DerivedCache derived_;
};

}  // namespace

std::unique_ptr<Runner> makeCpuRunner(bool guarded) { return std::make_unique<CpuRunner>(guarded); }

}  // namespace brume
