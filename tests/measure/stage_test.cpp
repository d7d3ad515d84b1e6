// The stage that effects are measured on is what they would find in one chain with CHART's BEFORE.
#include "measure/stage.hpp"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "cpu/cpu_runner.hpp"
#include "effect/header_chart.hpp"
#include "effect/preset.hpp"
#include "measure/bench.hpp"

using namespace brume;

namespace {

TEST(Stage, IsWhatOneChainWouldGive) {
    const EffectRegistry& registry = EffectRegistry::standard();
    const FramePair captured = benchFrames({96, 64})[3];
    auto runner = makeCpuRunner();
    int staged = 0;
    for (const std::string& name : registry.names()) {
        const auto effect = registry.find(name);
        if (!effect->header.chart || effect->header.chart->before.empty()) continue;
        SCOPED_TRACE(name);
        staged++;
        const Chain alone = readPreset(name, registry);
        const Stage stage(effect, captured);
        EXPECT_GT(cv::norm(stage.frame().color, captured.color, cv::NORM_INF), .01);
        const cv::Mat apart = runner->run(stage.placed(alone), stage.frame(), {}).images["color"];

        Chain whole = parsePreset(effect->header.chart->before, "BEFORE", registry);
        whole = plannedWhole(whole, captured, Backend::Cpu);
        whole.steps.push_back(alone.steps[0]);
        const cv::Mat together = runner->run(whole, captured, {}).images["color"];
        EXPECT_EQ(cv::norm(apart, together, cv::NORM_INF), 0);
    }
    EXPECT_GT(staged, 0) << "some effect needs another before it";
}

}  // namespace
