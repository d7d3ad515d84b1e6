// The map of where methods fail, as every effect's header states it, against what is measured: a new effect,
// or a new regime, is covered by being there.
#include <gtest/gtest.h>

#include "cpu/cpu_runner.hpp"
#include "gl/gl_runner.hpp"
#include "measure/stability.hpp"

namespace brume {
static void PrintTo(const Regime& regime, std::ostream* out) { *out << regime.effect << ", " << regime.name; }
}  // namespace brume

using namespace brume;

namespace {

std::vector<Regime> allRegimes() {
    std::vector<Regime> all;
    for (const std::string& name : EffectRegistry::standard().names()) {
        auto effect = EffectRegistry::standard().find(name);
        for (Regime& regime : regimesOf(effect->header, effect->plugin && effect->plugin->hasPlan()))
            all.push_back(std::move(regime));
    }
    return all;
}

class Map : public testing::TestWithParam<Regime> {};

TEST_P(Map, IsTrue) {
    static const std::unique_ptr<Runner> cpu = makeCpuRunner(true), gl = makeGlRunner(GlPlatform::Osmesa);
    auto effect = EffectRegistry::standard().find(GetParam().effect);
    auto lines = sweepRegime(effect, GetParam(), {cpu.get(), gl.get()});
    ASSERT_FALSE(lines.empty());
    for (const std::string& sentence : contradictions(GetParam(), lines)) ADD_FAILURE() << sentence;
}

std::string testName(const testing::TestParamInfo<Regime>& info) {
    std::string name = info.param.effect + "__" + info.param.name;
    for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    return name;
}

INSTANTIATE_TEST_SUITE_P(Registry, Map, testing::ValuesIn(allRegimes()), testName);

TEST(Map, EveryEffectDeclaresItsRegimes) {
    for (const std::string& name : EffectRegistry::standard().names()) {
        auto effect = EffectRegistry::standard().find(name);
        EXPECT_FALSE(regimesOf(effect->header, true).empty()) << name << " declares no STABILITY";
    }
}

}  // namespace
