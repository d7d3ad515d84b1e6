// That plans foretell no less than what happens. Random sets seldom come near the tolerance, so that they do
// not tell a plan that foretells a quarter of the error from one that is right: here each number is asked
// for.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>

#include "apply/apply.hpp"
#include "cpu/cpu_runner.hpp"
#include "effect/preset.hpp"
#include "error.hpp"
#include "frame/color_encoding.hpp"
#include "measure/encoded_error.hpp"
#include "measure/plan_check.hpp"
#include "measure/reference.hpp"

using namespace brume;

namespace {

constexpr double tolerance = 1. / 510;

Chain chainOf(const std::string& step) {
    return parsePreset("{\"effects\": [" + step + "]}", "test", EffectRegistry::standard());
}
StepPlan decisionOf(const Chain& chain, const FramePair& frame) {
    std::vector<StepPlan> decisions;
    planChain(chain, frame, Backend::Cpu, {}, &decisions);
    return decisions.at(0);
}

// Level eyes over even ground, a wall far behind.
FramePair ground(cv::Size size, double far, double grey) {
    FramePair frame;
    frame.name = "ground";
    frame.camera = Camera::withHorizontalView(size, 70);
    frame.color = cv::Mat(size, CV_32FC4, cv::Scalar(grey, grey, grey, 1));
    frame.depth.create(size, CV_32F);
    for (int j = 0; j < size.height; j++)
        for (int i = 0; i < size.width; i++) {
            const cv::Vec3d ray = frame.camera.ray(i, j);
            frame.depth.at<float>(j, i) = float(std::min(far, ray[1] < 0 ? 1.6 / -ray[1] : far));
        }
    return frame;
}

double worstDifference(const cv::Mat& a, const cv::Mat& b) {
    double worst = 0;
    for (int j = 0; j < a.rows; j++)
        for (int i = 0; i < a.cols; i++)
            worst = std::max(worst, encodedDifference(a.at<cv::Vec4f>(j, i), b.at<cv::Vec4f>(j, i)) / 255);
    return worst;
}

}  // namespace

// One black pixel at the far wall is where fog shows first: bounds are nearly reached there.
TEST(PlanBounds, FogIsLeftOutWhereItCannotShowAndOnlyThere) {
    FramePair frame = ground({64, 36}, 300, .5);
    frame.color.at<cv::Vec4f>(3, 32) = {0, 0, 0, 1};
    const auto cpu = makeCpuRunner();
    for (
        const std::string fog :
        {R"({"effect": "depth_fog", "measure": "extinction", "extinction": )",
         R"({"effect": "height_fog", "method": "closed form", "falloff": 0, "density": )",
         R"({"effect": "noise_fog", "method": "procedural", "steps": 4, "octaves": 1, "low": 1, "high": 1, "density": )",
         R"({"effect": "volume_fog", "method": "midpoint", "steps": 8, "early_stop": false, "sun_intensity": 0,
              "ambient": [0.6, 0.65, 0.7], "density": )"}) {
        int skipped = 0, kept = 0;
        for (double density = 1e-8; density < 1e-3; density *= 1.3) {
            const Chain chain = chainOf(text(fog, density, "}"));
            const double shows = worstDifference(cpu->run(chain, frame, {}).images.at("color"), frame.color);
            const bool isSkipped = decisionOf(chain, frame).plan.skip;
            EXPECT_TRUE(!isSkipped || shows <= tolerance)
                << fog << density << " shows by " << shows / tolerance;
            EXPECT_TRUE(isSkipped || shows > .7 * tolerance)
                << fog << density << " would show by " << shows / tolerance;
            (isSkipped ? skipped : kept)++;
        }
        EXPECT_GT(skipped, 5) << fog;
        EXPECT_GT(kept, 5) << fog;
    }
}

// Each of several steps has its share of the tolerance: what is left out by all together does not show.
TEST(PlanBounds, FogsThatWouldShowTogetherAreNotAllLeftOut) {
    FramePair frame = ground({64, 36}, 300, .5);
    frame.color.at<cv::Vec4f>(3, 32) = {0, 0, 0, 1};
    const auto cpu = makeCpuRunner();
    const auto leftOut = [&](const Chain& chain) {
        std::vector<StepPlan> decisions;
        planChain(chain, frame, Backend::Cpu, {}, &decisions);
        return std::count_if(decisions.begin(), decisions.end(),
                             [](const StepPlan& d) { return d.plan.skip; });
    };
    bool isOneLeftOut = false;
    for (double density = 1e-8; density < 1e-3; density *= 1.1) {
        const std::string fog =
            text(R"({"effect": "depth_fog", "measure": "extinction", "extinction": )", density, "}");
        const Chain both = chainOf(fog + ", " + fog);
        const double shows = worstDifference(cpu->run(both, frame, {}).images.at("color"), frame.color);
        EXPECT_TRUE(leftOut(both) < 2 || shows <= tolerance) << density << " shows by " << shows / tolerance;
        isOneLeftOut |= shows > tolerance && leftOut(chainOf(fog)) == 1;
    }
    EXPECT_TRUE(isOneLeftOut) << "the case says nothing";
}

// Steps that are given: what they cost in accuracy is foretold, by no less and not by ten times as much.
TEST(PlanBounds, TheErrorOfGivenStepsIsForetold) {
    const FramePair frame = ground({48, 27}, 200, .3);
    const auto cpu = makeCpuRunner();
    const std::string volume = R"({"effect": "volume_fog", "sun_intensity": 0, "ambient": [0.7, 0.7, 0.7], )";
    for (
        const std::string& fog :
        {volume +
             R"("method": "midpoint", "density": 0.05, "height_falloff": "exponential", "height_start": 0, "steps": )",
         volume +
             R"("method": "left", "density": 0.05, "height_falloff": "exponential", "height_start": 0, "steps": )",
         volume +
             R"("method": "midpoint", "density": 0, "boxes": [{"center": [0, 3, -40], "size": [50, 20, 50],
              "density": 0.1, "edge_falloff": "linear", "height_falloff": "linear", "height_distance": 20}], "steps": )",
         std::string(
             R"({"effect": "noise_fog", "where": "along the ray", "method": "procedural", "size": 15, "octaves": 2,
              "density": 0.01, "steps": )")})
        for (int steps : {2, 3, 6}) {
            const Chain chain = chainOf(text(fog, steps, "}"));
            const cv::Mat image = cpu->run(chain, frame, {}).images.at("color");
            const auto pixels = sampleGrid(frame.size(), 400).pixels;
            const auto truth = referenceOfChain(chain, frame, pixels);
            const double measured = errorStatistics(encodedErrors(image, pixels, truth), pixels).worst / 255,
                         predicted = decisionOf(chain, frame).plan.predictedError;
            EXPECT_GT(measured, .5 * tolerance) << "the case says nothing: " << fog << steps;
            EXPECT_LE(measured, predicted) << fog << steps;
            EXPECT_GE(measured, .1 * predicted) << fog << steps;
        }
}

// No number of steps holds metres of noise, or of falloff, on rays of kilometres: the plan takes what is most
// exact, and says that it may show.
TEST(PlanBounds, RaysOfKilometresInDenseFogAreHeldOrForetold) {
    const FramePair frame = ground({48, 27}, 4000, .05);
    const auto cpu = makeCpuRunner();
    const auto pixels = sampleGrid(frame.size(), 200).pixels;
    int held = 0, foretold = 0;
    for (
        const std::string fog :
        {R"("density": 0.05)", R"("density": 0.02, "noise": "additive", "noise_size": 100)",
         R"("density": 0.014, "noise": "subtractive", "noise_size": 3.3, "noise_every": 12)",
         R"("density": 0.07, "height_falloff": "exponential", "height_start": 15, "height_distance": 0.5)"}) {
        const Chain chain = chainOf(
            R"({"effect": "volume_fog", "steps": "auto", "max_distance": 5000, "shadow_strength": 0, )" +
            fog + "}");
        std::vector<StepPlan> decisions;
        const Chain planned = planChain(chain, frame, Backend::Cpu, {}, &decisions);
        const cv::Mat image = cpu->run(planned, frame, {}).images.at("color");
        const auto truth = referenceOfChain(planned, frame, pixels);
        const double measured = errorStatistics(encodedErrors(image, pixels, truth), pixels).worst / 255,
                     predicted = decisions.at(0).plan.predictedError;
        EXPECT_LE(measured, std::max(predicted, tolerance)) << fog;
        held += measured <= tolerance;
        foretold += measured > tolerance;
    }
    EXPECT_GT(held, 0) << "the cases say nothing";
    EXPECT_GT(foretold, 0) << "the cases say nothing";
}

// Where a frame shows its fog in few pixels, or in a pattern of them, the plan must not look past them.
TEST(PlanBounds, FogBehindAWindowOrAFenceIsHeld) {
    const std::string patchy =
        R"({"effect": "volume_fog", "steps": "auto", "method": "auto", "density": 0, "noise": "subtractive",
            "noise_strength": 1, "noise_size": 3, "boxes": [{"center": [0, 10, -60], "size": [60, 30, 60], "density": 0.05}]})";
    const Chain chain = chainOf(patchy);
    const auto cpu = makeCpuRunner();
    for (const bool isFence : {false, true}) {
        FramePair frame = ground({160, 90}, 80, .1);
        std::vector<cv::Point> open;
        for (int j = 0; j < 90; j++)
            for (int i = 0; i < 160; i++) {
                const bool isOpen =
                    isFence ? i % 8 == 0 && j < 45 : (i == 83 || i == 84) && (j == 41 || j == 42);
                if (isOpen)
                    open.emplace_back(i, j);
                else
                    frame.depth.at<float>(j, i) = std::min(frame.depth.at<float>(j, i), 3.f);
            }
        // the frame's farthest and brightest are elsewhere
        for (const int i : {10, 150}) frame.depth.at<float>(10, i) = 79.5, open.emplace_back(i, 10);
        frame.color.at<cv::Vec4f>(10, 10) = {1, 1, 1, 1}, frame.color.at<cv::Vec4f>(10, 150) = {0, 0, 0, 1};
        std::vector<StepPlan> decisions;
        const Chain planned = planChain(chain, frame, Backend::Cpu, {}, &decisions);
        const cv::Mat image = cpu->run(planned, frame, {}).images.at("color");
        const auto truth = referenceOfChain(planned, frame, open);
        const double measured = errorStatistics(encodedErrors(image, open, truth), open).worst / 255;
        EXPECT_LE(measured, tolerance) << isFence << " " << decisions.at(0).plan.why;
        EXPECT_LE(measured, decisions.at(0).plan.predictedError) << isFence;
        EXPECT_GT(measured, .05 * tolerance) << "the case says nothing";
    }
}

// What the march leaves out by stopping early no number of steps mends; a later step may multiply it.
TEST(PlanBounds, WhatStoppingEarlyLeavesOutIsForetold) {
    const FramePair frame = ground({160, 90}, 300, .2);
    const auto cpu = makeCpuRunner();
    const auto pixels = sampleGrid(frame.size(), 200).pixels;
    for (const double strength : {4., 16.}) {
        const Chain chain = chainOf(text(
            R"({"effect": "volume_fog", "steps": "auto", "density": 0.08, "sun_intensity": 0, "max_distance": 300,
                "ambient": [0.003, 0.003, 0.003]}, {"effect": "blend", "second": "color", "mode": "add", "strength": )",
            strength, "}"));
        std::vector<StepPlan> decisions;
        const Chain planned = planChain(chain, frame, Backend::Cpu, {}, &decisions);
        const cv::Mat image = cpu->run(planned, frame, {}).images.at("color");
        const auto truth = referenceOfChain(planned, frame, pixels);
        const double measured = errorStatistics(encodedErrors(image, pixels, truth), pixels).worst / 255;
        double predicted = 0;
        for (const StepPlan& decision : decisions) predicted += decision.plan.predictedError;
        EXPECT_LE(measured, predicted) << strength;
        EXPECT_GT(measured, .2 * tolerance) << "the case says nothing";
        EXPECT_LT(decisions.at(0).plan.chosen.at("steps"), 16) << "for nothing: one is exact in even fog";
    }
}

// Kernels' errors are bounds that an image made for it reaches: bright where the chosen kernel has too much,
// dark where it has too little. Plans count on half of the bound (`likelihood`), so that image may show twice
// the tolerance where it cannot be tried: here what is dark is what a detection has left of a bright
// surrounding. Where it is the captured picture, it is tried.
TEST(PlanBounds, ABlursErrorIsAtMostTwiceTheToleranceOnTheWorstImage) {
    const auto cpu = makeCpuRunner();
    auto frameOf = [&](const cv::Mat& image) {
        FramePair frame;
        frame.color = image;
        frame.depth = cv::Mat(image.size(), CV_32F, cv::Scalar(10));
        frame.camera = Camera::withHorizontalView(image.size(), 60);
        return frame;
    };
    for (const char* effect : {"gaussian_blur", "bessel_blur"})
        for (const auto& [radius, range, surrounding] : {std::array{1.5, .7, 0.},
                                                         {2.2, .7, 0.},
                                                         {2.7, .7, 0.},
                                                         {1.5, 6., 0.},
                                                         {2.2, 6., 0.},
                                                         {2.7, 6., 0.},
                                                         {1.5, 6., .6},
                                                         {2.2, 6., .6},
                                                         {2.7, 6., .6},
                                                         {24., 6., .6}}) {
            const cv::Size size = radius < 10 ? cv::Size(97, 97) : cv::Size(301, 301);
            const cv::Point middle = cv::Point(size) / 2;
            std::vector<cv::Point> all;
            for (int j = 0; j < size.height; j++)
                for (int i = 0; i < size.width; i++) all.emplace_back(i, j);
            auto stepOf = [&](const std::string& tolerance) {
                return text("{\"effect\": \"", effect, "\", \"radius\": ", radius,
                            ", \"method\": \"fir\", \"tolerance\": ", tolerance, "}");
            };
            // What the plan takes where so much lies beside nothing, in patches of no particular shape.
            cv::Mat patches(size, CV_32FC4);
            for (int j = 0; j < size.height; j++)
                for (int i = 0; i < size.width; i++)
                    patches.at<cv::Vec4f>(j, i) =
                        cv::Vec4f::all((i * 7 + j * 5 + i * j) % 11 < 5 ? float(range) : float(surrounding));
            // The image that is worst for a kernel, against the true one, which the reference knows.
            auto worstOf = [&](const Chain& chosen) {
                cv::Mat impulse = cv::Mat::zeros(size, CV_32FC4);
                impulse.at<cv::Vec4f>(middle) = {1, 1, 1, 1};
                const FramePair lamp = frameOf(impulse);
                const cv::Mat kernel = cpu->run(chosen, lamp, {}).images.at("color").clone();
                const auto truth = referenceOfChain(chosen, lamp, all);
                cv::Mat worst(size, CV_32FC4);
                for (size_t k = 0; k < all.size(); k++) {
                    const bool isTooLittle = kernel.at<cv::Vec4f>(all[k])[0] < truth[k].color[0];
                    worst.at<cv::Vec4f>(all[k]) = cv::Vec4f::all(isTooLittle ? float(range) : 0);
                }
                return frameOf(worst);
            };
            // How far apart the two are: of the middle, and as it looks at most.
            auto apartOn = [&](const Chain& chosen, const FramePair& frame) {
                const cv::Mat made = cpu->run(chosen, frame, {}).images.at("color").clone();
                const auto truth = referenceOfChain(chosen, frame, all);
                double atMiddle = 0, visible = 0;
                for (size_t k = 0; k < all.size(); k++) {
                    const double a = made.at<cv::Vec4f>(all[k])[0], b = truth[k].color[0];
                    if (all[k] == middle) atMiddle = std::abs(a - b);
                    visible = std::max(visible, std::abs(srgbEncode(std::clamp(a, 0., 1.)) -
                                                         srgbEncode(std::clamp(b, 0., 1.))));
                }
                return std::pair(atMiddle, visible);
            };
            const std::string automatic = stepOf("\"auto\"");
            double ofUnseen = 0;
            if (surrounding > 0) {
                const std::string detection = R"({"effect": "light_detect", "luminance": "linear 709"}, )";
                Chain chosen = planChain(chainOf(detection + automatic), frameOf(patches), Backend::Cpu, {});
                chosen.steps.erase(chosen.steps.begin(), chosen.steps.end() - 1);
                // Half is the detection's.
                ofUnseen = apartOn(chosen, worstOf(chosen)).first / srgbDecode(tolerance / 2);
            } else {
                for (const char* cut : {"1e-3", "3e-4", "1e-4", "3e-5", "1e-5"}) {
                    const FramePair frame =
                        worstOf(planChain(chainOf(stepOf(cut)), frameOf(patches), Backend::Cpu, {}));
                    const Chain chosen = planChain(chainOf(automatic), frame, Backend::Cpu, {});
                    ofUnseen = std::max(ofUnseen, apartOn(chosen, frame).second / tolerance);
                }
            }
            EXPECT_LE(ofUnseen, 2) << effect << " " << radius << " " << range << " " << surrounding;
            if (surrounding > 0 && radius > 2.5) {  // what is unseen, not the largest tolerance, decides
                EXPECT_GT(ofUnseen, .5) << effect << " " << radius << " " << surrounding;
            }
        }
}

// What a step says of its output, which later plans rely on: random sets of every effect, a frame with lamps.
TEST(PlanBounds, WhatLeavesAStepLiesWithinItsBounds) {
    FramePair frame = ground({80, 48}, 120, .2);
    cv::RNG random(2);
    for (int k = 0; k < 40; k++)
        frame.color.at<cv::Vec4f>(random.uniform(0, 48), random.uniform(0, 80)) =
            cv::Vec4f(float(random.uniform(0., 30.)), float(random.uniform(0., 3.)), 2, 1);
    std::vector<std::shared_ptr<const Effect>> effects;
    for (const std::string& name : EffectRegistry::standard().names())
        if (auto effect = EffectRegistry::standard().find(name); effect->plugin && effect->plugin->hasPlan())
            effects.push_back(effect);
    ASSERT_GE(effects.size(), 9u);
    const auto cpu = makeCpuRunner();
    int bounded = 0;
    for (const PlanSet& set : planSets(effects, 11, 0, 8 * int(effects.size()))) {
        std::vector<StepPlan> decisions;
        const Chain chain = planChain(withAirlight(set.chain, frame), frame, Backend::Cpu, {}, &decisions);
        const cv::Mat image = cpu->run(chain, frame, {}).images.at("color");
        const ImageBounds& bounds = decisions.back().plan.output;
        const double slack = 1e-5 * std::max(std::abs(bounds.low), std::abs(bounds.high));
        bounded += std::isfinite(slack);
        double beyond = 0, beyondTile = 0;
        const bool isTiled = !bounds.lowest.empty() && image.size() == frame.size();
        cv::Mat sums = cv::Mat::zeros(isTiled ? bounds.lowest.size() : cv::Size(), CV_64FC3);
        for (int j = 0; j < image.rows; j++)
            for (int i = 0; i < image.cols; i++)
                for (int n = 0; n < 3; n++) {
                    const double value = image.at<cv::Vec4f>(j, i)[n];
                    beyond = std::max({beyond, bounds.low - value, value - bounds.high});
                    if (!isTiled) continue;
                    const cv::Point tile = ImageBounds::placeOf({i, j});
                    sums.at<cv::Vec3d>(tile)[n] += value;
                    beyondTile = std::max({beyondTile, double(bounds.lowest.at<cv::Vec3f>(tile)[n]) - value,
                                           value - double(bounds.highest.at<cv::Vec3f>(tile)[n])});
                }
        EXPECT_LE(beyond, slack) << set.effect << " " << set.number << " " << set.values;
        EXPECT_LE(beyondTile, slack) << set.effect << " " << set.number << " " << set.values;
        double beyondMean = 0;
        for (int j = 1; j + 1 < sums.rows; j++)
            for (int i = 1; i + 1 < sums.cols; i++)
                for (int n = 0; n < 3; n++) {  // 80 × 48 are whole tiles
                    const double mean = sums.at<cv::Vec3d>(j, i)[n] / (ImageBounds::tile * ImageBounds::tile);
                    beyondMean = std::max({beyondMean, bounds.leastMean.at<cv::Vec3f>(j, i)[n] - mean,
                                           mean - bounds.greatestMean.at<cv::Vec3f>(j, i)[n]});
                }
        EXPECT_LE(beyondMean, slack) << set.effect << " " << set.number << " " << set.values;
        // What edges repeat, in the tiles around.
        double beyondRing = 0;
        cv::Mat repeated;
        constexpr int tile = ImageBounds::tile;
        if (isTiled) cv::copyMakeBorder(image, repeated, tile, tile, tile, tile, cv::BORDER_REPLICATE);
        for (int j = 0; j < sums.rows; j++)
            for (int i = 0; i < sums.cols; i++) {
                if (j > 0 && j + 1 < sums.rows && i > 0 && i + 1 < sums.cols) continue;
                const cv::Scalar mean = cv::mean(repeated(cv::Rect(i * tile, j * tile, tile, tile)));
                for (int n = 0; n < 3; n++)
                    beyondRing = std::max({beyondRing, bounds.leastMean.at<cv::Vec3f>(j, i)[n] - mean[n],
                                           mean[n] - bounds.greatestMean.at<cv::Vec3f>(j, i)[n]});
            }
        EXPECT_LE(beyondRing, slack) << set.effect << " " << set.number << " " << set.values;
    }
    EXPECT_GE(bounded, 7 * int(effects.size()));
}

// The report's sum takes its lights as they are, where the integral spreads them over the sphere: four times
// as bright, and no random set had one brighter than the frame.
TEST(PlanBounds, WhatLeavesLanmansSumLiesWithinItsBounds) {
    const FramePair frame = ground({80, 48}, 120, .05);
    const auto cpu = makeCpuRunner();
    for (const std::string lights :
         {R"("sun_color": [40, 40, 40], "sun_intensity": 2, "ambient_intensity": 0})",
          R"("sun_intensity": 0, "ambient": [3, 3, 3], "ambient_intensity": 0.9})",
          R"("sun_intensity": 0, "ambient_intensity": 0, "point_lights": [{"position": [0, 1.6, -5],
             "color": [40, 40, 40], "intensity": 1, "range": 100, "attenuation": [1, 0, 0]}]})"}) {
        const Chain chain = chainOf(R"({"effect": "volume_fog", "method": "p2", "density": 0.5, )" + lights);
        const cv::Mat image = cpu->run(chain, frame, {}).images.at("color");
        double high;
        cv::minMaxLoc(image.reshape(1), nullptr, &high);
        const double bound = decisionOf(chain, frame).plan.output.high;
        EXPECT_LE(high, bound * 1.00001) << lights;
        EXPECT_GT(high, .5 * bound) << "the case says nothing: " << lights;
    }
}

// By how much a step may make an error larger: pixels a little brighter, through the knee.
TEST(PlanBounds, AStepsGainIsAtLeastWhatItDoesToASmallChange) {
    cv::Mat image(16, 64, CV_32FC4);
    for (int j = 0; j < image.rows; j++)
        for (int i = 0; i < image.cols; i++)
            image.at<cv::Vec4f>(j, i) = cv::Vec4f(.02f * float(i), .01f * float(i), .005f * float(i + j), 1);
    FramePair frame = ground(image.size(), 50, .5), brighter = frame;
    frame.color = image, brighter.color = image + cv::Scalar(1e-3, 1e-3, 1e-3, 0);
    const auto cpu = makeCpuRunner();
    for (
        const std::string step :
        {R"({"effect": "light_detect", "threshold": 0.6, "knee": 0.2, "intensity": 5, "saturation": 2})",
         R"({"effect": "light_detect", "threshold": 0.3, "knee": 0.3, "intensity": 2, "luminance": "linear 709"})"}) {
        const Chain chain = chainOf(step);
        const cv::Mat a = cpu->run(chain, frame, {}).images.at("color").clone(),
                      b = cpu->run(chain, brighter, {}).images.at("color");
        const double grew = cv::norm(a.reshape(1), b.reshape(1), cv::NORM_INF) / 1e-3,
                     gain = decisionOf(chain, frame).plan.gain;
        EXPECT_LE(grew, gain * 1.001) << step;
        EXPECT_GT(grew, 2) << "the case says nothing: " << step;
    }
}
