// Rows that are written past the caches must have the same bits as those that are not.
#include "common/stream.hpp"
#include "effect/runner.hpp"
#include "fog_fixture.hpp"

namespace brume {
namespace {

// What the step writes of a frame, `rowsAtATime` after the other.
cv::Mat writtenBy(const FramePair& frame, const std::string& step, int rowsAtATime, bool streams) {
    const Chain chain = parsePreset("{\"effects\": [" + step + "]}", "test", EffectRegistry::standard());
    const Step& first = chain.steps[0];
    const PluginEffect& plugin = *first.effect->plugin;
    const auto params = plugin.makeParams(first.values);
    DerivedCache derived;
    CpuContext context;
    context.derivedValues = &derived.get(first, params, deriveContextFor(frame, frame.size()));
    context.view = viewFor(frame, frame.size());
    context.depth = frame.depth;
    context.input = frame.color;
    context.images["second"] = frame.color;
    context.output.create(frame.size(), CV_32FC4);
    context.output.setTo(cv::Scalar::all(-1));
    context.outputIsStreamed = streams;
    for (int row = 0; row < frame.color.rows; row += rowsAtATime)
        plugin.rows(params, context, {row, std::min(row + rowsAtATime, frame.color.rows)});
    return context.output;
}

TEST(FogRows, PastTheCachesAreTheSameBits) {
    if (!canStreamPlanes()) GTEST_SKIP() << "not an x86-64 processor: nothing is written past the caches";
    // odd, so that rows begin anywhere in a line of the cache and end within a tile
    FramePair frame = fogFrame({261, 43});
    frame.depth.row(7).setTo(HUGE_VALF);
    frame.color.row(9).setTo(cv::Scalar::all(HUGE_VALF));
    for (const char* step :
         {R"({"effect": "height_fog"})",
          R"({"effect": "height_fog", "tint": [1, 0.5, 0.2], "density2": 0.01, "tint2": [0.2, 0.5, 1]})",
          R"({"effect": "depth_fog"})", R"({"effect": "depth_fog", "model": "power"})",
          R"({"effect": "depth_fog", "sun": "power", "tint": [1, 0.5, 0.2]})",
          R"({"effect": "depth_fog", "mixing": "encoded"})",
          R"({"effect": "noise_fog", "where": "at the surface"})",
          R"({"effect": "blend", "mode": "screen", "strength": 0.7})"}) {
        const cv::Mat whole = writtenBy(frame, step, frame.color.rows, true),
                      parts = writtenBy(frame, step, 4, false);
        EXPECT_EQ(std::memcmp(whole.data, parts.data, whole.total() * whole.elemSize()), 0) << step;
        EXPECT_GT(apart(whole.rowRange(0, 8), frame.color.rowRange(0, 8)), .01) << step;
    }
}

}  // namespace
}  // namespace brume
