// The map of where methods fail, as every effect's header states it, against what is measured: a new effect,
// or a new regime, is covered by being there.
#include <gtest/gtest.h>

#include "cpu/cpu_runner.hpp"
#include "error.hpp"
#include "gl/gl_runner.hpp"
#include "measure/stability.hpp"

using namespace brume;

namespace {

// One regime, or why an effect's regimes cannot be read: then that test fails, and no other.
struct Case {
    std::string effect, name;
    Regime regime;
    std::string problem;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.effect << ", " << c.name; }

std::vector<Case> allCases() {
    std::vector<Case> all;
    for (const std::string& name : EffectRegistry::standard().names()) try {
            auto effect = EffectRegistry::standard().find(name);
            auto regimes = regimesOf(effect->header, effect->plugin && effect->plugin->hasPlan());
            if (regimes.empty()) all.push_back({name, "STABILITY", {}, "the header declares no STABILITY"});
            for (Regime& regime : regimes) all.push_back({name, regime.name, regime, ""});
        } catch (const Error& e) {
            all.push_back({name, "STABILITY", {}, e.what()});
        }
    return all;
}

class Map : public testing::TestWithParam<Case> {};

TEST_P(Map, IsTrue) {
    static const std::unique_ptr<Runner> cpu = makeCpuRunner(true), gl = makeGlRunner(GlPlatform::Osmesa);
    if (!GetParam().problem.empty()) FAIL() << GetParam().problem;
    const Regime& regime = GetParam().regime;
    auto effect = EffectRegistry::standard().find(regime.effect);
    auto lines = sweepRegime(effect, regime, {cpu.get(), gl.get()});
    ASSERT_FALSE(lines.empty());
    for (const std::string& sentence : contradictions(regime, lines)) ADD_FAILURE() << sentence;
}

std::string testName(const testing::TestParamInfo<Case>& info) {
    std::string name = info.param.effect + "__" + info.param.name;
    for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    return name;
}

INSTANTIATE_TEST_SUITE_P(Registry, Map, testing::ValuesIn(allCases()), testName);

}  // namespace
