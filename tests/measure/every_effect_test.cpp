// Every effect that is found, GLSL against CPU against reference, as `brume check` does it: a new effect is
// covered by being there.
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "cpu/cpu_runner.hpp"
#include "gl/gl_runner.hpp"
#include "measure/check.hpp"
#include "measure/check_mirror.hpp"

using namespace brume;

namespace {

class EveryEffect : public testing::TestWithParam<std::string> {};

TEST_P(EveryEffect, AgreesWithItselfAndItsReference) {
    static const std::unique_ptr<Runner> cpu = makeCpuRunner(true), gl = makeGlRunner(GlPlatform::Osmesa);
    auto effect = EffectRegistry::standard().find(GetParam());
    size_t parity = 0, reference = 0;
    for (const CheckCase& one : checkEffect(effect, *cpu, *gl, {})) {
        parity += one.parity.compared;
        reference += one.reference.compared;
        EXPECT_TRUE(one.passed()) << one.frame << ", " << one.parameters << ": " << one.problem
                                  << "\n  GLSL against CPU: " << one.parity.describe()
                                  << "\n  against the reference: " << one.reference.describe();
    }
    EXPECT_GT(parity, 10000u) << "GLSL was compared";
    EXPECT_GT(reference, 10000u) << "the reference was asked";
}

// Beside values for which WHEN says that a parameter does not matter, another value of it changes no bit.
TEST_P(EveryEffect, ParametersMatterOnlyWhenTheySaySo) {
    const auto effect = EffectRegistry::standard().find(GetParam());
    const EffectHeader& header = effect->header;
    const std::unique_ptr<Runner> cpu = makeCpuRunner();
    CheckOptions options;
    options.randomSets = 200;
    auto sets = checkParameters(header, options);
    std::vector<FramePair> frames;
    for (const CheckFrame& one : checkFrames())
        if (one.finiteColor && one.frame.size().area() > 100) frames.push_back(one.frame);
    cv::Mat map(32, 32, CV_32F);
    cv::RNG(1).fill(map, cv::RNG::UNIFORM, -3., 3.);
    const auto extras = std::make_shared<const nlohmann::json>(nlohmann::json::parse(
        R"({"lights": [{"type": "directional", "direction": [0.3, 0.5, -0.5], "color": [1, 1, 1],
            "world_to_shadow": [0.01, 0.003, 0.002, 0.5, 0.001, 0.002, 0.012, 0.6, 0.02, 0.7, 0.1, -2, 0, 0, 0, 1]}]})"));
    for (FramePair& frame : frames) {
        frame.images["mirrored"] = mirrored(frame.color);
        frame.images["map"] = map;
        frame.extras = extras;
        frame.time = 3.7;
    }
    for (auto& [name, values] : sets)
        for (const Parameter& p : header.parameters)
            if (p.type == ParameterType::Image && p.name != header.mainImage())
                values[p.name].text = p.resample ? "mirrored" : "map";
    // Every other set is the default but for what WHEN asks about, lest all be lost in dense fog; and numbers
    // that it asks about are often 0.
    auto trial = [&](const Parameter& p, size_t k) {
        ParameterValues values = (k % 2 ? sets[k] : sets[0]).second;
        for (const std::string& name : p.when.names())
            if (const Parameter* asked = findParameter(header.parameters, name)) {
                values[name] = sets[k].second.at(name);
                const bool canBe0 = asked->values.empty() && !asked->min.empty() && asked->min[0] == 0;
                if (canBe0 && k / 2 % 2) values[name].numbers[0] = 0;
            }
        return values;
    };
    auto run = [&](const ParameterValues& values, const FramePair& frame) {
        Chain chain;
        chain.steps.push_back({effect, header.name, values});
        return cpu->run(chain, frame, {"transmittance"}).images;
    };
    for (const Parameter& p : header.parameters) {
        size_t tried = 0;
        for (size_t k = sets.size() - 1; k > 0 && tried < 12; k--) {
            const ParameterValues values = trial(p, k);
            if (isUsed(header, p, values)) continue;
            ParameterValues others = values;
            ParameterValue& other = others[p.name];
            for (size_t j = 1; j < sets.size() && other == values.at(p.name); j++)
                other = sets[(k + j) % sets.size()].second.at(p.name);
            if (p.type == ParameterType::Image) other.text = "captured";
            ASSERT_NE(other, values.at(p.name)) << p.name;
            const auto before = run(values, frames[k % frames.size()]),
                       after = run(others, frames[k % frames.size()]);
            for (const auto& [image, pixels] : before)
                EXPECT_EQ(0,
                          std::memcmp(pixels.data, after.at(image).data, pixels.total() * pixels.elemSize()))
                    << p.name << " changes " << image << " at " << sets[k].first
                    << ", though it should only when " << p.when.source();
            tried++;
        }
        EXPECT_TRUE(p.when.empty() || tried) << p.name << ": WHEN was never 0";
    }
}

INSTANTIATE_TEST_SUITE_P(Registry, EveryEffect, testing::ValuesIn(EffectRegistry::standard().names()),
                         [](const auto& info) { return info.param; });

}  // namespace
