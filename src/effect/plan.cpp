#include "effect/plan.hpp"

#include <algorithm>
#include <cmath>

#include "effect/chain.hpp"
#include "effect/kit/view.hpp"

namespace brume {

FrameStatistics measureFrame(const FramePair& frame) {
    FrameStatistics s;
    s.size = frame.size();
    s.eyeHeight = frame.camera.eye()[1];
    s.depthHistogram.assign(32, 0);
    s.minDistance = s.minHeight = s.minRayUp = HUGE_VAL;
    s.maxHeight = s.maxRayUp = -HUGE_VAL;
    const cv::Size stated = frame.statedSize();
    auto view = View::of(frame.camera, s.size.width, s.size.height, stated.width, stated.height);
    size_t sky = 0;
    double maxColor = 0;
    for (int j = 0; j < s.size.height; j++) {
        const float* depth = frame.depth.ptr<float>(j);
        const cv::Vec4f* color = frame.color.ptr<cv::Vec4f>(j);
        float y = view.rayY(j);
        for (int i = 0; i < s.size.width; i++) {
            for (int k = 0; k < 3; k++)
                if (std::isfinite(color[i][k])) maxColor = std::max(maxColor, std::abs(double(color[i][k])));
            float luminance = .2126f * color[i][0] + .7152f * color[i][1] + .0722f * color[i][2];
            if (std::isfinite(luminance)) s.maxLuminance = std::max(s.maxLuminance, double(luminance));
            float x = view.rayX(i);
            float length = View::rayLength(x, y);
            const auto& r = view.worldFromView;
            float up = (r(1, 0) * x + r(1, 1) * y - r(1, 2)) / length;
            s.minRayUp = std::min(s.minRayUp, double(up));
            s.maxRayUp = std::max(s.maxRayUp, double(up));
            if (!(depth[i] < HUGE_VALF)) {
                sky += depth[i] > 0;
                continue;
            }
            double distance = double(depth[i]) * length;
            s.minDistance = std::min(s.minDistance, distance);
            s.maxDistance = std::max(s.maxDistance, distance);
            double height = s.eyeHeight + distance * up;
            s.minHeight = std::min(s.minHeight, height);
            s.maxHeight = std::max(s.maxHeight, height);
            if (distance > 0) s.depthHistogram[std::clamp(std::ilogb(distance) + 8, 0, 31)]++;
        }
    }
    double pixels = std::max(1., double(s.size.area()));
    s.maxColor = maxColor;
    s.skyShare = sky / pixels;
    for (auto& bin : s.depthHistogram) bin /= pixels;
    if (s.minDistance == HUGE_VAL) s.minDistance = s.maxDistance = s.minHeight = s.maxHeight = 0;
    return s;
}

Chain planChain(const Chain& chain, const FramePair& frame, Backend backend,
                const std::vector<std::string>& keep, std::vector<StepPlan>* decisions) {
    Chain planned = chain;
    planned.steps.clear();
    auto planners = std::count_if(chain.steps.begin(), chain.steps.end(), [](const Step& step) {
        return step.enabled && step.effect->plugin && step.effect->plugin->hasPlan();
    });
    PlanInput input;
    if (planners > 0) input.frame = measureFrame(frame);
    input.backend = backend;
    input.tolerance = 1. / 510 / std::max(1., double(planners));
    input.maxInput = input.frame.maxColor;
    input.transmittanceIsRead = chain.readsTransmittance(keep);

    for (const Step& step : chain.steps) {
        if (!step.enabled) continue;
        StepPlan decision{step.id, {}, false};
        Step chosen = step;
        const auto& plugin = step.effect->plugin;
        if (plugin && plugin->hasPlan()) {
            decision.plan = plugin->plan(plugin->makeParams(step.values), input);
            decision.planned = true;
            for (auto& [name, value] : decision.plan.chosen) {
                auto& parameter = chosen.values.at(name);
                if (parameter.automatic) parameter = ParameterValue{{double(value)}};
            }
            input.maxInput = decision.plan.maxOutput;
        }
        // An effect whose output somebody else reads by name has to run: skipping it would leave the name
        // unmade.
        bool inPlace = step.input == step.output;
        if (!(decision.plan.skip && inPlace)) planned.steps.push_back(chosen);
        if (!inPlace) decision.plan.skip = false;
        if (decisions) decisions->push_back(decision);
    }
    return planned;
}

}  // namespace brume
