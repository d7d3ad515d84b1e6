#include "effect/header.hpp"

#include <gtest/gtest.h>

#include "error.hpp"

using namespace brume;

static std::string mistake(const std::string& json) {
    try {
        parseHeader("fog.fs", "/*" + json + "*/\nvoid main() {}\n");
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::Usage);
        return error.what();
    }
    return "accepted";
}
static bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

TEST(Header, ReadsWhatItDeclares) {
    auto header = parseHeader("some/where/blur.fs", R"(/*{
      "SPACE": "linear", "DESCRIPTION": "d", "WRITES": ["transmittance"], // comments are allowed
      "INPUTS": [{"NAME": "inputImage", "TYPE": "image"},
                 {"NAME": "method", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["fir", "recursive"], "DEFAULT": "auto", "AUTO": true}],
      "DERIVED": [{"NAME": "taps", "TYPE": "array", "SIZE": "$count + 1", "FROM": ["method", "camera"]},
                  {"NAME": "count", "TYPE": "int", "FROM": ["method"]}],
      "PASSES": [{"TARGET": "half", "WIDTH": "$WIDTH/2", "HEIGHT": 10, "WHEN": "$method == $method_fir", "REPEAT": "2",
                  "COMPUTE": {"LOCAL_SIZE": [64], "OVER": ["$HEIGHT", 1]}}, {}],
      "TOLERANCE": {"REL": 3e-5, "MEASURED": 0.4, "REASON": "r"}, "CHART": {"METHODS": []}
    }*/
void main() {}
)");
    EXPECT_EQ(header.name, "blur");
    EXPECT_TRUE(header.linear && header.writesTransmittance && !header.pointwise);
    EXPECT_EQ(header.mainImage(), "inputImage");
    EXPECT_TRUE(header.parameters[1].defaultValue.automatic);
    EXPECT_EQ(header.passes.size(), 2u);
    EXPECT_EQ(header.passes[0].compute->localSize[0], 64);
    EXPECT_EQ(header.passes[0].compute->localSize[1], 1);
    EXPECT_EQ(header.passes[0].height.evaluate({}), 10);
    auto variables = expressionVariables(header, defaultValues(header.parameters));
    EXPECT_EQ(header.passes[0].when.evaluate(variables), 1);
    EXPECT_EQ(header.derived[0].size[0].evaluate({{"count", 4}}), 5);
    EXPECT_EQ(header.tolerance.rel, 3e-5);
    EXPECT_EQ(header.tolerance.abs, 1e-6);
    EXPECT_EQ(header.bodyLine, 10);
    EXPECT_TRUE(header.chart);
}

TEST(Header, SaysWhichParametersMatter) {
    const auto header = parseHeader("fog.fs", R"(/*{"SPACE": "linear", "INPUTS": [
      {"NAME": "model", "TYPE": "long", "VALUES": [3, 7], "LABELS": ["plain", "by power"], "DEFAULT": "plain", "AUTO": true},
      {"NAME": "gain", "LABEL": "strength", "TYPE": "float", "DEFAULT": 0},
      {"NAME": "exponent", "TYPE": "float", "DEFAULT": 1, "WHEN": "$model == $model_by_power && $gain > 0"}]}*/
)");
    auto isExponentUsed = [&](ParameterValue model, double gain) {
        return isUsed(header, header.parameters[2],
                      {{"model", model}, {"gain", {{gain}}}, {"exponent", {{1}}}});
    };
    EXPECT_FALSE(isExponentUsed({{3}}, 1));
    EXPECT_FALSE(isExponentUsed({{7}}, 0));
    EXPECT_TRUE(isExponentUsed({{7}}, 1));
    EXPECT_TRUE(isExponentUsed({{3}, "", true}, 1)) << "auto may become anything";
    EXPECT_TRUE(isUsed(header, header.parameters[1], {}));
    EXPECT_EQ(conditionWords(header, header.parameters[2], &Parameter::name),
              "model is 'by power' and gain > 0");
    EXPECT_EQ(conditionWords(header, header.parameters[2], &Parameter::label),
              "model is 'by power' and strength > 0");
    EXPECT_TRUE(has(mistake(R"({"SPACE": "linear", "INPUTS": [
        {"NAME": "a", "TYPE": "float", "DEFAULT": 1, "WHEN": "1 || $aa > 0"}]})"),
                    "INPUTS: 'a': WHEN names $aa (did you mean 'a'?)"));
    EXPECT_TRUE(has(mistake(R"({"SPACE": "linear", "INPUTS": [{"NAME": "a", "TYPE": "list", "MAX": 2,
        "FIELDS": [{"NAME": "b", "TYPE": "float", "DEFAULT": 1, "WHEN": "1"}]}]})"),
                    "a list's field has no WHEN"));
}

TEST(Header, NamesFileKeyAndNearestMatch) {
    EXPECT_TRUE(has(mistake(R"({"SPACE": "linear", "INPUT": []})"),
                    "fog.fs: unknown key 'INPUT' (did you mean 'INPUTS'?)"));
    EXPECT_TRUE(has(mistake("{\"SPACE\": \"linear\",\n\n oops}"), "fog.fs:3: the description is not JSON"));
    auto input = [](const std::string& rest) {
        return R"({"SPACE": "linear", "INPUTS": [{"NAME": "a", )" + rest + "}]}";
    };
    EXPECT_TRUE(has(mistake(input(R"("TYPE": "flaot", "DEFAULT": 0)")),
                    "INPUTS: 'a': unknown TYPE 'flaot' (did you mean 'float'?)"));
    EXPECT_TRUE(has(mistake(input(R"("TYPE": "float")")), "DEFAULT is missing"));
    EXPECT_TRUE(has(mistake(input(R"("TYPE": "float", "DEFAULT": 3, "MAX": 2)")), "3 is out of range"));
    EXPECT_TRUE(has(mistake(input(R"("TYPE": "float", "DEFAULT": 3, "MIN": 4, "MAX": 2)")), "MIN is larger"));
    EXPECT_TRUE(has(mistake(input(R"("TYPE": "long", "DEFAULT": 0, "VALUES": [0, 1], "LABELS": ["x"])")),
                    "2 VALUES but 1 LABELS"));
    EXPECT_TRUE(has(mistake(input(R"("TYPE": "long", "DEFAULT": 0, "VALUES": [0, 6.7e31])")),
                    "VALUES must be no larger than 10^9, not 6.7e+31"));
    for (const char* size : {"[65536, 65536]", "[-32, -32]", "[1e30]"})
        EXPECT_TRUE(
            has(mistake(text(R"({"SPACE": "linear", "PASSES": [{"COMPUTE": {"LOCAL_SIZE": )", size, "}}]}")),
                "LOCAL_SIZE must be numbers of 1 to 1024"))
            << size;
    EXPECT_TRUE(has(mistake(input(R"("TYPE": "list", "MAX": 3)")), "needs FIELDS"));
    EXPECT_TRUE(
        has(mistake(R"({"SPACE": "linear", "DERIVED": [{"NAME": "k", "TYPE": "float", "FROM": ["x"]}]})"),
            "FROM names 'x'"));
    EXPECT_TRUE(has(mistake(R"({"SPACE": "linear", "PASSES": [{"TARGET": "t"}]})"),
                    "the last pass must have no TARGET"));
    EXPECT_TRUE(has(mistake(R"({"SPACE": "linear", "PASSES": [{"WIDTH": "$WIDTH//2"}]})"),
                    "PASSES[0]: WIDTH: size expression"));
    EXPECT_TRUE(has(mistake(R"({"SPACE": "linear", "WRITES": ["depth"]})"), "WRITES may only hold"));
    EXPECT_TRUE(has(mistake(R"({"SPACE": "gamma"})"), "SPACE must be"));
}

TEST(Header, AForeignFileMayBeSloppy) {
    auto header = parseHeader("isf.fs", R"(/*{ "CATEGORIES": null, "SOMETHING": 1, "ISFVSN": 2, "INPUTS": [
        {"NAME": "inputImage", "TYPE": "image"}, {"NAME": "amount", "TYPE": "float", "MIN": 0, "MAX": 2},
        {"NAME": "go", "TYPE": "event"}, {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 0, 0]},
        {"NAME": "flag", "TYPE": "bool", "DEFAULT": 1}, {"NAME": "n", "TYPE": "long", "VALUES": ["3", 4], "LABELS": ["a"]}]
    }*/
void main() { gl_FragColor = vec4(1.0); })");
    EXPECT_FALSE(header.linear);
    EXPECT_EQ(header.passes.size(), 1u);
    EXPECT_EQ(findParameter(header.parameters, "flag")->defaultValue.numbers, std::vector<double>{1});
    EXPECT_EQ(findParameter(header.parameters, "n")->values, (std::vector<long>{3, 4}));
}

TEST(Header, AForeignFilesFrameMayHaveAnyName) {
    auto header = [](const std::string& inputs) {
        return parseHeader("f.fs", "/*{\"INPUTS\": [" + inputs + "]}*/ void main() {}");
    };
    const std::string a = R"({"NAME": "a", "TYPE": "image"})", b = R"({"NAME": "b", "TYPE": "image"})",
                      start = R"({"NAME": "startImage", "TYPE": "image"})",
                      input = R"({"NAME": "inputImage", "TYPE": "image"})";
    EXPECT_EQ(header(a + "," + b).mainImage(), "a");
    EXPECT_EQ(header(a + "," + start).mainImage(), "startImage");
    EXPECT_EQ(header(a + "," + start + "," + input).mainImage(), "inputImage");
    EXPECT_EQ(header(R"({"NAME": "n", "TYPE": "float"})").mainImage(), "");
    auto on = header(R"({"NAME": "x", "TYPE": "bool", "DEFAULT": "TRUE"}, {"NAME": "y", "TYPE": "bool",
                        "DEFAULT": "FALSE"})");
    EXPECT_EQ(on.parameters[0].defaultValue.numbers[0], 1);
    EXPECT_EQ(on.parameters[1].defaultValue.numbers[0], 0);
}

TEST(Header, RefusesWhatIsNoEffect) {
    EXPECT_TRUE(has(mistake(R"({"IMPORTED": [{"NAME": "sky", "PATH": ["a.jpg", "b.jpg"], "TYPE": "cube"}]})"),
                    "'sky' is a cube map of 2 images"));
    for (const char* text :
         {"", "void main() {}", "/* no json */ void main() {}", "/* { ", "/*[]*/", "/*{*/"})
        EXPECT_THROW(parseHeader("x.fs", text), Error) << text;
    std::string deep(100000, '[');
    EXPECT_THROW(parseHeader("x.fs", "/*{\"a\":" + deep + "}*/"), Error);
}
