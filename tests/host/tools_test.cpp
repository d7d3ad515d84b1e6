// brume list, info, check, bench, and the program's own help.
#include <filesystem>
#include <regex>

#include "host/program.hpp"

using testing::HasSubstr;
using Tools = brume::test::Program;

namespace {

TEST_F(Tools, helpOfEveryCommandHasAnExample) {
    auto ran = brume("--help");
    EXPECT_EQ(ran.status, 0);
    for (std::string command : {"apply", "check", "bench", "info"}) {
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
    expectError("info depth_fgo", 2, "'depth_fog'");
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
    EXPECT_THAT(ran.out, HasSubstr("half the resolution"));
    EXPECT_THAT(ran.out, HasSubstr("GLSL only"));
    EXPECT_TRUE(std::filesystem::exists(path("brume-check/grid")));
    expectError("check depth_fgo", 2, "'depth_fog'");
    expectError("check depth_fog --backend cpu", 2, "--backend");
}

TEST_F(Tools, aGlslOnlyFileRunsWhereItMust) {
    addFrame("street.exr");
    addText("half.fs", R"(/*{"ISFVSN": "2", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}]}*/
void main() { gl_FragColor = IMG_THIS_PIXEL(inputImage) * vec4(0.5, 0.5, 0.5, 1.0); }
)");
    EXPECT_EQ(brume("apply ./half.fs street.exr -o half.png").status, 0) << "auto takes GL";
    expectError("apply ./half.fs street.exr -o o.png --backend cpu", 2, "GLSL only");
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
