// Every effect that is found, GLSL against CPU against reference, as `brume check` does it: a new effect is
// covered by being there.
#include <gtest/gtest.h>

#include "cpu/cpu_runner.hpp"
#include "gl/gl_runner.hpp"
#include "measure/check.hpp"

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

INSTANTIATE_TEST_SUITE_P(Registry, EveryEffect, testing::ValuesIn(EffectRegistry::standard().names()),
                         [](const auto& info) { return info.param; });

}  // namespace
