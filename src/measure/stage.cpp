#include "measure/stage.hpp"

#include "cpu/cpu_runner.hpp"
#include "effect/header_chart.hpp"
#include "effect/preset.hpp"
#include "measure/bench.hpp"

namespace brume {
namespace {

std::string nameBefore(const std::string& image) { return "before " + image; }

template <class Function>
void forOtherImages(const Effect& effect, Function function) {
    for (const Parameter& p : effect.header.parameters)
        if (p.type == ParameterType::Image && p.name != effect.header.mainImage()) function(p.name);
}

}  // namespace

Stage::Stage(const std::shared_ptr<const Effect>& effect, const FramePair& captured) : frame_(captured) {
    const Chart* chart = effect->header.chart.get();
    if (!chart || chart->before.empty()) return;
    const Chain before = withAirlight(
        withSidecar(
            parsePreset(chart->before, effect->header.path + ": CHART: BEFORE", EffectRegistry::standard()),
            captured),
        captured);
    Step step;
    step.effect = effect;
    step.values = defaultValues(effect->header.parameters);
    std::vector<std::string> keep;
    forOtherImages(*effect, [&](const std::string& name) { keep.push_back(step.imageOf(name)); });
    auto runner = makeCpuRunner();
    RunResult result = runner->run(plannedWhole(before, captured, Backend::Cpu), captured, keep);
    frame_.color = result.images["color"];
    for (const std::string& name : keep) frame_.images[nameBefore(name)] = result.images[name];
}

Chain Stage::placed(Chain chain) const {
    for (Step& step : chain.steps)
        forOtherImages(*step.effect, [&](const std::string& name) {
            const std::string image = nameBefore(step.imageOf(name));
            if (frame_.images.count(image)) step.values.at(name).text = image;
        });
    return chain;
}

}  // namespace brume
