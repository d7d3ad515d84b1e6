// brume chart, the real program on tiny frames.
#include <filesystem>

#include "host/program.hpp"

using testing::HasSubstr;
using Chart = brume::test::Program;

namespace {

TEST_F(Chart, writesTablePicturesAndAPageForEveryEffectNamed) {
    addFrame("street.exr");
    auto ran = brume(
        "chart depth_fog blend -o charts --frame street.exr --repetitions 3 --seconds .01 --pixels 200");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("charts/index.html"));
    for (std::string name : {"depth_fog", "blend"})
        for (std::string ending : {".csv", ".svg", ".png"})
            EXPECT_TRUE(std::filesystem::exists(path("charts/" + name + ending))) << name << ending;
    const std::string csv = brume::test::bytesOf(path("charts/depth_fog.csv"));
    EXPECT_THAT(csv, HasSubstr("depth_fog,exponential squared,closed form,,,cpu,"));
    EXPECT_THAT(csv, HasSubstr("llvmpipe"));
    EXPECT_THAT(csv, HasSubstr(",street,"));
    const std::string page = brume::test::bytesOf(path("charts/index.html"));
    EXPECT_THAT(page, HasSubstr("id=\"depth_fog\""));
    EXPECT_THAT(page, HasSubstr("id=\"blend\""));
    EXPECT_THAT(page, testing::Not(HasSubstr("data:image/png"))) << "rounding alone needs no map";

    // A piece made later joins the page.
    ran = brume(
        "chart noise_fog -o charts --size 32x18 --backend cpu --repetitions 3 --seconds .01 --pixels 50");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(brume::test::bytesOf(path("charts/index.html")), HasSubstr("id=\"blend\""));
    EXPECT_THAT(brume::test::bytesOf(path("charts/index.html")), HasSubstr("id=\"noise_fog\""));
    EXPECT_THAT(brume::test::bytesOf(path("charts/index.html")), HasSubstr("data:image/png;base64,"))
        << "maps";
}

TEST_F(Chart, stabilityJoinsThePage) {
    auto ran = brume("chart --stability debug_depth -o charts --backend cpu");
    EXPECT_EQ(ran.status, 0) << ran.err;
    for (std::string ending : {".csv", ".svg", ".png"})
        EXPECT_TRUE(std::filesystem::exists(path("charts/stability.debug_depth" + ending))) << ending;
    EXPECT_THAT(brume::test::bytesOf(path("charts/stability.debug_depth.csv")),
                HasSubstr("debug_depth,depth,depth,m,debug_depth,cpu,0,"));
    EXPECT_THAT(brume::test::bytesOf(path("charts/index.html")), HasSubstr("Where methods fail"));
    ran = brume(
        "chart debug_depth -o charts --size 32x18 --backend cpu --repetitions 3 --seconds .01 --pixels 50");
    EXPECT_EQ(ran.status, 0) << ran.err;  // stability's tables are no measurements
    EXPECT_THAT(brume::test::bytesOf(path("charts/index.html")), HasSubstr("Where methods fail"));
}

TEST_F(Chart, anyFileByPathAndWithoutAReferenceIsTimed) {
    addText("half.fs", R"(/*{"ISFVSN": "2", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}]}*/
void main() { gl_FragColor = IMG_THIS_PIXEL(inputImage) * vec4(0.5, 0.5, 0.5, 1.0); }
)");
    auto ran = brume("chart half.fs -o charts --size 32x18 --repetitions 3 --seconds .01");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(brume::test::bytesOf(path("charts/half.csv")), HasSubstr("half,,half,,,gl,"));
    EXPECT_THAT(brume::test::bytesOf(path("charts/index.html")), HasSubstr("no reference"));
    expectError("chart half.fs -o none --size 32x18 --backend cpu", 2, "nothing of half runs on cpu");
}

TEST_F(Chart, papersPutTheirFiguresBesideOurs) {
    auto ran = brume("chart --papers -o charts --size 32x18 --backend cpu");
    EXPECT_EQ(ran.status, 0) << ran.err;
    const std::string page = brume::test::bytesOf(path("charts/papers.html"));
    for (const char* part : {"0.65 ms", "73.0/77-78/82.1", "Banding against jitter", "to 3.08 ms", "glued"})
        EXPECT_THAT(page, HasSubstr(part));
    EXPECT_THAT(brume::test::bytesOf(path("charts/papers.csv")), HasSubstr("\"trial 3: box, noise, lamp\""));
    expectError("chart depth_fog --papers -o charts", 2, "--papers");
}

TEST_F(Chart, mistakesAreSentences) {
    expectError("chart depth_fgo -o charts", 2, "'depth_fog'");
    expectError("chart depth_fog -o charts --size huge", 2, "huge");
    expectError("chart depth_fog -o charts --backend vulkan", 2, "vulkan");
    expectError("chart depth_fog -o charts --frame missing.exr", 3, "missing.exr");
}

}  // namespace
