#include "effect/header_chart.hpp"

#include <gtest/gtest.h>

#include "effect/effect.hpp"
#include "error.hpp"

namespace brume {
namespace {

EffectHeader withChart(const std::string& chart) {
    return parseHeader("fog.fs", R"(/*{
      "SPACE": "linear",
      "INPUTS": [{"NAME": "inputImage", "TYPE": "image"},
                 {"NAME": "method", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["exact", "march"], "DEFAULT": "auto", "AUTO": true},
                 {"NAME": "steps", "TYPE": "long", "DEFAULT": 32, "MIN": 1, "MAX": 64},
                 {"NAME": "density", "TYPE": "float", "DEFAULT": 0.5}])" +
                                     (chart.empty() ? "" : ", \"CHART\": " + chart) +
                                     "}*/\nvoid main() {}\n");
}

std::string mistake(const std::string& chart) {
    try {
        withChart(chart);
    } catch (const Error& e) {
        return e.what();
    }
    return "no error";
}

TEST(HeaderChart, VariantsAreEveryMethodAndKnobOnEveryCase) {
    auto header = withChart(R"({
      "SET": {"density": 0.25},
      "REFERENCE": {"method": "exact"},
      "CASES": [{"NAME": "thin"}, {"NAME": "thick", "SET": {"density": 2}}],
      "METHODS": [{"NAME": "exact", "SET": {"method": "exact"}},
                  {"NAME": "march", "SET": {"method": "march"}, "KNOB": "steps", "VALUES": [4, 8],
                   "CASES": ["thick"], "BACKENDS": ["cpu"]}]
    })");
    auto variants = chartVariants(header);
    std::vector<std::string> labels;
    for (const auto& v : variants) labels.push_back(v.caseName + ": " + v.label(header));
    EXPECT_EQ(labels, (std::vector<std::string>{"thin: exact", "thick: exact", "thick: march, steps 4",
                                                "thick: march, steps 8"}));
    EXPECT_EQ(variants[0].values.at("density").numbers[0], .25);
    EXPECT_EQ(variants[3].values.at("density").numbers[0], 2);
    EXPECT_EQ(variants[3].values.at("steps").numbers[0], 8);
    EXPECT_EQ(variants[3].values.at("method").numbers[0], 1);
    EXPECT_EQ(variants[3].truth.at("method").numbers[0], 0);
    EXPECT_EQ(variants[3].truth.at("steps").numbers[0], 8);
    EXPECT_TRUE(variants[3].onCpu && !variants[3].onGl);
    EXPECT_EQ(variants[3].given, (std::vector<std::string>{"density", "method", "steps"}));
    EXPECT_EQ(variants[0].values.size(), header.parameters.size());  // complete
}

TEST(HeaderChart, WithoutMethodsEveryChoiceThatAutoHasIsOne) {
    for (const char* chart : {"", "{}"}) {
        auto header = withChart(chart);
        auto variants = chartVariants(header);
        ASSERT_EQ(variants.size(), 2u);
        EXPECT_EQ(variants[1].label(header), "march");
        EXPECT_EQ(variants[1].values.at("method").numbers[0], 1);
        EXPECT_TRUE(variants[1].caseName.empty());
    }
}

TEST(HeaderChart, AnEffectWithoutChoicesIsOneVariantAtItsDefaults) {
    auto header = parseHeader("plain.fs", "/*{\"SPACE\": \"linear\"}*/\nvoid main() {}\n");
    ASSERT_EQ(chartVariants(header).size(), 1u);
    EXPECT_EQ(chartVariants(header)[0].method, "plain");
}

TEST(HeaderChart, MistakesNameThePlaceAndTheNearestName) {
    auto has = [](const std::string& text, const std::string& part) {
        return text.find(part) != std::string::npos ? testing::AssertionSuccess()
                                                    : testing::AssertionFailure() << text;
    };
    EXPECT_TRUE(has(mistake(R"({"METHOD": []})"), "CHART: unknown key 'METHOD' (did you mean 'METHODS'?)"));
    EXPECT_TRUE(has(mistake(R"({"SET": {"densty": 1}})"),
                    "CHART: SET: no parameter 'densty' (did you mean 'density'?)"));
    EXPECT_TRUE(has(mistake(R"({"METHODS": [{"NAME": "a", "KNOBS": "steps"}]})"),
                    "METHODS: 'a': unknown key 'KNOBS' (did you mean 'KNOB'?)"));
    EXPECT_TRUE(has(mistake(R"({"METHODS": [{"NAME": "a", "KNOB": "step", "VALUES": [1]}]})"),
                    "no parameter 'step' (did you mean 'steps'?)"));
    EXPECT_TRUE(
        has(mistake(R"({"METHODS": [{"NAME": "a", "KNOB": "steps"}]})"), "KNOB and VALUES need each other"));
    EXPECT_TRUE(has(mistake(R"({"METHODS": [{"NAME": "a", "KNOB": "steps", "VALUES": [65]}]})"), "64"));
    EXPECT_TRUE(
        has(mistake(R"({"METHODS": [{"NAME": "a", "CASES": ["thick"]}], "CASES": [{"NAME": "thin"}]})"),
            "no case 'thick'"));
    EXPECT_TRUE(has(mistake(R"({"METHODS": [{"NAME": "a"}, {"NAME": "a"}]})"), "'a' is there twice"));
    EXPECT_TRUE(has(mistake(R"({"METHODS": [{"NAME": "a", "BACKENDS": ["gpu"]}]})"), "\"cpu\" and \"gl\""));
    EXPECT_TRUE(has(mistake(R"({"PEERS": [{"NAME": "p", "RUN": "../../bin/sh"}]})"),
                    "RUN must name a program in the effect's own folder"));
}

TEST(HeaderChart, EveryEffectSaysWhatToChart) {
    const EffectRegistry registry({BRUME_BINARY_DIR "/lib/brume/effects"});
    EXPECT_GE(registry.names().size(), 10u);
    for (const std::string& name : registry.names()) {
        auto effect = registry.find(name);
        ASSERT_TRUE(effect->header.chart) << name;
        EXPECT_FALSE(effect->header.chart->methods.empty()) << name;
    }
}

}  // namespace
}  // namespace brume
