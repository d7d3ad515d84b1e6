#include "effect/parameter.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "effect/header.hpp"
#include "error.hpp"

using namespace brume;
using nlohmann::json;

static std::vector<Parameter> parameters() {
    return parseHeader("test.fs", R"(/*{"SPACE": "linear", "INPUTS": [
        {"NAME": "density", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 10, "UNIT": "1/m"},
        {"NAME": "mode", "TYPE": "long", "VALUES": [0, 5], "LABELS": ["plain", "Very Fancy"], "DEFAULT": 0, "AUTO": true},
        {"NAME": "count", "TYPE": "long", "DEFAULT": 3, "MIN": 1, "MAX": 8},
        {"NAME": "on", "TYPE": "bool", "DEFAULT": true},
        {"NAME": "place", "TYPE": "point3D", "DEFAULT": [1, 2, 3]},
        {"NAME": "tint", "TYPE": "color", "DEFAULT": [0.5, 0.5, 0.5]},
        {"NAME": "boxes", "TYPE": "list", "MAX": 2, "FIELDS": [
            {"NAME": "size", "TYPE": "point3D", "DEFAULT": [1, 1, 1]},
            {"NAME": "density", "TYPE": "float", "DEFAULT": 2, "MIN": 0, "MAX": 5}]}
        ]}*/ void main() {})")
        .parameters;
}

static ParameterValue parse(const std::string& name, const json& item) {
    static const auto all = parameters();
    return parseValue(*findParameter(all, name), item, "preset.json: fog");
}
static ParameterValue argument(const std::string& name, const std::string& word) {
    static const auto all = parameters();
    return parseArgument(*findParameter(all, name), word, "--set fog");
}
static std::string mistake(const std::string& name, const json& item) {
    try {
        parse(name, item);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::Usage);
        return error.what();
    }
    return "accepted";
}
static bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

TEST(Parameter, TakesEveryType) {
    EXPECT_EQ(parse("density", 2.5).numbers, std::vector<double>{2.5});
    EXPECT_EQ(parse("mode", "very fancy").numbers, std::vector<double>{5});
    EXPECT_EQ(parse("mode", 5).numbers, std::vector<double>{5});
    EXPECT_TRUE(parse("mode", "auto").automatic);
    EXPECT_EQ(parse("on", false).numbers, std::vector<double>{0});
    EXPECT_EQ(parse("tint", {.1, .2, .3}).numbers, (std::vector<double>{.1, .2, .3, 1}));
    EXPECT_NEAR(parse("tint", "#808080").numbers[0], .2158605, 1e-6);  // sRGB 128/255 in linear light
    auto boxes = parse("boxes", json::parse(R"([{"density": 1}, {"size": [4, 5, 6]}])"));
    EXPECT_EQ(boxes.rows[0].at("size").numbers, (std::vector<double>{1, 1, 1}));
    EXPECT_EQ(boxes.rows[1].at("density").numbers, std::vector<double>{2});
}

TEST(Parameter, ReadsTheCommandLinesForms) {
    EXPECT_EQ(argument("density", ".5").numbers, std::vector<double>{.5});
    EXPECT_EQ(argument("place", "(1,.5,-2)").numbers, (std::vector<double>{1, .5, -2}));
    EXPECT_EQ(argument("on", "true").numbers, std::vector<double>{1});
    EXPECT_EQ(argument("mode", "plain").numbers, std::vector<double>{0});
    EXPECT_EQ(argument("tint", "#ffffff").numbers, (std::vector<double>{1, 1, 1, 1}));
}

TEST(Parameter, NamesWhatIsWrongAndWhatIsRight) {
    EXPECT_TRUE(has(mistake("density", 11),
                    "preset.json: fog.density: 11 is out of range; it must lie from 0 to 10 1/m"));
    EXPECT_TRUE(has(mistake("density", "thick"), "'thick' is not a number"));
    EXPECT_TRUE(has(mistake("density", true), "must be a number"));
    EXPECT_TRUE(has(mistake("density", "auto"), "cannot be \"auto\""));
    EXPECT_TRUE(has(mistake("mode", "fancy"), "did you mean 'Very Fancy'"));
    EXPECT_TRUE(has(mistake("mode", 3), "no choice 3"));
    EXPECT_TRUE(has(mistake("count", 2.5), "whole number"));
    EXPECT_TRUE(has(mistake("count", 1e300), "finite"));
    EXPECT_TRUE(has(mistake("on", 2), "true or false"));
    EXPECT_TRUE(has(mistake("place", {1, 2}), "needs 3 numbers, not 2"));
    EXPECT_TRUE(has(mistake("tint", "#12345"), "#rrggbb"));
    EXPECT_TRUE(
        has(mistake("tint", .5), "needs 3 numbers, not 1; on the command line write '(a,b,c)', in quotes"));
    EXPECT_TRUE(has(mistake("boxes", json::parse("[{}, {}, {}]")), "3 rows, at most 2"));
    EXPECT_TRUE(has(mistake("boxes", json::parse(R"([{}, {"densty": 1}])")),
                    "boxes[1]: no field 'densty' (did you mean 'density'?)"));
    EXPECT_TRUE(
        has(mistake("boxes", json::parse(R"([{"density": 9}])")), "boxes[0].density: 9 is out of range"));
}

TEST(Parameter, SurvivesTheRoundTripThroughJson) {
    const auto all = parameters();
    for (const auto& parameter : all) {
        EXPECT_EQ(parseValue(parameter, toJson(parameter, parameter.defaultValue), ""),
                  parameter.defaultValue);
    }
    const auto* tint = findParameter(all, "tint");
    ParameterValue value{{.1, 1. / 3, .7, .5}};
    EXPECT_EQ(parseValue(*tint, json::parse(toJson(*tint, value).dump()), ""), value);
    const auto* mode = findParameter(all, "mode");
    EXPECT_EQ(toJson(*mode, parse("mode", "auto")), "auto");
    EXPECT_EQ(toJson(*mode, parse("mode", 5)), "Very Fancy");
    EXPECT_EQ(mode->choiceIdentifier(1), "mode_very_fancy");
}
