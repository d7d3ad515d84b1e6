// Frames that nobody takes on purpose: cameras at the limits of what readers let through, depths of every
// size, single rows. Every effect that is found runs on them at every choice; sanitizers watch.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>

#include "apply/apply.hpp"
#include "cpu/cpu_runner.hpp"
#include "frame/camera_limits.hpp"
#include "measure/check.hpp"

using namespace brume;

namespace {

constexpr float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
constexpr float largest = std::numeric_limits<float>::max();

FramePair frameOf(cv::Size size, const std::vector<float>& depths) {
    FramePair frame;
    frame.camera = Camera::withHorizontalView(size, 70);
    frame.color.create(size, CV_32FC4);
    frame.depth.create(size, CV_32F);
    cv::RNG random(7);
    random.fill(frame.color, cv::RNG::UNIFORM, 0, 1);
    size_t k = 0;
    for (float& depth : cv::Mat_<float>(frame.depth)) depth = depths[k++ % depths.size()];
    return frame;
}

const std::vector<float>& allKinds() {
    static const std::vector<float> depths = {1e-42f, 1e-6f, nan, 3, 1e4f, inf, 1e20f, largest, 7};
    return depths;
}

using Change = std::function<void(Camera&)>;
Change view(double degrees) {
    return [=](Camera& c) { c.fx = c.fy = c.cx / std::tan(degrees * CV_PI / 360); };
}
Change standing(double height, double pitch) {
    return [=](Camera& c) { c.worldFromCamera = Camera::standing(height, pitch); };
}

std::vector<std::pair<std::string, FramePair>> hostileFrames() {
    std::vector<std::pair<std::string, FramePair>> frames;
    const std::vector<std::pair<std::string, Change>> cameras = {
        {"a view of 179.99 degrees", view(179.99)},
        {"a view of 1e-6 degrees", view(1e-6)},
        {"straight up", standing(1.6, 90)},
        {"straight down", standing(1.6, -90)},
        {"upside down under the ground", standing(-1e4, 180)},
        {"eye at 1e15", standing(1e15, 0)},
        {"eye at -1e15", standing(-1e15, 0)},
        {"no pose", [](Camera& c) { c.worldFromCamera = cv::Matx44d::zeros(); }},
        {"a pose of 1e3", [](Camera& c) { c.worldFromCamera = cv::Matx44d::all(1e3); }},
        {"focal lengths of 1e9", [](Camera& c) { c.fx = c.fy = 1e9; }},
        {"all at the limit", [](Camera& c) {
             c.fx = c.fy = 1e-6;
             c.cx = 1e9;
             c.cy = -1e9;
             c.worldFromCamera = cv::Matx44d::all(-1e3);
             c.worldFromCamera(0, 3) = c.worldFromCamera(1, 3) = 1e15;
         }}};
    for (const auto& [name, change] : cameras) {
        frames.emplace_back(name, frameOf({9, 5}, allKinds()));
        change(frames.back().second.camera);
    }
    for (const float depth : {1e-42f, 1e20f, largest, inf})
        frames.emplace_back("depth " + std::to_string(depth), frameOf({9, 5}, {depth}));
    for (const cv::Size size : {cv::Size(1, 1), cv::Size(1, 13), cv::Size(13, 1)})
        frames.emplace_back("a frame of one row, column or both", frameOf(size, allKinds()));
    for (const double time : {1e300, -1e300}) {
        frames.emplace_back("time", frameOf({9, 5}, allKinds()));
        frames.back().second.time = time;
    }
    return frames;
}

/// What a sidecar's lights and a preset may say where the header states no limit.
void makeUnbounded(const Parameter& p, ParameterValue& value, double number) {
    if (p.type == ParameterType::List) {
        ParameterValues row;
        for (const Parameter& field : p.fields)
            makeUnbounded(field, row[field.name] = field.defaultValue, number);
        value.rows.assign(size_t(std::min(1, p.maxRows)), row);
    } else if (componentCount(p.type) > 0 && p.values.empty() && p.max.empty() && !value.automatic) {
        std::fill(value.numbers.begin(), value.numbers.end(), number);
    }
}

std::vector<std::pair<std::string, ParameterValues>> hostileSets(const EffectHeader& header) {
    CheckOptions options;
    options.randomSets = 1;
    auto sets = checkParameters(header, options);
    std::erase_if(sets, [](const auto& s) { return s.first.ends_with("others random"); });
    ParameterValues planned;  // "auto" where there is a choice
    for (const Parameter& p : header.parameters) planned[p.name] = p.defaultValue;
    sets.emplace_back("planned", planned);
    for (const double number : {1e30, -1e30})
        for (const char* from : {"planned", "default"}) {
            ParameterValues values = from == std::string("planned") ? planned : sets.front().second;
            for (const Parameter& p : header.parameters) makeUnbounded(p, values[p.name], number);
            sets.emplace_back(std::string(from) + ", unbounded", values);
        }
    return sets;
}

bool holdsNan(const cv::Mat& image) {
    const cv::Mat_<float> numbers = image.reshape(1);
    return std::any_of(numbers.begin(), numbers.end(), [](float x) { return std::isnan(x); });
}

class HostileFrames : public testing::TestWithParam<std::string> {};

TEST_P(HostileFrames, LeaveNumbersAtEveryChoice) {
    const auto cpu = makeCpuRunner(true);
    Chain chain;
    chain.steps.resize(1);
    Step& step = chain.steps[0];
    step.effect = EffectRegistry::standard().find(GetParam());
    step.id = step.effect->name();
    const EffectHeader& header = step.effect->header;
    const auto sets = hostileSets(header);
    for (const auto& [name, frame] : hostileFrames()) {
        EXPECT_EQ(problemOf(frame.camera), "") << name;
        for (const auto& [set, values] : sets) {
            SCOPED_TRACE(name + "; " + set);
            step.values = values;
            for (const Parameter& p : header.parameters)
                if (p.type == ParameterType::Image && p.name != header.mainImage())
                    step.values[p.name].text = "captured";
            const RunResult result = applyChain(*cpu, chain, frame, {"transmittance"});
            for (const auto& [image, pixels] : result.images) {
                EXPECT_FALSE(pixels.empty()) << image;
                EXPECT_FALSE(holdsNan(pixels)) << image;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Registry, HostileFrames, testing::ValuesIn(EffectRegistry::standard().names()),
                         [](const auto& info) { return info.param; });

TEST(HostileDepth, EveryPolicyMakesAnEndOfIt) {
    for (const auto& [name, frame] : hostileFrames())
        for (const UnknownDepth unknown : {UnknownDepth::Fill, UnknownDepth::Far, UnknownDepth::Keep})
            for (const SkyPolicy sky : {SkyPolicy::Infinite, SkyPolicy::AtDistance, SkyPolicy::Untouched})
                for (const double smooth : {0., 3.}) {
                    DepthPolicy policy;
                    policy.unknown = unknown;
                    policy.sky = sky;
                    policy.smooth = smooth;
                    EXPECT_FALSE(holdsNan(resolveDepth(frame, policy).frame.depth))
                        << name << ", smooth " << smooth;
                }
}

}  // namespace
