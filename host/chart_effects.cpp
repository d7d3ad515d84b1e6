// brume chart's main mode: every method and knob of effects, timed and compared with the reference.
#include <iostream>

#include "chart.hpp"
#include "frame/resolve.hpp"
#include "measure/bench.hpp"
#include "measure/chart.hpp"
#include "progress.hpp"

namespace brume::host {

void chartEffects(const ChartArguments& a) {
    const auto effects = effectsOf(a);
    const auto runners = runnersOf(a);
    std::vector<Runner*> pointers;
    for (const auto& r : runners) pointers.push_back(r.get());
    FramePair frame = a.frames.empty()
                          ? benchFrames({1280, 720})[0]
                          : resolveDepth(readFrame(a.frames[0], a.frameOptions.read()), {}).frame;
    for (const auto& effect : effects) {
        auto rows = chartEffect(
            effect, frame, pointers, {a.repetitions, a.seconds, size_t(a.pixels)}, [](const ChartRow& r) {
                std::cout << r.effect << " | " << r.caseName << " | " << r.label() << " | " << r.backend
                          << " " << r.milliseconds << " (" << r.low << " " << r.high << ") copy " << r.copy
                          << " worst " << r.error.worst << " rms " << r.error.rms << " p "
                          << r.error.percentile << " " << r.problem << std::endl;
            });
    }
}

}  // namespace brume::host
