// brume list, info, check, bench, and the program's own help.
#include <filesystem>
#include <regex>

#include "host/program.hpp"

using testing::HasSubstr;
using Tools = brume::test::Program;
using brume::test::bytesOf;

namespace {

TEST_F(Tools, helpOfEveryCommandHasAnExample) {
    auto ran = brume("--help");
    EXPECT_EQ(ran.status, 0);
    for (std::string command : {"apply", "check", "bench", "chart", "info"}) {
        EXPECT_THAT(ran.out, HasSubstr("  " + command));
        auto help = brume(command + " --help");
        EXPECT_EQ(help.status, 0);
        EXPECT_THAT(help.out, HasSubstr("brume " + command + " "));
    }
    EXPECT_THAT(brume("--version").out, testing::StartsWith("brume "));
    EXPECT_EQ(brume("").status, 2);
}

TEST_F(Tools, listNamesEffectsAndPresets) {
    auto ran = brume("list");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("depth_fog"));
    EXPECT_THAT(ran.out, HasSubstr("Presets"));
    EXPECT_THAT(ran.out, testing::Not(HasSubstr("Refused")));
}

TEST_F(Tools, infoShowsUnitsRangesChoices) {
    auto ran = brume("info depth_fog");
    EXPECT_EQ(ran.status, 0) << ran.err;
    for (const char* part :
         {"visibility", "number in m", "exponential squared", "default", "Where it breaks"})
        EXPECT_THAT(ran.out, HasSubstr(part));
    EXPECT_THAT(ran.out, testing::Not(HasSubstr("[]")));
    const size_t example = ran.out.find("brume apply depth_fog FRAME -o OUT.png --set depth_fog.");
    EXPECT_LT(example, ran.out.find("Parameters")) << "what to type comes before what there is to read";
    EXPECT_LT(ran.out.find("visibility_100"), ran.out.find("Passes"));
    ran = brume("info visibility_200");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("\"visibility\": 200"));
    EXPECT_THAT(ran.out, HasSubstr("visibility_200.json"));
    // What to type does something: alone, fog_blur has no fog to blur by.
    EXPECT_THAT(brume("info fog_blur").out,
                HasSubstr("brume apply gawron_blur_separate FRAME -o OUT.png --set fog_blur."));
    EXPECT_THAT(brume("info volume_fog").out, HasSubstr("brume apply volume_fog FRAME"));
    addText("mine.json", R"({"description": "My own", "effects": [{"effect": "depth_fog"}]})");
    EXPECT_THAT(brume("info mine.json").out, HasSubstr("My own"));
    expectError("info depth_fgo", 2, "'depth_fog'");
    expectError("info morning_mist", 2, "BRUME_EFFECT_PATH");
    expectError("info", 2, "EFFECT");
}

TEST_F(Tools, checkPassesADefaultEffectAndPrintsTheRenderer) {
    auto ran = brume("check debug_depth --random 0");
    EXPECT_EQ(ran.status, 0) << ran.out << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("llvmpipe"));
    EXPECT_THAT(ran.out, HasSubstr("GLSL/CPU on"));
    EXPECT_THAT(ran.out, HasSubstr("reference "));
    EXPECT_EQ(files().size(), 0u);
}

TEST_F(Tools, checkFailsAWrongFileWithStatusOne) {
    addText("grid.fs", R"(/*{"ISFVSN": "2", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}]}*/
void main() { gl_FragColor = vec4(vec3(mod(gl_FragCoord.x, 16.0) < 8.0 ? 1.0 : 0.0), 1.0); }
)");
    auto ran = brume("check grid.fs");
    EXPECT_EQ(ran.status, 1) << ran.out << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("FAILED"));
    EXPECT_THAT(ran.out, HasSubstr("twice the resolution"));
    EXPECT_THAT(ran.out, HasSubstr("GLSL only"));
    EXPECT_TRUE(std::filesystem::exists(path("brume-check/grid")));
    expectError("check depth_fgo", 2, "'depth_fog'");
    expectError("check depth_fog --backend cpu", 2, "--backend");
}

TEST_F(Tools, checkCatchesEveryMistakeOfAPlugin) {
    const std::string broken = BRUME_BINARY_DIR "/tests/effects/broken";
    auto ran = brume("check " + broken + " --random 0 --artefacts '' --verbose");
    EXPECT_EQ(ran.status, 1) << ran.err;
    // What is said in the first failure at each choice.
    auto said = [&](const std::string& mistake) {
        std::smatch match;
        std::regex_search(ran.out, match,
                          std::regex("FAILED on '[a-z_]+', mistake=" + mistake + "\n +(.*)\n"));
        return match.size() > 1 ? match[1].str() : "nothing";
    };
    EXPECT_EQ(said("none"), "nothing");
    EXPECT_THAT(ran.out, testing::Not(HasSubstr("FAILED on 'random', default")));
    EXPECT_THAT(said("writes above"), HasSubstr("wrote outside its output image"));
    EXPECT_THAT(said("writes below"), HasSubstr("wrote outside its output image"));
    EXPECT_THAT(said("moves the data"), HasSubstr("replaced its output image"));
    EXPECT_THAT(said("another size"), HasSubstr("replaced its output image"));
    EXPECT_THAT(said("another local size"), HasSubstr("left unwritten: a pixel of color at (0, 0)"));
    EXPECT_THAT(said("leaves a row"), HasSubstr("left unwritten: a pixel of color at (0, 0)"));
    EXPECT_THAT(said("NaN"), HasSubstr("CPU: NaN in color at (0, 0) from finite input"));
    EXPECT_THAT(said("throws"), HasSubstr("broken.so: run failed: out of fog"));
    EXPECT_THAT(said("throws a number"), HasSubstr("broken.so: run threw something"));
    EXPECT_THAT(said("changes its input"), HasSubstr("changed its input image"));
    EXPECT_THAT(said("counts calls"), HasSubstr("two runs gave different color"));
    EXPECT_THAT(said("derive throws"), HasSubstr("broken.so: derive of 'one' failed: no number today"));

    addFrame("a.exr");
    expectError("apply " + broken + " a.exr -o o.png --set broken.mistake=auto", 1,
                "broken.so: plan failed: no plan today");
}

TEST_F(Tools, aGlslOnlyFileRunsWhereItMust) {
    addFrame("street.exr");
    addText("half.fs", R"(/*{"ISFVSN": "2", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}]}*/
void main() { gl_FragColor = IMG_THIS_PIXEL(inputImage) * vec4(0.5, 0.5, 0.5, 1.0); }
)");
    EXPECT_EQ(brume("apply ./half.fs street.exr -o half.png").status, 0) << "auto takes GL";
    expectError("apply ./half.fs street.exr -o o.png --backend cpu", 2, "GLSL only");
    // What info says to type works, and it claims no check against a half that there is not.
    const auto info = brume("info ./half.fs").out;
    EXPECT_THAT(info, HasSubstr("brume apply ./half.fs FRAME"));
    EXPECT_THAT(info, testing::Not(HasSubstr("Checked to")));
    // A filter needs no depth; a picture without says how.
    ASSERT_EQ(brume("apply debug_depth street.exr -o photo.png").status, 0);
    expectError("apply ./half.fs photo.png -o o.png", 3, "--depth none");
    const auto ran = brume("apply ./half.fs photo.png --depth none -o dark.png");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.err, testing::Not(HasSubstr("camera")));
    ASSERT_EQ(brume("apply gaussian_blur photo.png --depth none -o soft.png").status, 0);
    EXPECT_EQ(brume("apply --like soft.png -o again.png").status, 0);
    EXPECT_TRUE(bytesOf(path("again.png")) == bytesOf(path("soft.png")));
}

TEST_F(Tools, whatIsWrongWithAnEffectIsSaidOnceAndToThePoint) {
    addText("wrong.fs", R"(/*{"ISFVSN": "2", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"},
    {"NAME": "a", "TYPE": "bool"}, {"NAME": "b", "TYPE": "bool"}]}*/
void main() {
    gl_FragColor = IMG_THIS_PIXEL(inputImag);
}
)");
    auto checked = brume("check wrong.fs");
    EXPECT_EQ(checked.status, 1);
    const std::string what = "wrong.fs:4: error: `inputImag' undeclared";
    const size_t first = checked.out.find(what);
    ASSERT_NE(first, std::string::npos) << checked.out;
    EXPECT_EQ(checked.out.find(what, first + 1), std::string::npos) << checked.out;
    addText("comma.fs", "/*{\n\"SPACE\": \"linear\"\n\"ISFVSN\": \"2\"\n}*/\nvoid main() {}\n");
    expectError("check comma.fs", 2,
                "comma.fs:3: the description is not JSON: syntax error while parsing object");
    std::filesystem::create_directories(path("build/effects/mist"));
    addText("build/effects/mist/mist.fs", "/*{}*/ void main() {}\n");
    expectError("check build", 2, "no effect 'build'; for the folder of that name here, say ./build");
    expectError("check ./build", 2, "the folder holds no .fs file; did you mean ./build/effects/mist?");
}

TEST_F(Tools, aSourceThatIsNotBuiltIsNamed) {
    addFrame("street.exr");
    const std::string half = R"(#include "kit/image.glsl"
void main() { store(fetch(inputImage, pixel()) * 0.5); }
)";
    addText("half.fs",
            R"(/*{"ISFVSN": "2", "SPACE": "linear", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}]}*/
)" + half);
    EXPECT_THAT(brume("check half.fs --random 0").out, HasSubstr("it has no C++ half"));
    addText("half.cpp", "int main() {}\n");
    auto checked = brume("check half.fs --random 0");
    EXPECT_EQ(checked.status, 0) << checked.out << checked.err;
    EXPECT_THAT(checked.out, HasSubstr("half.cpp beside it is not built into half.so"));
    EXPECT_THAT(checked.out, HasSubstr("build/effects/half"));
    EXPECT_THAT(checked.out, HasSubstr("NaN from finite input"));
    expectError("apply ./half.fs street.exr -o o.png --backend cpu", 2, "half.cpp beside it is not built");
    addText("half.fs",
            R"(/*{"ISFVSN": "2", "SPACE": "linear", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}],
    "DERIVED": [{"NAME": "one", "TYPE": "float", "FROM": []}]}*/
)" + half);
    expectError("check half.fs", 2, "half.cpp beside it is not built");
}

TEST_F(Tools, benchPrintsMillisecondsAndRatio) {
    auto ran = brume("bench depth_fog --size 64x48 --repetitions 3 --steps");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_TRUE(
        std::regex_search(ran.out, std::regex("depth_fog +cpu +[0-9.]+ \\([0-9.]+ to [0-9.]+\\) +[0-9.]+")))
        << ran.out;
    EXPECT_THAT(ran.out, HasSubstr("llvmpipe"));
    expectError("bench depth_fgo", 2, "'depth_fog'");
    expectError("bench depth_fog --size huge", 2, "huge");
}

}  // namespace
