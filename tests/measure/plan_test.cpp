// Plans: what they count as visible, and that what they choose keeps the tolerance. The long run of the same
// check is `brume check --plan`.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>

#include "apply/apply.hpp"
#include "cpu/cpu_runner.hpp"
#include "effect/preset.hpp"
#include "error.hpp"
#include "frame/color_encoding.hpp"
#include "frame/read.hpp"
#include "measure/bench.hpp"
#include "measure/plan_check.hpp"

using namespace brume;

namespace {

std::vector<FramePair> planFrames() {
    std::vector<FramePair> frames = benchFrames({480, 270});
    frames.resize(1);
    const std::string root = BRUME_CAPTURES;
    for (const char* name : {"/openarena/am_galmevish2.png", "/blender/night_clear.exr", "/tum/color.png"})
        if (!root.empty()) frames.push_back(readFrame(root + name));
    for (FramePair& frame : frames) frame = resizedFrame(resolveDepth(frame, {}).frame, {128, 72});
    return frames;
}

Chain chainOf(const std::string& effects) {
    return parsePreset("{\"effects\": " + effects + "}", "test", EffectRegistry::standard());
}

std::vector<StepPlan> decisionsOf(const std::string& preset, const FramePair& frame,
                                  const std::vector<std::string>& keep = {}) {
    std::vector<StepPlan> decisions;
    planChain(chainOf(preset), frame, Backend::Cpu, keep, &decisions);
    return decisions;
}

// Brightens, and says that this cannot be seen.
struct Gain {
    float gain = 1;
};
std::shared_ptr<Effect> liar(bool admits) {
    auto effect = std::make_shared<Effect>();
    effect->header = parseHeader("liar.fs", R"(/*{"SPACE": "linear", "POINTWISE": true, "INPUTS": [
        {"NAME": "inputImage", "TYPE": "image"},
        {"NAME": "gain", "TYPE": "float", "DEFAULT": 2, "MIN": 2, "MAX": 4}]}*/
void main() {}
)");
    EffectOf<Gain> plugin;
    plugin.bind("gain", &Gain::gain)
        .rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
            for (int j = rows.start; j < rows.end; j++)
                for (int i = 0; i < c.output.cols; i++)
                    const_cast<cv::Mat&>(c.output).at<cv::Vec4f>(j, i) = c.input.at<cv::Vec4f>(j, i) * p.gain;
        })
        .reference([](const Gain& p, const ReferenceContext& c, cv::Point at) {
            ReferencePixel truth;
            truth.color = cv::Vec4d(c.input.at<cv::Vec4f>(at)) * double(p.gain);
            return truth;
        });
    if (admits)
        plugin.plan([](const Gain&, const PlanInput&) {
            Plan plan;
            plan.skip = true;
            plan.predictedError = 1;
            return plan;
        });
    else
        plugin.plan([](const Gain&, const PlanInput&) {
            Plan plan;
            plan.skip = true;
            return plan;
        });
    effect->plugin = std::make_shared<EffectOf<Gain>>(plugin);
    return effect;
}

}  // namespace

TEST(Plan, TheLargestUnseenErrorIsJustUnseen) {
    for (bool isLast : {true, false})
        for (double lowest : {-1., 0., 1e-5, 1e-3, .01, .2, .9, 1.5, 20.}) {
            PlanInput in;
            in.isLast = isLast;
            const double error = in.largestUnseen(lowest);
            double most = 0, more = 0;
            for (double at = std::max(lowest, -1e-3); at < std::max(2., 2 * lowest); at += .0001 * (1 + at)) {
                most = std::max({most, in.visible(at, at + error), in.visible(at, at - error)});
                more = std::max({more, in.visible(at, at + 1.2 * error), in.visible(at, at - 1.2 * error)});
            }
            EXPECT_LE(most, in.tolerance * (1 + 1e-9)) << lowest << " " << isLast;
            EXPECT_GT(more, in.tolerance) << lowest << " " << isLast;
        }
}

TEST(Plan, LaterGainTightensWhatIsUnseen) {
    PlanInput in;
    const double before = in.largestUnseen(.01), ofTheLarger = in.visible(8 * .01, 8 * .0101);
    in.gain = 8;
    EXPECT_DOUBLE_EQ(in.largestUnseen(.01), before / 8);
    EXPECT_DOUBLE_EQ(in.visible(.01, .0101), ofTheLarger);
}

TEST(Plan, MixingShowsNoLessThanAnyPixelDoes) {
    cv::RNG random(3);
    for (int trial = 0; trial < 200; trial++) {
        PlanInput in;
        in.input = ImageBounds::anywhere(random.uniform(-.1, .5), random.uniform(.5, 4.));
        const double opacity = std::pow(random.uniform(0., 1.), 4), from = random.uniform(0., .5),
                     to = from + random.uniform(0., 2.), bound = in.mixingShows(opacity, from, to);
        for (int k = 0; k < 50; k++) {
            const double color = random.uniform(in.input.low, in.input.high),
                         light = random.uniform(from, to), share = opacity * random.uniform(0., 1.),
                         mixed = color * (1 - share) + light * share;
            EXPECT_LE(std::abs(srgbEncode(std::clamp(color, 0., 1.)) - srgbEncode(std::clamp(mixed, 0., 1.))),
                      bound * (1 + 1e-9) + 1e-15);
        }
    }
}

TEST(Plan, NoFogIsSkippedUnlessSomebodyReadsItsTransmittance) {
    const FramePair frame = planFrames()[0];
    for (const char* fog : {R"([{"effect": "depth_fog"}])", R"([{"effect": "height_fog"}])",
                            R"([{"effect": "noise_fog"}])", R"([{"effect": "volume_fog"}])"})
        EXPECT_FALSE(decisionsOf(fog, frame)[0].plan.skip) << fog;
    for (const char* none :
         {R"([{"effect": "depth_fog", "measure": "extinction", "extinction": 0}])",
          R"([{"effect": "height_fog", "density": 0}])", R"([{"effect": "volume_fog", "density": 0}])"}) {
        EXPECT_TRUE(decisionsOf(none, frame)[0].plan.skip) << none;
        EXPECT_FALSE(decisionsOf(none, frame, {"transmittance"})[0].plan.skip) << none;
    }
}

TEST(Plan, ABlurIsMoreExactBeforeWhatAmplifiesIt) {
    const FramePair frame = planFrames()[0];
    const std::string blur =
        R"({"effect": "gaussian_blur", "radius": 4, "method": "fir", "tolerance": "auto", "output": "glow"})";
    auto tolerance = [&](const std::string& strength) {
        return decisionsOf("[" + blur +
                               R"(, {"effect": "blend", "second": "glow", "mode": "add", "strength": )" +
                               strength + "}]",
                           frame)[0]
            .plan.chosen.at("tolerance");
    };
    EXPECT_LT(tolerance("8"), .2 * tolerance("1"));
}

// Of a lamp so bright that the error may show: who asked for a tolerance gets the cheapest method that keeps
// it, and is told.
TEST(Plan, AToleranceThatWasAskedForIsEnough) {
    FramePair frame;
    frame.color = cv::Mat(64, 64, CV_32FC4, cv::Scalar(0, 0, 0, 1));
    frame.color.at<cv::Vec4f>(32, 32) = {5000, 5000, 5000, 1};
    frame.depth = cv::Mat(frame.color.size(), CV_32F, cv::Scalar(10));
    frame.camera = Camera::withHorizontalView(frame.color.size(), 60);
    for (const auto& [effect, radius] : {std::pair("gaussian_blur", "2.7"), {"bessel_blur", "9.5"}}) {
        auto planOf = [&](const std::string& tolerance) {
            return decisionsOf(text(R"([{"effect": ")", effect, R"(", "radius": )", radius,
                                    R"(, "method": "auto", "tolerance": )", tolerance, "}]"),
                               frame)[0]
                .plan;
        };
        const Plan asked = planOf("0.001"), unseen = planOf("\"auto\"");
        const int decimated = 2;
        EXPECT_EQ(asked.chosen.at("method"), decimated) << effect;
        EXPECT_LT(asked.predictedCost, unseen.predictedCost) << effect;
        EXPECT_GT(asked.predictedError, unseenError) << effect;
        EXPECT_NE(asked.why.find("asked for"), std::string::npos) << asked.why;
        EXPECT_LE(unseen.predictedError, unseenError) << effect;
    }
}

TEST(Plan, AFogBlurThatIsTriedGetsWhatTheFogBeforeItLeaves) {
    const auto decisions = decisionsOf(
        R"([{"effect": "depth_fog"}, {"effect": "fog_blur", "radius": 16, "method": "auto", "rungs": "auto"}])",
        planFrames()[0]);
    ASSERT_TRUE(decisions[1].plan.takesWhatIsLeft);
    EXPECT_EQ(decisions[1].tolerance, 2 * decisions[0].tolerance - decisions[0].plan.predictedError);
    EXPECT_LE(decisions[0].plan.predictedError + decisions[1].plan.predictedError, unseenError);
}

TEST(Plan, ANamedOutputIsMadeEvenWhereItChangesNothing) {
    const auto decisions = decisionsOf(
        R"([{"effect": "gaussian_blur", "radius": 0, "output": "glow"}, {"effect": "blend", "second": "glow"}])",
        planFrames()[0]);
    EXPECT_FALSE(decisions[0].plan.skip);
}

TEST(PlanCheck, CatchesAPlanThatIsWrongAndOneThatSaysSo) {
    auto cpu = makeCpuRunner();
    const FramePair frame = planFrames()[0];
    for (bool admits : {false, true})
        for (const PlanSet& set : planSets({liar(admits)}, 1, 0, 2)) {
            const PlanCheck check = checkPlan(*cpu, set, frame, 50);
            EXPECT_GT(check.measured, 10 * unseenError);
            EXPECT_EQ(check.keptPromise(), admits);
        }
}

TEST(PlanCheck, SetsDoNotDependOnTheirPiece) {
    std::vector<std::shared_ptr<const Effect>> effects = {EffectRegistry::standard().find("gaussian_blur"),
                                                          EffectRegistry::standard().find("volume_fog")};
    const auto all = planSets(effects, 7, 0, 6), piece = planSets(effects, 7, 4, 2);
    EXPECT_EQ(all[4].values, piece[0].values);
    EXPECT_EQ(all[5].values, piece[1].values);
    EXPECT_NE(all[2].values, all[4].values);
    EXPECT_NE(planSets(effects, 8, 4, 1)[0].values, all[4].values);
}

// Sets of a linear generator drew no surface noise in 40, and simplex noise 6 times.
TEST(PlanCheck, EveryChoiceIsDrawnAboutAsOften) {
    const auto effect = EffectRegistry::standard().find("noise_fog");
    for (uint32_t seed : {1u, 4072u, 4073u}) {
        const auto sets = planSets({effect}, seed, 0, 60);
        for (const Parameter& p : effect->header.parameters) {
            if (p.values.empty() || p.allowsAuto) continue;
            std::map<double, int> drawn;
            for (const PlanSet& set : sets) drawn[set.chain.steps[0].values.at(p.name).numbers.at(0)]++;
            for (double value : p.values)
                EXPECT_GE(drawn[value], 60 / int(p.values.size()) / 3) << p.name << " = " << value;
        }
    }
}

// Every effect that has a plan, so a new one is covered by being there.
TEST(PlanCheck, WhatIsChosenKeepsTheTolerance) {
    const EffectRegistry& registry = EffectRegistry::standard();
    std::vector<std::shared_ptr<const Effect>> effects;
    for (const std::string& name : registry.names())
        if (auto effect = registry.find(name);
            effect->plugin && effect->plugin->hasPlan() && effect->plugin->hasReference())
            effects.push_back(effect);
    ASSERT_GE(effects.size(), 9u);
    auto cpu = makeCpuRunner();
    size_t compared = 0;
    for (const FramePair& frame : planFrames())
        for (const PlanSet& set : planSets(effects, 5, 0, 5 * int(effects.size()))) {
            const PlanCheck check = checkPlan(*cpu, set, frame, 60);
            EXPECT_TRUE(check.keptPromise())
                << check.effect << ", set " << set.number << " on " << frame.name << ": " << check.choice
                << ": " << check.measured / unseenError << " of the tolerance, "
                << check.predicted / unseenError << " predicted; " << check.values;
            compared += check.compared;
        }
    EXPECT_GT(compared, 45u * 60 / 2);
}
