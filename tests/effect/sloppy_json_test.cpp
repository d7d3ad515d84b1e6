#include "effect/sloppy_json.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "effect/header.hpp"
#include "error.hpp"

namespace brume {
namespace {

using json = nlohmann::json;
using testing::HasSubstr;

json repaired(const std::string& text) { return json::parse(repairJson(text)); }

TEST(SloppyJson, WhatIsJsonKeepsItsMeaning) {
    const std::string text = R"({"a": [1, -2.5e3, "x\n\"y\" \u00e9", true, null, {}], "b": {"c": []}})";
    EXPECT_EQ(repaired(text), json::parse(text));
    EXPECT_EQ(repaired("\xef\xbb\xbf{\"a\": 1}"), json::parse(R"({"a": 1})"));
}

TEST(SloppyJson, CommasAreAddedAndDropped) {
    const json wanted = json::parse(R"({"a": [1, 2], "b": {"c": 3}})");
    EXPECT_EQ(repaired(R"({"a": [1, 2,], "b": {"c": 3,},})"), wanted);
    EXPECT_EQ(repaired(R"({,"a": [1,, 2] "b": {"c": 3}})"), wanted);
    EXPECT_EQ(repaired(R"({"a": [1 2]; "b" = {"c": 3}};)"), wanted);
    EXPECT_EQ(repaired(R"({"a": , "b": 1})"), json::parse(R"({"a": null, "b": 1})"));
}

TEST(SloppyJson, BracketsAreClosed) {
    EXPECT_EQ(repaired(R"({"a": [{"b": 1}, {"c": 2})"), json::parse(R"({"a": [{"b": 1}, {"c": 2}]})"));
    EXPECT_EQ(repaired(R"({"a": [{"b": 1], "c": 2})"), json::parse(R"({"a": [{"b": 1}], "c": 2})"));
    EXPECT_EQ(repaired(R"({"a": 1}}])"), json::parse(R"({"a": 1})"));
    EXPECT_EQ(repaired(R"({"a": )"), json::parse(R"({"a": null})"));
}

// std::regex took stack for every digit.
TEST(SloppyJson, NumbersOfAnyLength) {
    const std::string zeros(1000000, '0'), ones(1000000, '1');
    EXPECT_EQ(repairJson("[" + zeros + "]"), "[0]");
    EXPECT_EQ(repairJson("[+" + zeros + "12f]"), "[12]");
    EXPECT_EQ(repairJson("[-." + zeros + "]"), "[-0." + zeros + "]");
    EXPECT_EQ(repairJson("[" + ones + "e+" + ones + "]"), "[" + ones + "e+" + ones + "]");
    EXPECT_EQ(repairJson("[" + ones + "x]"), "[\"" + ones + "x\"]");
}

TEST(SloppyJson, NumbersAndWords) {
    EXPECT_EQ(repaired("[.5, 1., +2, -.25, 007, 1.0f, 1.5e2, 0, -0.0]"),
              json::parse("[0.5, 1, 2, -0.25, 7, 1.0, 150.0, 0, -0.0]"));
    EXPECT_EQ(repaired("{name: 'it', on: True, off: NO, what: nan, unit: 2D}"),
              json::parse(R"({"name": "it", "on": true, "off": false, "what": null, "unit": "2D"})"));
}

TEST(SloppyJson, TextOfAnySort) {
    EXPECT_EQ(repaired("[\"a\nb\tc\\d\"]"), json::parse(R"(["a\nb\tc\\d"])"));
    EXPECT_EQ(repaired("[\"caf\xe9 \xc3\xa9\"]"), json::parse("[\"caf? \xc3\xa9\"]"));
    EXPECT_EQ(repaired("{\"a\": 1, // one\n \"b\": 2}"), json::parse(R"({"a": 1, "b": 2})"));
}

TEST(SloppyJson, LinesKeepTheirNumbers) {
    const std::string text = "{\n'a': \"x\ny\",\n\n// c\n'b': [1\n2]\n";
    const std::string result = repairJson(text);
    EXPECT_EQ(std::count(result.begin(), result.end(), '\n'), std::count(text.begin(), text.end(), '\n'));
}

TEST(SloppyJson, AnythingAtAllEnds) {
    uint32_t state = 1;
    const std::string alphabet = "{}[]\":',;/*\\\n \t.+-eE0127a\x80\xc3\xa9\xff";
    for (int round = 0; round < 3000; round++) {
        std::string text;
        for (int k = 0; k < 40; k++) {
            state = state * 1664525u + 1013904223u;
            text += alphabet[(state >> 16) % alphabet.size()];
        }
        repairJson(text);
    }
}

TEST(ForeignHeader, SloppyDescriptionsAreUnderstood) {
    const EffectHeader header = parseHeader("sloppy.fs", R"isf(/*{
    "CATEGORIES": null, "CREDIT": 3,
    "INPUTS": [
        { "NAME": "inputImage", "TYPE": "image", },
        { "NAME": "amount" "TYPE": "Float", "DEFAULT": true, "MIN": .0, "MAX": 1. },
        { "NAME": "place", "TYPE": "point2D", "DEFAULT": 0.5 },
        { "NAME": "tint", "TYPE": "color", "DEFAULT": [1.0, 0.5, 0.25] },
        { "NAME": "mode", "TYPE": "long", "VALUES": ["0", 1], "LABELS": ["a", "b"], "DEFAULT": "1" },
        { "NAME": "on", "TYPE": "bool", "DEFAULT": 0.0, "IDENTITY": 1 },
        { "NAME": "amount", "TYPE": "float" },
        { "TYPE": "float" },
        { "NAME": "odd", "TYPE": "knob" },
        { "NAME": "wave", "TYPE": "audio", "MAX": 256 },
    ],
    "PASSES": [ { "TARGET": "small", "WIDTH": "WIDTH/2.0", "HEIGHT": "max(HEIGHT / 2, amount)", "PERSISTENT": "YES",
                  "FLOAT": 1, "DESCRIPTION": "text" }, null, ]
    "PERSISTENT_BUFFERS": { "other": { "WIDTH": 1 } }
}*/
void main() {}
)isf");
    EXPECT_FALSE(header.linear);
    ASSERT_EQ(header.parameters.size(), 7u);
    EXPECT_EQ(header.parameters[1].defaultValue.numbers, std::vector<double>{1});
    EXPECT_EQ(header.parameters[2].defaultValue.numbers, (std::vector<double>{.5, .5}));
    EXPECT_EQ(header.parameters[3].defaultValue.numbers, (std::vector<double>{1, .5, .25, 1}));
    EXPECT_EQ(header.parameters[4].values, (std::vector<long>{0, 1}));
    EXPECT_EQ(header.parameters[4].defaultValue.numbers, std::vector<double>{1});
    EXPECT_EQ(header.parameters[6].type, ParameterType::Audio);
    ASSERT_EQ(header.passes.size(), 2u);
    EXPECT_TRUE(header.passes[0].persistent && header.passes[0].isFloat);
    EXPECT_EQ(header.passes[0].width.evaluate({{"WIDTH", 7}}), 3.5);
    EXPECT_EQ(header.passes[0].height.evaluate({{"HEIGHT", 6}, {"amount", 9}}), 9);
    EXPECT_EQ(header.bodyLine, 18);
}

std::string repeated(const std::string& piece, size_t bytes) {
    std::string text;
    while (text.size() < bytes) text += piece;
    return text;
}

std::string refusalOf(const std::string& description) {
    try {
        const EffectHeader header = parseHeader("big.fs", "/*" + description + "*/ void main() {}");
        expressionVariables(header, defaultValues(header.parameters));
    } catch (const Error& error) {
        return error.what();
    }
    return "read";
}

// Copying JSON, or writing it, takes stack for each bracket. Brackets that close nothing, or that lie in
// text, do not make it less deep.
TEST(ForeignHeader, BracketsAreCountedAsTheyNest) {
    EXPECT_THAT(refusalOf("{\"DESCRIPTION\": " + repeated("{a: ]", 1 << 20)), HasSubstr("not JSON"));
    EXPECT_THAT(refusalOf("{\"DESCRIPTION\": " + repeated("[}", 1 << 20)), HasSubstr("not JSON"));
    const size_t deep = 200000;
    EXPECT_THAT(refusalOf("{\"A\": 1, \"A\": 2, \"DESCRIPTION\": " + repeated("[\"]\", ", 6 * deep) + "1" +
                          std::string(deep, ']') + "}"),
                HasSubstr("says \"A\" twice"));
    EXPECT_EQ(refusalOf("{\"A\": 1, \"A\": 2, \"DESCRIPTION\": \"" + std::string(100, '[') + "\"}"), "read");
    EXPECT_EQ(refusalOf("{'DESCRIPTION': '" + std::string(100, '[') + "'}"), "read");
}

// Each of these took minutes, or gigabytes, where one part of the file counts for each of another.
TEST(ForeignHeader, TimeAndMemoryGrowAsTheText) {
    const size_t half = 2 << 20;
    EXPECT_EQ(refusalOf("{\"PASSES\": [{\"WIDTH\": \"" + std::string(half, ' ') + "\"}]}"), "read");
    EXPECT_THAT(refusalOf("{\"PASSES\": [{\"WIDTH\": \"+" + std::string(half, ' ') + "1\"}]}"),
                HasSubstr("at most 4096"));
    EXPECT_THAT(refusalOf("{\"PASSES\": [" + repeated("{\"TARGET\":\"a\"},", half) +
                          "{}], \"PERSISTENT_BUFFERS\": [" + repeated("\"b\",", half) + "1]}"),
                HasSubstr("PASSES; at most 256"));
    std::string inputs;
    for (int k = 0; k < 100000; k++) inputs += "{\"NAME\":\"" + std::to_string(k) + "\",\"TYPE\":\"bool\"},";
    EXPECT_THAT(refusalOf("{\"INPUTS\": [" + inputs + "{}]}"), HasSubstr("INPUTS; at most 1024"));
    const std::string longName = std::string(half, 'n'),
                      values = "\"VALUES\": [" + repeated("1,", half) + "1]";
    EXPECT_THAT(refusalOf("{\"INPUTS\": [{\"NAME\": \"" + longName + "\", \"TYPE\": \"long\"}]}"),
                HasSubstr("characters; at most 256"));
    EXPECT_THAT(refusalOf("{\"INPUTS\": [{\"NAME\": \"n\", \"TYPE\": \"long\", " + values + "}]}"),
                HasSubstr("VALUES; at most 4096"));
    std::string cases;
    for (int k = 0; k < 100000; k++) cases += "{\"NAME\":\"" + std::to_string(k) + "\"},";
    cases.back() = ']';
    EXPECT_THAT(refusalOf("{\"SPACE\": \"linear\", \"CHART\": {\"CASES\": [" + cases + "}}"),
                HasSubstr("CASES; at most 256"));
}

TEST(ForeignHeader, BrumesOwnFilesAreHeldToJson) {
    EXPECT_THROW(parseHeader("own.fs", "/*{\"SPACE\": \"linear\",}*/ void main() {}"), Error);
    try {
        parseHeader("hopeless.fs", "/*{\n\n] nonsense */ void main() {}");
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("hopeless.fs:3"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace brume
