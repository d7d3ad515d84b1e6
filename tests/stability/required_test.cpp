// The regimes that every release must survive: what a header may not drop, nor hold less of.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "error.hpp"
#include "measure/stability.hpp"

namespace {

using namespace brume;

struct Required {
    std::string effect, regime;
    double from, to;                 ///< of the stress: swept, and held by each of `lines` on both backends
    std::vector<std::string> lines;  ///< methods, or "auto"
    std::vector<double> refused;     ///< values that MIN and MAX must refuse
};
void PrintTo(const Required& r, std::ostream* out) { *out << r.effect << ", " << r.regime; }

const double inf = HUGE_VAL;

const std::vector<Required> required = {
    // the change of height along the way → 0
    {"height_fog", "level ways", 1e-9, 1000, {"closed form", "auto"}, {}},
    {"height_fog", "level ways through a ramp", 1e-9, 1000, {"closed form", "auto"}, {}},
    {"height_fog", "steep falloff", 1e-3, 1000, {"closed form", "auto"}, {}},
    // σ and τ from .1 to 1000
    {"gaussian_blur", "radius", .1, 1000, {"auto"}, {}},
    {"gaussian_blur", "radius out of range", 0, 0, {"auto"}, {-1, 1001, inf}},
    {"bessel_blur", "radius", .1, 1000, {"auto"}, {}},
    {"bessel_blur", "radius out of range", 0, 0, {"auto"}, {-1, 1001, inf}},
    {"fog_blur", "radius", .1, 64, {"gather", "auto"}, {65, 1000, inf}},
    {"fog_blur", "radius, edges kept", .1, 64, {"gather", "auto"}, {65}},
    // world offset to 1e7
    {"height_fog", "world offset", 1, 1e7, {"closed form", "auto"}, {}},
    {"noise_fog", "far noise coordinates", 1, 1e7, {"procedural", "auto"}, {}},
    {"noise_fog", "far noise coordinates along the ray", 1, 1e7, {"procedural", "auto"}, {}},
    {"volume_fog", "far noise coordinates", 1, 1e7, {"midpoint"}, {}},
    {"volume_fog", "world offset", 1, 1e5, {"midpoint", "auto"}, {1e6, 1e7}},
    // optical depth from 1e-9 to 1e3
    {"depth_fog", "optical depth", 1e-9, 1000, {"exponential", "exponential squared"}, {}},
    {"height_fog", "optical depth", 1e-9, 1000, {"closed form", "auto"}, {}},
    {"noise_fog", "optical depth", 1e-9, 1000, {"procedural", "auto"}, {}},
    {"noise_fog", "optical depth along the ray", 1e-9, 1000, {"procedural", "baked", "auto"}, {}},
    {"noise_fog", "optical depth of the product", 1e-9, 1000, {"product"}, {}},
    {"volume_fog", "optical depth", 1e-9, 1000, {"auto"}, {}},
    {"light_detect", "attenuation", 1e-9, 1000, {"encoded"}, {}},
    // steps against box edges
    {"volume_fog", "steps in a box", 1, 512, {"auto"}, {}},
    {"volume_fog", "steps in a box", 16, 512, {"midpoint", "gauss_legendre"}, {}},
    {"volume_fog", "thin box", 0, 0, {"auto"}, {}},
    {"volume_fog", "thin box", 1e-4, 10, {"auto"}, {}},
    {"volume_fog", "ray along a face", -1e-3, 1e-3, {"auto"}, {}},
    // the distance of a light → 0
    {"volume_fog", "lamp near the ray", 0, 10, {"equiangular", "auto"}, {}},
    {"volume_fog", "lamp near the eye", 0, 10, {"equiangular", "auto"}, {}},
    // exponents
    {"depth_fog", "power exponent", .05, 16, {"power"}, {-1, 0, 20}},
    {"depth_fog", "sun exponent", .05, 256, {"sun ahead", "sun overhead", "sun behind"}, {-1, 0, 300}},
    {"depth_fog", "forward lobe", .01, 1, {"forward", "backward"}, {}},
    {"depth_fog", "just behind the start", 1, 1e5, {"exponential", "power 1", "power 0.55"}, {}},
    {"depth_fog", "just behind the start", 100, 1e5, {"power 0.25", "power 0.05"}, {}},
    {"noise_fog", "power exponent", .05, 16, {"power"}, {-1, 0, 20}},
    {"noise_fog",
     "sun exponent",
     .05,
     256,
     {"sun ahead", "sun overhead", "sun behind", "offset"},
     {-1, 0, 300}},
    {"fog_blur", "falloff", .25, 8, {"gather", "auto"}, {-1, 0, 9}},
    {"light_detect", "curve", .25, 8, {"encoded", "linear"}, {-1, 0, 9}},
    // bits of depth, reversed or not, with and without a far plane
    {"depth_fog",
     "depth read from a depth buffer",
     .1,
     1000,
     {"24 bits", "24 bits reversed", "32-bit float", "32-bit float reversed", "24 bits infinite",
      "24 bits reversed infinite", "32-bit float infinite", "32-bit float reversed infinite"},
     {}},
    {"depth_fog", "depth read from a depth buffer", .1, 100, {"16 bits", "16 bits reversed"}, {}},
    {"depth_fog", "depth", 0, inf, {"exponential", "exponential squared", "linear", "power"}, {}},
    // noise coordinates
    {"noise_fog", "long after the start", 1, 1e7, {"procedural", "auto"}, {}},
    {"noise_fog", "fine noise, few texels", 2, 32, {"procedural", "auto"}, {}},
};

class RequiredRegime : public testing::TestWithParam<Required> {};

// That HOLDS is true is the map's test.
TEST_P(RequiredRegime, IsSweptAndHeld) {
    const Required& r = GetParam();
    auto effect = EffectRegistry::standard().find(r.effect);
    auto regimes = regimesOf(effect->header, effect->plugin && effect->plugin->hasPlan());
    auto regime =
        std::find_if(regimes.begin(), regimes.end(), [&](const Regime& g) { return g.name == r.regime; });
    ASSERT_NE(regime, regimes.end()) << "no such regime";
    std::vector<double> swept;
    for (double value : regime->values)
        if (value >= r.from * (1 - 1e-9 * (r.from > 0)) && value <= r.to * (1 + 1e-9)) swept.push_back(value);
    ASSERT_FALSE(swept.empty());
    EXPECT_DOUBLE_EQ(swept.front(), r.from);
    EXPECT_DOUBLE_EQ(swept.back(), r.to);
    EXPECT_GE(swept.size(), r.to > r.from ? 4u : 1u) << "a sweep needs points";
    for (size_t k = 0; r.from > 0 && k + 1 < swept.size(); k++)
        EXPECT_LE(swept[k + 1], 100.001 * swept[k]) << "nothing is swept over two decades";
    for (double value : swept) EXPECT_FALSE(regime->isRefused(value)) << value;
    for (double value : r.refused) EXPECT_TRUE(regime->isRefused(value)) << value << " must be refused";
    for (const std::string& name : r.lines) {
        auto line = std::find_if(regime->lines.begin(), regime->lines.end(),
                                 [&](const RegimeLine& l) { return l.name == name; });
        ASSERT_NE(line, regime->lines.end()) << "no line '" << name << "'";
        EXPECT_TRUE(line->onGl) << name << " is not swept in GLSL";
        for (double value : swept) EXPECT_TRUE(line->holdsAt(value)) << name << " at " << value;
    }
}

std::string testName(const testing::TestParamInfo<Required>& info) {
    std::string name = info.param.effect + "__" + info.param.regime + "__" + stressText(info.param.from) +
                       "_to_" + stressText(info.param.to);
    for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    return name;
}

INSTANTIATE_TEST_SUITE_P(Table, RequiredRegime, testing::ValuesIn(required), testName);

}  // namespace
