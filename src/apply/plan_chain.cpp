// Which methods each step of a chain takes on this frame, and which steps it can do without.
#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>

#include "apply/apply.hpp"
#include "cpu/cpu_runner.hpp"

namespace brume {
namespace {

// What is known of the images while the chain goes by.
struct Known {
    std::map<std::string, ImageBounds> bounds;
    std::map<std::string, std::vector<Probe>> probes;
    std::set<std::string> isCaptured = {"color", "captured"};  // still the captured colours

    ImageBounds of(const std::string& image) const {
        auto found = bounds.find(image);
        return found == bounds.end() ? ImageBounds{} : found->second;
    }
    // Colours of an image at the frame's probes; where they are not known, the tile's bounds.
    std::vector<Probe> at(const std::string& image, const std::vector<Probe>& places) const {
        if (auto found = probes.find(image); found != probes.end()) return found->second;
        std::vector<Probe> result = places;
        const ImageBounds bounds = of(image);
        for (Probe& probe : result) {
            const cv::Point tile = ImageBounds::placeOf(probe.pixel);
            for (int n = 0; n < 3; n++) {
                probe.low[n] = bounds.lowest.empty() ? bounds.low : bounds.lowest.at<cv::Vec3f>(tile)[n];
                probe.high[n] = bounds.lowest.empty() ? bounds.high : bounds.highest.at<cv::Vec3f>(tile)[n];
            }
        }
        return result;
    }
};

// The hardest pixels of tiles, in colours as dark as an image has there.
cv::Mat darkest(const cv::Mat& hardest, const ImageBounds& bounds) {
    cv::Mat result = hardest.clone();
    for (int j = 0; j < result.rows; j++)
        for (int i = 0; i < result.cols; i++)
            for (int n = 0; n < 3; n++)
                result.at<cv::Vec4f>(j, i)[n] =
                    bounds.lowest.empty() ? float(bounds.low) : bounds.lowest.at<cv::Vec3f>(j + 1, i + 1)[n];
    return result;
}

std::set<std::string> automaticOf(const Step& step) {
    std::set<std::string> names;
    for (const auto& [name, value] : step.values)
        if (value.automatic) names.insert(name);
    return names;
}

bool isReadLater(const std::vector<const Step*>& steps, size_t after, const std::string& image) {
    return std::any_of(steps.begin() + long(after) + 1, steps.end(),
                       [&](const Step* step) { return step->reads(image) || step->input == image; });
}

// By how much the steps after each may amplify an error in what it writes, at least 1.
std::vector<double> gainsAfter(const std::vector<const Step*>& steps, const std::vector<double>& own) {
    std::map<std::string, double> ofImage = {{"color", 1}};
    std::vector<double> after(steps.size(), 1);
    for (size_t k = steps.size(); k-- > 0;) {
        const Step& step = *steps[k];
        const double gain = std::max(1., ofImage[step.output]);
        after[k] = gain;
        if (step.output != step.input) ofImage[step.output] = 0;  // what was there before is lost
        auto reads = [&](double& image) { image = std::max(image, gain * own[k]); };
        reads(ofImage[step.input]);
        for (const auto& parameter : step.effect->header.parameters)
            if (parameter.type == ParameterType::Image) reads(ofImage[step.imageOf(parameter.name)]);
    }
    return after;
}

// A step as decided.
Step resolved(const Step& step, const Plan& plan) {
    Step result = step;
    for (const auto& [name, value] : plan.chosen)
        if (auto& parameter = result.values.at(name); parameter.automatic)
            parameter = ParameterValue{{value}};
    return result;
}

// The images that arrive at a step, made by the CPU halves of those before, as decided.
std::function<cv::Mat(const std::string&)> arrivingAt(const std::vector<const Step*>& steps, size_t at,
                                                      const std::vector<StepPlan>& made,
                                                      const FramePair& frame) {
    auto before = std::make_shared<Chain>();
    for (size_t k = 0; k < at; k++)
        if (!made[k].plan.skip) before->steps.push_back(resolved(*steps[k], made[k].plan));
    if (before->needsGl()) return [](const std::string&) { return cv::Mat(); };
    auto images = std::make_shared<std::map<std::string, cv::Mat>>();
    return [=, step = steps[at], &frame](const std::string& parameter) {
        if (images->empty()) {
            std::vector<std::string> read = {step->input};
            for (const auto& p : step->effect->header.parameters)
                if (p.type == ParameterType::Image) read.push_back(step->imageOf(p.name));
            *images = makeCpuRunner()->run(*before, frame, read).images;
        }
        const auto found = images->find(step->imageOf(parameter));
        return found == images->end() ? cv::Mat() : found->second;
    };
}

}  // namespace

Chain planChain(const Chain& chain, const FramePair& frame, Backend backend,
                const std::vector<std::string>& keep, std::vector<StepPlan>* decisions) {
    Chain planned = chain;
    planned.steps.clear();
    std::vector<const Step*> steps;
    for (const Step& step : chain.steps)
        if (step.enabled) steps.push_back(&step);
    auto plans = [](const Step* step) { return step->effect->plugin && step->effect->plugin->hasPlan(); };
    const auto planners = std::count_if(steps.begin(), steps.end(), plans);

    PlanInput input;
    if (planners > 0) input.frame = measureFrame(frame);
    input.scene = deriveContextFor(frame, frame.size());
    input.depth = frame.depth;
    input.backend = backend;
    input.tolerance = 1. / 510 / std::max(1., double(planners));
    input.transmittanceIsRead = chain.readsTransmittance(keep);

    // Once to learn how much each step may amplify what comes before it, then for good.
    std::vector<double> gains(steps.size(), 1);
    std::vector<StepPlan> made;
    for (bool isFinal : {false, true}) {
        if (isFinal && std::all_of(gains.begin(), gains.end(), [](double g) { return g <= 1; })) break;
        Known known;
        known.bounds["color"] = known.bounds["captured"] = input.frame.color;
        known.probes["color"] = known.probes["captured"] = input.frame.probes;
        known.bounds["transmittance"] = ImageBounds::anywhere(0, 1);
        made.clear();
        const std::vector<double> after = gainsAfter(steps, gains);
        double left = 0;  // of the tolerances so far
        for (size_t k = 0; k < steps.size(); k++) {
            const Step& step = *steps[k];
            StepPlan decision{step.id, {}, false};
            // An effect whose output somebody else reads by name has to run: skipping it would leave the
            // name unmade.
            const bool inPlace = step.input == step.output;
            if (plans(&step)) {
                const auto& plugin = step.effect->plugin;
                PlanInput own = input;
                own.automatic = automaticOf(step);
                own.input = known.of(step.input);
                for (const auto& parameter : step.effect->header.parameters)
                    if (parameter.type == ParameterType::Image &&
                        parameter.name != step.effect->header.mainImage()) {
                        const std::string image = step.imageOf(parameter.name);
                        own.images[parameter.name] = known.of(image);
                        if (auto found = frame.images.find(image); found != frame.images.end())
                            own.captured[parameter.name] = found->second;
                    }
                own.maxInput = std::max(std::abs(own.input.low), std::abs(own.input.high));
                own.frame.probes = known.at(step.input, input.frame.probes);
                if (known.isCaptured.count(step.input))
                    own.color = frame.color;
                else
                    own.frame.hardest = darkest(input.frame.hardest, own.input);
                own.arriving = arrivingAt(steps, k, made, frame);
                own.isLast = !isReadLater(steps, k, step.output);
                own.gain = after[k];
                left += own.tolerance;
                own.toleranceLeft = std::max(left, own.tolerance);
                decision.plan = plugin->plan(plugin->makeParams(step.values), own);
                decision.planned = true;
                decision.tolerance = decision.plan.takesWhatIsLeft ? own.toleranceLeft : own.tolerance;
                left -= decision.plan.predictedError;
                if (!inPlace) decision.plan.skip = false;
                gains[k] = decision.plan.gain;
                if (decision.plan.skip) {
                    decision.plan.output = own.input;
                    decision.plan.probes = own.frame.probes;
                }
                if (!decision.plan.skip) known.isCaptured.erase(step.output);
                known.bounds[step.output] = decision.plan.output;
                known.probes.erase(step.output);
                if (!decision.plan.probes.empty()) known.probes[step.output] = decision.plan.probes;
            } else {
                known.isCaptured.erase(step.output);
                known.bounds[step.output] = {};
                known.probes.erase(step.output);
            }
            made.push_back(decision);
        }
    }
    for (size_t k = 0; k < steps.size(); k++) {
        if (!made[k].plan.skip) planned.steps.push_back(resolved(*steps[k], made[k].plan));
        if (decisions) decisions->push_back(made[k]);
    }
    return planned;
}

}  // namespace brume
