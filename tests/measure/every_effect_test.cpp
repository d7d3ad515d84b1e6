// Every effect that is found, GLSL against CPU against reference, as `brume check` does it: a new effect is
// covered by being there.
#include <gtest/gtest.h>

#include <cstring>

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
    options.randomSets = 60;
    auto sets = checkParameters(header, options);
    std::vector<FramePair> frames;
    for (const CheckFrame& one : checkFrames())
        if (one.finiteColor && one.frame.size().area() > 100) frames.push_back(one.frame);
    for (FramePair& frame : frames) frame.images["mirrored"] = mirrored(frame.color);
    for (auto& [name, values] : sets)
        for (const Parameter& p : header.parameters)
            if (p.type == ParameterType::Image && p.name != header.mainImage())
                values[p.name].text = "mirrored";
    auto run = [&](const ParameterValues& values, const FramePair& frame) {
        Chain chain;
        chain.steps.push_back({effect, header.name, values});
        return cpu->run(chain, frame, {"transmittance"}).images;
    };
    for (const Parameter& p : header.parameters) {
        size_t tried = 0;
        for (size_t k = 0; k < sets.size() && tried < 20; k++) {
            const auto& [name, values] = sets[k];
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
                    << p.name << " changes " << image << " at " << name << ", though it should only when "
                    << p.when.source();
            tried++;
        }
        EXPECT_TRUE(p.when.empty() || tried) << p.name << ": WHEN was never 0";
    }
}

INSTANTIATE_TEST_SUITE_P(Registry, EveryEffect, testing::ValuesIn(EffectRegistry::standard().names()),
                         [](const auto& info) { return info.param; });

}  // namespace
