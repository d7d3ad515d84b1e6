#include <nlohmann/json.hpp>

#include "effect/kit/view.hpp"
#include "gl/program.hpp"
#include "gl_fixture.hpp"

namespace brume {
namespace {

using GlRunnerTest = OnBothPlatforms;
BOTH_PLATFORMS(GlRunnerTest);

const char* const identity = "void main() { store(fetch(inputImage, pixel())); }\n";

TEST_P(GlRunnerTest, APictureComesBackUnchangedAndTheRightWayUp) {
    FramePair frame = probeFrame();
    auto gl = runner();
    RunResult result = gl->run(chainOf({stepOf(linearEffect(inputOnly, identity))}), frame, {});
    EXPECT_EQ(largestDifference(result.images.at("color"), frame.color), 0);
    frame.color = randomImage(33, 17, 1000);
    frame.depth = cv::Mat(17, 33, CV_32F, cv::Scalar(1));
    result = gl->run(chainOf({stepOf(linearEffect(inputOnly, identity))}), frame, {});
    EXPECT_EQ(largestDifference(result.images.at("color"), frame.color), 0);
}

TEST_P(GlRunnerTest, ResultsOutliveLaterFramesOfAnySize) {
    const Chain chain = chainOf({stepOf(linearEffect(inputOnly, identity))});
    auto gl = runner();
    std::vector<FramePair> frames;
    std::vector<RunResult> results;
    for (cv::Size size : {cv::Size(6, 4), cv::Size(1, 1), cv::Size(65, 33), cv::Size(6, 4)}) {
        FramePair frame = probeFrame(size.width, size.height);
        // A part of a larger image, whose rows lie apart.
        const cv::Mat around = randomImage(size.width + 3, size.height + 2, double(frames.size() + 1));
        frame.color = around(cv::Rect(cv::Point(2, 1), size));
        frames.push_back(frame);
        results.push_back(gl->run(chain, frame, {}));
    }
    for (size_t k = 0; k < frames.size(); k++)
        EXPECT_EQ(largestDifference(results[k].images.at("color"), frames[k].color), 0) << k;
    const void* memory = results[0].images.at("color").data;
    results[0] = {};
    const RunResult again = gl->run(chain, frames[0], {});
    EXPECT_EQ(again.images.at("color").data, memory);  // fresh pages cost more than the way to the GPU
}

TEST_P(GlRunnerTest, AnImageOfOneChannelIsGreyAndOpaque) {
    FramePair frame = probeFrame();
    frame.images["mask"] = cv::Mat(frame.size(), CV_32F, cv::Scalar(.25));
    Step step = stepOf(linearEffect(inputOnly, identity));
    step.input = "mask";
    const RunResult result = runner()->run(chainOf({step}), frame, {"mask"});
    const cv::Mat grey(frame.size(), CV_32FC4, cv::Scalar(.25, .25, .25, 1));
    EXPECT_EQ(largestDifference(result.images.at("color"), grey), 0);
    EXPECT_EQ(largestDifference(result.images.at("mask"), grey), 0);
}

TEST_P(GlRunnerTest, PixelsAreAddressedFromTheTopLeft) {
    const auto step =
        stepOf(linearEffect(inputOnly, "void main() { store(vec4(vec2(pixel()), 0.0, 1.0)); }"));
    const cv::Mat color = runner()->run(chainOf({step}), probeFrame(), {}).images.at("color");
    for (int j = 0; j < color.rows; j++)
        for (int i = 0; i < color.cols; i++) EXPECT_EQ(color.at<cv::Vec4f>(j, i), cv::Vec4f(i, j, 0, 1));
}

TEST_P(GlRunnerTest, DepthArrivesWithSkyAndTheRightWayUp) {
    FramePair frame = probeFrame(5, 3);
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < 5; i++) frame.depth.at<float>(j, i) = float(1 + i + 10 * j);
    frame.depth.at<float>(0, 4) = std::numeric_limits<float>::infinity();
    const auto step = stepOf(linearEffect(inputOnly,
                                          "void main() { float z = depthAt(pixel());\n"
                                          "store(vec4(isInf(z) ? -1.0 : z, 0.0, 0.0, 1.0)); }"));
    const cv::Mat color = runner()->run(chainOf({step}), frame, {}).images.at("color");
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < 5; i++)
            EXPECT_EQ(color.at<cv::Vec4f>(j, i)[0], j == 0 && i == 4 ? -1 : 1 + i + 10 * j);
}

TEST_P(GlRunnerTest, EveryParameterTypeReachesTheShader) {
    const auto effect = linearEffect(R"("INPUTS": [{"NAME": "inputImage", "TYPE": "image"},
        {"NAME": "whole", "TYPE": "long", "DEFAULT": 3, "MIN": 0, "MAX": 9},
        {"NAME": "choice", "TYPE": "long", "DEFAULT": 7, "VALUES": [5, 7], "LABELS": ["First one", "second"]},
        {"NAME": "flag", "TYPE": "bool", "DEFAULT": true},
        {"NAME": "real", "TYPE": "float", "DEFAULT": 0.1, "MIN": 0, "MAX": 1},
        {"NAME": "plane", "TYPE": "point2D", "DEFAULT": [1, 2]},
        {"NAME": "space", "TYPE": "point3D", "DEFAULT": [3, 4, 5]},
        {"NAME": "paint", "TYPE": "color", "DEFAULT": [0.1, 0.2, 0.3, 0.4]},
        {"NAME": "boxes", "TYPE": "list", "MAX": 4, "DEFAULT": [],
         "FIELDS": [{"NAME": "on", "TYPE": "bool", "DEFAULT": true},
                    {"NAME": "center", "TYPE": "point3D", "DEFAULT": [0, 0, 0]},
                    {"NAME": "weight", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 10},
                    {"NAME": "kind", "TYPE": "long", "DEFAULT": 1, "MIN": 0, "MAX": 9},
                    {"NAME": "corner", "TYPE": "point2D", "DEFAULT": [0, 0]},
                    {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 1, 1, 1]}]}])",
                                     R"(void main() {
    const int compiledIn[choice == choice_second && flag ? 2 : 1] = int[](choice_first_one, choice);
    int column = pixel().x;
    vec4 color = vec4(real, float(whole), float(compiledIn[1]), float(boxes_count));
    if (column == 1) color = vec4(plane, space.xy);
    if (column == 2) color = paint;
    if (column == 3) color = vec4(boxes[1].center, boxes[1].weight);
    if (column == 4) color = vec4(boxes[1].on, boxes[1].kind, boxes[1].corner);
    if (column == 5) color = boxes[1].tint;
    store(color);
})");
    Step step = stepOf(effect);
    const Parameter& list = *findParameter(effect->header.parameters, "boxes");
    step.values["boxes"] = parseValue(
        list, nlohmann::json::parse(R"([{}, {"center": [7, 8, 9], "weight": 2.5, "kind": 4, "on": true,
                                            "corner": [-1, 0.1], "tint": [0.5, 0.25, 0.125, 1]}])"),
        "test");
    const cv::Mat color = runner()->run(chainOf({step}), probeFrame(), {}).images.at("color");
    const cv::Vec4f expected[] = {{.1f, 3, 7, 2},  {1, 2, 3, 4},    {.1f, .2f, .3f, .4f},
                                  {7, 8, 9, 2.5f}, {1, 4, -1, .1f}, {.5f, .25f, .125f, 1}};
    for (int column = 0; column < 6; column++)
        EXPECT_EQ(color.at<cv::Vec4f>(1, column), expected[column]) << "column " << column;
}

TEST_P(GlRunnerTest, AnEmptyListIsNoRows) {
    const auto effect = linearEffect(
        R"("INPUTS": [{"NAME": "inputImage", "TYPE": "image"}, {"NAME": "rows", "TYPE": "list", "MAX": 4,
           "FIELDS": [{"NAME": "x", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 10}]}])",
        "void main() { float sum = 1.0; for (int k = 0; k < rows_count; k++) sum += rows[k].x; "
        "store(vec4(sum)); }");
    const cv::Mat color = runner()->run(chainOf({stepOf(effect)}), probeFrame(), {}).images.at("color");
    EXPECT_EQ(color.at<cv::Vec4f>(0, 0), cv::Vec4f(1, 1, 1, 1));
}

struct DerivedParams {
    float strength = 0;
};

TEST_P(GlRunnerTest, EveryDerivedTypeReachesTheShader) {
    using P = const DerivedParams&;
    using C = const DeriveContext&;
    EffectOf<DerivedParams> bound;
    bound.bind("strength", &DerivedParams::strength)
        .derive("one", [](P p, C) { return std::vector<double>{p.strength / 3.}; })
        .derive("count", [](P, C) { return std::vector<double>{3}; })
        .derive("three",
                [](P, C) {
                    return std::vector<double>{1, 2, 3};
                })
        .derive("matrix",
                [](P, C) {
                    std::vector<double> m(16);
                    for (int k = 0; k < 16; k++) m[k] = k;
                    return m;
                })
        .derive("table",
                [](P, C) {
                    return std::vector<double>{10, 11, 12};
                })
        .derive("rows", [](P, C) { return std::vector<double>{0, 0, 0, 0, 20, 21, 22, 23}; })
        .derive("volume", [](P, C) {
            std::vector<double> v;
            for (int z = 0; z < 2; z++)
                for (int y = 0; y < 3; y++)
                    for (int x = 0; x < 4; x++) v.push_back(100 * z + 10 * y + x);
            return v;
        });
    auto plugin = std::make_shared<EffectOf<DerivedParams>>(bound);
    const auto effect = linearEffect(
        R"("INPUTS": [{"NAME": "inputImage", "TYPE": "image"},
                      {"NAME": "strength", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 10}],
           "DERIVED": [{"NAME": "one", "TYPE": "float", "FROM": ["strength"]},
                       {"NAME": "count", "TYPE": "int", "FROM": []},
                       {"NAME": "three", "TYPE": "vec3", "FROM": []},
                       {"NAME": "matrix", "TYPE": "mat4", "FROM": []},
                       {"NAME": "table", "TYPE": "array", "SIZE": "$count", "FROM": []},
                       {"NAME": "rows", "TYPE": "vec4 array", "SIZE": 2, "FROM": []},
                       {"NAME": "volume", "TYPE": "volume", "SIZE": [4, 3, 2], "FROM": []}])",
        R"(void main() {
    int column = pixel().x;
    vec4 color = vec4(one, float(count), table[1], table[2]);
    if (column == 1) color = vec4(three, 0.0);
    if (column == 2) color = matrix * vec4(0.0, 1.0, 0.0, 0.0);
    if (column == 3) color = rows[1];
    if (column == 4) color = vec4(texelFetch(volume, ivec3(3, 2, 1), 0).r);
    store(color);
})",
        plugin);
    Step step = stepOf(effect);
    auto gl = runner();
    const cv::Mat color = gl->run(chainOf({step}), probeFrame(), {}).images.at("color");
    const cv::Vec4f expected[] = {
        {float(1. / 3.), 3, 11, 12}, {1, 2, 3, 0}, {1, 5, 9, 13}, {20, 21, 22, 23}, {123, 123, 123, 123}};
    for (int column = 0; column < 5; column++)
        EXPECT_EQ(color.at<cv::Vec4f>(1, column), expected[column]) << "column " << column;
    step.values["strength"].numbers = {6};
    EXPECT_EQ(gl->run(chainOf({step}), probeFrame(), {}).images.at("color").at<cv::Vec4f>(0, 0)[0], 2);
}

TEST_P(GlRunnerTest, PassesRunWhenTheyShouldAsOftenAsTheyShould) {
    const auto effect = linearEffect(
        R"("INPUTS": [{"NAME": "inputImage", "TYPE": "image"},
                      {"NAME": "times", "TYPE": "long", "DEFAULT": 3, "MIN": 0, "MAX": 9},
                      {"NAME": "halve", "TYPE": "bool", "DEFAULT": true}],
           "PASSES": [{"TARGET": "small", "WIDTH": "$WIDTH / 2", "HEIGHT": "$HEIGHT / 2", "WHEN": "$halve"},
                      {"TARGET": "small", "WHEN": "!$halve"},
                      {"TARGET": "sum", "WIDTH": 1, "HEIGHT": 1, "REPEAT": "$times"}, {}])",
        R"(void main() {
#ifdef PASS_small
    store(vec4(float(passSize.x), float(passSize.y), float(view_size.x), 1.0));
#endif
#ifdef PASS_sum
    store(fetch(sum, ivec2(0)) + vec4(1.0, float(passRepeat), 0.0, 0.0));
#endif
#ifdef PASS_output
    store(pixel().y == 0 ? fetch(small, ivec2(0)) : fetch(sum, ivec2(0)));
#endif
})");
    Step step = stepOf(effect);
    auto gl = runner();
    RunResult result = gl->run(chainOf({step}), probeFrame(6, 4), {});
    EXPECT_EQ(result.images.at("color").at<cv::Vec4f>(0, 0), cv::Vec4f(3, 2, 6, 1));
    EXPECT_EQ(result.images.at("color").at<cv::Vec4f>(1, 0), cv::Vec4f(3, 0 + 1 + 2, 0, 0));
    ASSERT_EQ(result.timings.size(), 3u);
    EXPECT_EQ(result.timings[0].name, "test_effect/small");
    EXPECT_EQ(result.timings[2].name, "test_effect/output");
    step.values["halve"].numbers = {0};
    step.values["times"].numbers = {0};
    result = gl->run(chainOf({step}), probeFrame(6, 4), {});
    EXPECT_EQ(result.images.at("color").at<cv::Vec4f>(0, 0), cv::Vec4f(6, 4, 6, 1));
    EXPECT_EQ(result.images.at("color").at<cv::Vec4f>(1, 0), cv::Vec4f(0, 0, 0, 0)) << "from the run before";
}

TEST_P(GlRunnerTest, ComputePassesRunOverRows) {
    // A running sum along each row, one invocation a row.
    const auto effect = linearEffect(
        R"("INPUTS": [{"NAME": "inputImage", "TYPE": "image"}],
           "PASSES": [{"TARGET": "sums", "COMPUTE": {"LOCAL_SIZE": [16, 1], "OVER": ["$HEIGHT", 1]}},
                      {"COMPUTE": {"LOCAL_SIZE": [8, 8]}}])",
        R"(void main() {
#ifdef PASS_sums
    int row = int(gl_GlobalInvocationID.x);
    if (row >= passSize.y) return;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < passSize.x; i++) {
        sum += fetch(inputImage, ivec2(i, row));
        storePixel(ivec2(i, row), sum);
    }
#else
    store(fetch(sums, pixel()) * 2.0);
#endif
})");
    FramePair frame = probeFrame(37, 21);
    frame.color = randomImage(37, 21);
    const cv::Mat color = runner()->run(chainOf({stepOf(effect)}), frame, {}).images.at("color");
    for (int j = 0; j < 21; j++) {
        cv::Vec4f sum(0, 0, 0, 0);
        for (int i = 0; i < 37; i++) {
            sum += frame.color.at<cv::Vec4f>(j, i);
            ASSERT_EQ(color.at<cv::Vec4f>(j, i), sum * 2.f) << i << ", " << j;
        }
    }
}

TEST_P(GlRunnerTest, PersistentTargetsSurviveBetweenRuns) {
    const auto effect = linearEffect(
        R"("INPUTS": [{"NAME": "inputImage", "TYPE": "image"}],
           "PASSES": [{"TARGET": "memory", "PERSISTENT": true}, {}])",
        R"(void main() {
#ifdef PASS_memory
    store(fetch(memory, pixel()) + vec4(1.0));
#else
    store(fetch(memory, pixel()));
#endif
})");
    Step once = stepOf(effect), other = stepOf(effect);
    other.id = "other";
    auto gl = runner();
    for (int frame = 1; frame <= 3; frame++)
        EXPECT_EQ(gl->run(chainOf({once}), probeFrame(), {}).images.at("color").at<cv::Vec4f>(2, 2)[0],
                  frame);
    EXPECT_EQ(gl->run(chainOf({other}), probeFrame(), {}).images.at("color").at<cv::Vec4f>(2, 2)[0], 1)
        << "two steps do not share a memory";
    EXPECT_EQ(gl->run(chainOf({once}), probeFrame(8, 8), {}).images.at("color").at<cv::Vec4f>(2, 2)[0], 1)
        << "another size starts afresh";
}

TEST_P(GlRunnerTest, TransmittanceIsMultipliedOnlyWhereItIsRead) {
    const std::string keys = std::string(inputOnly) + R"(, "WRITES": ["transmittance"])";
    const char* const body =
        "void main() { store(fetch(inputImage, pixel()));\n"
        "storeTransmittance(vec3(0.3, 0.7, float(pixel().x) / 7.0)); }";
    const Step fog = stepOf(linearEffect(keys, body));
    auto gl = runner();
    EXPECT_EQ(gl->run(chainOf({fog}), probeFrame(), {}).images.count("transmittance"), 0u);
    const cv::Mat twice =
        gl->run(chainOf({fog, fog}), probeFrame(), {"transmittance"}).images.at("transmittance");
    for (int i = 0; i < 6; i++) {
        const cv::Vec4f value = twice.at<cv::Vec4f>(1, i);
        const float share = float(i) / 7.f;
        EXPECT_EQ(value[0], .3f * .3f);
        EXPECT_EQ(value[1], .7f * .7f);
        EXPECT_NEAR(value[2], share * share, 2e-7);  // GLSL may divide with an error of 2.5 ulp
        EXPECT_EQ(value[3], 1);
    }
    EXPECT_EQ(shaderSource(fog, 0).find("#define BRUME_TRANSMITTANCE") != std::string::npos, true);

    Step reader = stepOf(linearEffect(
        R"("INPUTS": [{"NAME": "inputImage", "TYPE": "image"}, {"NAME": "seen", "TYPE": "image"}],
           "WRITES": ["transmittance"])",
        "void main() { store(fetch(seen, pixel())); storeTransmittance(vec3(0.5)); }"));
    reader.values["seen"].text = "transmittance";
    const RunResult both = gl->run(chainOf({fog, reader}), probeFrame(), {"transmittance"});
    EXPECT_EQ(both.images.at("color").at<cv::Vec4f>(0, 0)[0], .3f);
    EXPECT_EQ(both.images.at("transmittance").at<cv::Vec4f>(0, 0)[0], .15f);

    // Read from the neighbour, so that reading what is being written would show.
    Step shifted = stepOf(linearEffect(
        R"("INPUTS": [{"NAME": "inputImage", "TYPE": "image"}, {"NAME": "seen", "TYPE": "image"}],
           "WRITES": ["transmittance"])",
        "void main() { store(fetch(seen, pixel() - ivec2(1, 0))); storeTransmittance(vec3(0.0)); }"));
    shifted.values["seen"].text = "transmittance";
    const cv::Mat seen = gl->run(chainOf({fog, shifted}), probeFrame(), {}).images.at("color");
    for (int i = 1; i < 6; i++) EXPECT_NEAR(seen.at<cv::Vec4f>(2, i)[2], (i - 1) / 7., 1e-7);
}

TEST_P(GlRunnerTest, ImagesOfAnotherSizeAreResampledAsOnTheCpu) {
    Step small = stepOf(linearEffect(
        std::string(inputOnly) + R"(, "PASSES": [{"WIDTH": "$WIDTH / 3", "HEIGHT": "$HEIGHT - 5"}])",
        "void main() { store(fetch(inputImage, pixel() * 3)); }"));
    small.id = "small";
    small.output = "thumbnail";
    Step use = stepOf(linearEffect(
        R"("INPUTS": [{"NAME": "inputImage", "TYPE": "image"}, {"NAME": "other", "TYPE": "image"}])",
        "void main() { store(fetch(other, pixel())); }"));
    use.values["other"].text = "thumbnail";
    FramePair frame = probeFrame(31, 23);
    frame.color = randomImage(31, 23, 10);
    const RunResult result = runner()->run(chainOf({small, use}), frame, {"thumbnail"});
    const cv::Mat thumbnail = result.images.at("thumbnail");
    EXPECT_EQ(thumbnail.size(), cv::Size(10, 18));
    const cv::Mat expected = resampleLinear(thumbnail, frame.size());
    EXPECT_LE(largestDifference(result.images.at("color"), expected), 4e-6);  // the division's 2.5 ulp, of 10

    // Its camera is of its own size.
    Step rays = stepOf(linearEffect(
        std::string(inputOnly) + R"(, "PASSES": [{"WIDTH": "$WIDTH / 3", "HEIGHT": "$HEIGHT - 5"}])",
        "void main() { store(vec4(rayOf(pixel()), 1.0)); }"));
    const cv::Mat seen = runner()->run(chainOf({rays}), frame, {}).images.at("color");
    ASSERT_EQ(seen.size(), cv::Size(10, 18));
    const View view = View::of(frame.camera, 10, 18, 31, 23);
    for (int j = 0; j < 18; j++)
        for (int i = 0; i < 10; i++)
            EXPECT_EQ(seen.at<cv::Vec4f>(j, i), cv::Vec4f(view.rayX(i), view.rayY(j), -1, 1))
                << i << ", " << j;

    FramePair deep = probeFrame(31, 23);
    for (int j = 0; j < 23; j++)
        for (int i = 0; i < 31; i++) deep.depth.at<float>(j, i) = float(i + 100 * j);
    Step depths =
        stepOf(linearEffect(inputOnly, "void main() { store(vec4(depthAt(pixel()), 0.0, 0.0, 1.0)); }"));
    depths.input = depths.output = "thumbnail";
    const cv::Mat nearest =
        runner()->run(chainOf({small, depths}), deep, {"thumbnail"}).images.at("thumbnail");
    const cv::Mat wanted = resampleNearest(deep.depth, thumbnail.size());
    for (int j = 0; j < wanted.rows; j++)
        for (int i = 0; i < wanted.cols; i++)
            EXPECT_EQ(nearest.at<cv::Vec4f>(j, i)[0], wanted.at<float>(j, i)) << i << ", " << j;
}

TEST_P(GlRunnerTest, AnUnwrittenPixelIsAnError) {
    const auto step = stepOf(
        linearEffect(inputOnly, "void main() { if (pixel() == ivec2(3, 2)) discard; store(vec4(1.0)); }"));
    try {
        runner()->run(chainOf({step}), probeFrame(), {});
        FAIL() << "not noticed";
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::CheckFailed);
        EXPECT_NE(std::string(error.what()).find("row 2"), std::string::npos) << error.what();
    }
}

TEST_P(GlRunnerTest, MistakesNameFileAndLine) {
    const auto messageOf = [&](const std::shared_ptr<Effect>& effect) -> std::string {
        try {
            runner()->run(chainOf({stepOf(effect)}), probeFrame(), {});
        } catch (const Error& error) {
            return error.what();
        }
        return "nothing was wrong";
    };
    const std::string own = messageOf(linearEffect(inputOnly, "\nvoid main() {\n    store(nothing);\n}\n"));
    EXPECT_NE(own.find("test_effect.fs:6: "), std::string::npos) << own;
    const std::string named = messageOf(
        linearEffect(R"("INPUTS": [{"NAME": "half", "TYPE": "bool", "DEFAULT": true}])", "void main() {}"));
    EXPECT_NE(named.find("'half' is reserved"), std::string::npos) << named;
    const std::string included = messageOf(
        linearEffect(inputOnly, "#include \"mistake.glsl\"\nvoid main() { store(vec4(mistaken())); }\n"));
    EXPECT_NE(included.find("mistake.glsl:3: "), std::string::npos) << included;
}

TEST_P(GlRunnerTest, UnknownImagesAreNamed) {
    Step step = stepOf(linearEffect(inputOnly, identity));
    step.input = "nowhere";
    EXPECT_THROW(runner()->run(chainOf({step}), probeFrame(), {}), Error);
    EXPECT_THROW(runner()->run(chainOf({}), probeFrame(), {"nowhere"}), Error);
}

TEST_P(GlRunnerTest, SaysWhereItRan) {
    const std::string description = runner()->describe();
    EXPECT_NE(description.find(GetParam() == GlPlatform::Osmesa ? "OSMesa: " : "EGL "), std::string::npos);
    EXPECT_NE(description.find(", 4."), std::string::npos) << description;
}

TEST(ShaderLog, PlacesOfThreeDriversAreMapped) {
    const std::vector<std::string> files = {"fog.fs", "kit/image.glsl"};
    EXPECT_EQ(mapShaderLog("1:12(5): error: no\n", files), "kit/image.glsl:12: error: no");
    EXPECT_EQ(mapShaderLog("0(7) : error C1008: undefined", files), "fog.fs:7: error C1008: undefined");
    EXPECT_EQ(mapShaderLog("ERROR: 0:3: 'x' : undeclared", files), "fog.fs:3: ERROR: 'x' : undeclared");
}

}  // namespace
}  // namespace brume
