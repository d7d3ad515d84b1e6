// brume apply on single frames.
#include <cmath>

#include "frame/attributes.hpp"
#include "frame/read.hpp"
#include "frame/write.hpp"
#include "host/program.hpp"
#include "measure/compare.hpp"

using namespace brume;
using testing::HasSubstr;
using Apply = brume::test::Program;
using brume::test::bytesOf;

namespace {

bool sameImage(const std::string& a, const std::string& b) {
    return compareImages(readImage(a), readImage(b), 0, 0).passed;
}

TEST_F(Apply, writesAPictureAndSaysWhere) {
    addFrame("street.exr");
    auto ran = brume("apply depth_fog street.exr -o fog.png");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(ran.out, "fog.png\n");
    EXPECT_EQ(ran.err, "");
    EXPECT_EQ(readImage(path("fog.png")).size(), cv::Size(48, 32));
}

TEST_F(Apply, fogThatHardlyShowsIsSaid) {
    addFrame("street.exr");
    const auto ran = brume(
        "apply depth_fog street.exr -o fog.png --set depth_fog.measure=extinction --set "
        "depth_fog.extinction=0,.05");
    EXPECT_EQ(ran.status, 0);
    EXPECT_THAT(ran.err,
                HasSubstr("note: 'fog_extinction-0.png' looks much like its input: nine pixels in ten change "
                          "by less than 1 of 255 steps; its surfaces lie at"));
    EXPECT_THAT(ran.err, HasSubstr("brume preview depth_fog street.exr shows"));
    EXPECT_THAT(ran.err, testing::Not(HasSubstr("extinction-.05")));
}

TEST_F(Apply, whatIsSetInVainIsSaid) {
    addFrame("street.exr");
    const auto ran =
        brume("apply depth_fog street.exr -o a.png --set depth_fog.curve=3 --set depth_fog.visibility=5");
    EXPECT_EQ(ran.err, "note: depth_fog.curve changes nothing here: only when model is linear\n");
    EXPECT_EQ(brume("apply depth_fog street.exr -o b.png --set depth_fog.curve=3 --set "
                    "'depth_fog.model=exponential,linear'")
                  .err,
              "")
        << "it matters in one of the two";
    EXPECT_EQ(brume("apply noise_fog street.exr -o c.png --set noise_fog.resolution=64").err, "")
        << "auto may choose the baked method";
    for (int seed = 1; seed <= 6; seed++)
        EXPECT_EQ(brume("apply depth_fog street.exr -o d.png --seed " + std::to_string(seed) +
                        " --set 'depth_fog.model=choice(exponential,linear)' --set depth_fog.curve=3")
                      .err,
                  "")
            << "a frame may draw linear";
    addText(
        "off.json",
        R"({"effects": [{"effect": "depth_fog", "id": "near", "enabled": false}, {"effect": "depth_fog"}]})");
    EXPECT_EQ(
        brume("apply off.json street.exr -o e.png --set near.visibility=5 --set depth_fog.visibility=5").err,
        "note: near.visibility changes nothing here: the preset has 'near' switched off (\"enabled\": "
        "false)\n");
    EXPECT_EQ(brume("apply depth_fog street.exr --set depth_fog.curve=3").err,
              "brume: apply: say where to write, with -o\n");
}

// A wall before the lens in all but an eighth of the picture: nine pixels in ten are not eight.
TEST_F(Apply, fogThatShowsInAnEighthOfThePictureShows) {
    FramePair frame = test::sampleFrame();
    frame.color.setTo(cv::Scalar(.1, .1, .1, 1));
    frame.depth.setTo(.001);
    frame.depth.colRange(0, 6).setTo(1000);
    writeFrame(path("hall.exr"), frame);
    EXPECT_EQ(brume("apply depth_fog hall.exr -o fog.png").err, "");
    frame.depth.colRange(0, 3).setTo(.001);
    writeFrame(path("wall.exr"), frame);
    EXPECT_THAT(brume("apply depth_fog wall.exr -o fog.png").err, HasSubstr("nine pixels in ten"));
}

TEST_F(Apply, whatIsNoFogIsNotAskedForMoreFog) {
    addFrame("street.exr");
    const auto ran = brume("apply gaussian_blur street.exr -o soft.png --set gaussian_blur.radius=0");
    EXPECT_THAT(ran.err, HasSubstr("looks much like its input"));
    EXPECT_THAT(ran.err, testing::Not(HasSubstr("surfaces")));
}

// A blur changes edges, a glow what is around lamps, both few pixels: the rest may stay as it was.
TEST_F(Apply, aBlurShowsWhereOnlyAnEdgeChanges) {
    FramePair frame = test::sampleFrame();
    frame.color.setTo(cv::Scalar(.1, .1, .1, 1));
    frame.color.colRange(24, 48).setTo(cv::Scalar(.4, .4, .4, 1));
    frame.depth.setTo(.001);
    writeFrame(path("edge.exr"), frame);
    EXPECT_EQ(brume("apply gaussian_blur edge.exr -o soft.png --set gaussian_blur.radius=1").err, "");
    EXPECT_THAT(
        brume("apply gaussian_blur edge.exr -o sharp.png --set gaussian_blur.radius=.3").err,
        HasSubstr("'sharp.png' looks much like its input: 99 pixels in 100 change by less than 1 of 255 "
                  "steps; brume preview"));
    addText("both.json",
            R"({"effects": [{"effect": "depth_fog"}, {"effect": "gaussian_blur", "radius": 1}]})");
    EXPECT_EQ(brume("apply both.json edge.exr -o both.png").err, "");
    EXPECT_THAT(brume("apply both.json edge.exr -o both.png --set gaussian_blur.radius=.3").err,
                HasSubstr("surfaces"));
}

TEST_F(Apply, whatIsLittleByDayShowsAtNight) {
    FramePair frame = test::sampleFrame();
    const std::string fog = " --set depth_fog.measure=extinction --set depth_fog.extinction=.2 --set ";
    frame.color.setTo(cv::Scalar(.6, .6, .6, 1));
    writeFrame(path("day.exr"), frame);
    EXPECT_THAT(brume("apply depth_fog day.exr -o day.png" + fog + "'depth_fog.color=(.5,.5,.5)'").err,
                HasSubstr("looks much like its input"));
    frame.color.setTo(cv::Scalar(.006, .006, .006, 1));
    writeFrame(path("night.exr"), frame);
    EXPECT_EQ(
        brume("apply depth_fog night.exr -o night.png" + fog + "'depth_fog.color=(.015,.015,.015)'").err, "");
}

TEST_F(Apply, theFogIsTheFormula) {
    addFrame("street.exr");
    auto ran = brume(
        "apply depth_fog street.exr -o fog.exr --set depth_fog.measure=extinction "
        "--set depth_fog.extinction=.05 --set 'depth_fog.color=(.5,.6,.7)'");
    ASSERT_EQ(ran.status, 0) << ran.err;
    FramePair frame = readFrame(path("street.exr"));
    cv::Mat fog = readColor(path("fog.exr"));
    for (int j = 0; j < frame.color.rows; j++)
        for (int i = 0; i < frame.color.cols; i++) {
            double distance = frame.depth.at<float>(j, i) * cv::norm(frame.camera.ray(i, j));
            double t = std::exp(-.05 * distance), airlight[] = {.5, .6, .7};
            for (int c = 0; c < 3; c++) {
                double expected = frame.color.at<cv::Vec4f>(j, i)[c] * t + airlight[c] * (1 - t);
                ASSERT_NEAR(fog.at<cv::Vec4f>(j, i)[c], expected, 5e-4) << i << ", " << j;  // half floats
            }
        }
}

TEST_F(Apply, noFogIsTheIdentity) {
    addFrame("street.exr");
    auto ran = brume(
        "apply depth_fog street.exr -o fog.exr --set depth_fog.measure=extinction --set "
        "depth_fog.extinction=0");
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_TRUE(compareImages(readColor(path("fog.exr")), readColor(path("street.exr")), 0, 0).passed);
}

TEST_F(Apply, everyBackendGivesTheSamePicture) {
    addFrame("street.exr");
    for (std::string backend : {"cpu", "osmesa", "egl"}) {
        auto ran = brume("apply depth_fog street.exr -o " + backend + ".exr --backend " + backend);
        ASSERT_EQ(ran.status, 0) << ran.err;
    }
    for (const char* other : {"osmesa.exr", "egl.exr"})  // half floats
        EXPECT_TRUE(compareImages(readColor(path(other)), readColor(path("cpu.exr")), 1e-6, 1e-3).passed);
}

TEST_F(Apply, severalValuesGiveSeveralOutputs) {
    addFrame("street.exr");
    auto ran = brume("apply depth_fog street.exr -o fog.png --set depth_fog.visibility=100,200,400");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(files(), (std::set<std::string>{"street.exr", "fog_visibility-100.png",
                                              "fog_visibility-200.png", "fog_visibility-400.png"}));
    EXPECT_NE(bytesOf(path("fog_visibility-100.png")), bytesOf(path("fog_visibility-400.png")));
}

TEST_F(Apply, severalSetsGiveAllCombinationsAndBracketsHoldTogether) {
    addFrame("street.exr");
    auto ran = brume(
        "apply depth_fog street.exr -o 'out/{stem}-{visibility}.png' --set 'depth_fog.visibility=50,90' "
        "--set 'depth_fog.color=(.5,.6,.7)'");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(files(), (std::set<std::string>{"street.exr", "out/street-50.png", "out/street-90.png"}));
    ran = brume(
        "apply depth_fog street.exr -o 'all/{param}.png' --set 'depth_fog.visibility=50,90' "
        "--set 'depth_fog.color=(.5,.6,.7),#ff8000,(1,1,1)'");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(files().size(), 1u + 2 + 6);
}

TEST_F(Apply, aSweepIsTheSameAsItsSingleRuns) {
    addFrame("street.exr");
    ASSERT_EQ(brume("apply depth_fog street.exr -o sweep.exr --set depth_fog.visibility=70,300").status, 0);
    ASSERT_EQ(brume("apply depth_fog street.exr -o one.exr --set depth_fog.visibility=300").status, 0);
    EXPECT_TRUE(sameImage(path("sweep_visibility-300.exr"), path("one.exr")));
    EXPECT_FALSE(sameImage(path("sweep_visibility-70.exr"), path("one.exr")));
}

TEST_F(Apply, aFolderGetsTheInputsName) {
    addFrame("street.exr");
    EXPECT_THAT(brume("apply depth_fog street.exr -o out/").err, HasSubstr("--format png makes PNG"));
    EXPECT_EQ(brume("apply depth_fog street.exr -o out --format png").err, "");
    EXPECT_EQ(files(), (std::set<std::string>{"street.exr", "out/street.exr", "out/street.png"}));
}

TEST_F(Apply, keepWritesTransmittanceAndDepthBeside) {
    addFrame("street.exr");
    auto ran = brume("apply depth_fog street.exr -o fog.png --keep transmittance --keep depth.npy");
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(files(),
              (std::set<std::string>{"street.exr", "fog.png", "fog.transmittance.exr", "fog.depth.npy"}));
    FramePair frame = readFrame(path("street.exr"));
    EXPECT_TRUE(compareImages(readImage(path("fog.depth.npy")), frame.depth, 0, 0).passed);
    cv::Mat transmittance = readImage(path("fog.transmittance.exr"));
    for (int j = 0; j < 32; j++) {
        double distance = frame.depth.at<float>(j, 0) * cv::norm(frame.camera.ray(0, j));
        EXPECT_NEAR(transmittance.ptr<float>(j)[0], std::exp(-std::log(20.) / 200 * distance), 1e-5);
    }
}

TEST_F(Apply, keptNumbersAsSixteenBitsSayTheirScale) {
    addFrame("street.exr");
    ASSERT_EQ(brume("apply depth_fog street.exr -o fog.png --keep transmittance.png --keep depth.png").status,
              0);
    ASSERT_EQ(brume("apply depth_fog street.exr -o exact.png --keep transmittance --keep depth").status, 0);
    for (std::string image : {"transmittance", "depth"}) {
        std::string name = path("fog." + image + ".png");
        double scale = std::stod(readAttributes(name)["brume:scale"]);
        cv::Mat stored = readImage(name), exact = readImage(path("exact." + image + ".exr"));
        for (int j = 0; j < stored.rows; j++)
            for (int i = 0; i < stored.cols; i++) {
                double word = stored.ptr<float>(j)[i * stored.channels()] * 65535;
                float number = exact.ptr<float>(j)[i * exact.channels()];
                if (std::isinf(number))
                    ASSERT_NEAR(word, 65535, .01);
                else
                    ASSERT_NEAR(word * scale, number, scale * .51) << image << " " << i << ", " << j;
            }
    }
}

TEST_F(Apply, withDepthMakesAFrameAgain) {
    addFrame("street.exr");
    ASSERT_EQ(brume("apply depth_fog street.exr -o fog.exr --with-depth").status, 0);
    FramePair before = readFrame(path("street.exr")), after = readFrame(path("fog.exr"));
    EXPECT_TRUE(compareImages(before.depth, after.depth, 0, 0).passed);
    EXPECT_EQ(before.camera.fx, after.camera.fx);
    EXPECT_FALSE(compareImages(before.color, after.color, 0, 0).passed);
    EXPECT_EQ(brume("apply depth_fog fog.exr -o twice.png").status, 0);
    expectError("apply depth_fog street.exr -o o.png --with-depth", 2, ".exr");
}

TEST_F(Apply, explainSaysWhatWasUnderstood) {
    addFrame("street.exr");
    auto ran = brume("apply depth_fog street.exr -o fog.png --explain");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("depth: "));
    EXPECT_THAT(ran.out, HasSubstr("depth_fog: as written; "));
}

TEST_F(Apply, explainLeavesOutStepsOfNoiseThatIsNotMarched) {
    addFrame("street.exr");
    const auto ran = brume("apply layered_village street.exr -o fog.png --explain");
    EXPECT_THAT(ran.out, HasSubstr("method = procedural"));
    EXPECT_THAT(ran.out, testing::Not(HasSubstr("steps")));
}

TEST_F(Apply, explainNamesChoicesAndGivesNumbersAsTheyAre) {
    addFrame("street.exr");
    const auto ran = brume(
        "apply gaussian_blur street.exr -o soft.png --explain --set gaussian_blur.radius=5 --set "
        "gaussian_blur.method=fir");
    EXPECT_EQ(ran.status, 0) << ran.err;
    // The tolerance is under 1, and was chosen.
    EXPECT_THAT(ran.out, testing::ContainsRegex("gaussian_blur: .*tolerance = 0[.][0-9]*[1-9]"));
    EXPECT_THAT(ran.out, testing::ContainsRegex("predicted: off by .* of an 8-bit step .0.5 allowed."));
    const auto free =
        brume("apply gaussian_blur street.exr -o soft.png --explain --set gaussian_blur.radius=5");
    EXPECT_THAT(free.out, testing::ContainsRegex("gaussian_blur: method = [a-zA-Z]")) << "not a number";
}

// Of what a tolerance lets through, nobody has to read powers of ten, nor more steps than there are.
TEST_F(Apply, explainCountsStepsThatShow) {
    FramePair frame = test::sampleFrame();
    frame.color.setTo(cv::Scalar(0, 0, 0, 1));
    frame.color.at<cv::Vec4f>(16, 24) = {5000, 5000, 5000, 1};
    writeFrame(path("lamp.exr"), frame);
    const auto ran = brume(
        "apply gaussian_blur lamp.exr -o soft.png --explain --set gaussian_blur.radius=2.7 --set "
        "gaussian_blur.tolerance=.1,.001");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.out, testing::ContainsRegex("predicted: off by 2[0-9][0-9] 8-bit steps .0.5 allowed."));
    EXPECT_THAT(ran.out, testing::Not(HasSubstr("e+")));
}

TEST_F(Apply, dumpShaderPrintsWhatTheCompilerGets) {
    auto ran = brume("apply depth_fog --dump-shader");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("#version 450"));
    EXPECT_THAT(ran.out, HasSubstr("#line"));
    EXPECT_THAT(ran.out, HasSubstr("void main"));
}

TEST_F(Apply, outputsSayHowTheyWereMadeAndCanBeRepeated) {
    addFrame("street.exr");
    for (std::string ending : {"png", "exr"}) {
        std::string made = "a." + ending, again = "again." + ending;
        auto ran = brume("apply depth_fog street.exr --seed 5 --set depth_fog.visibility=77 -o " + made);
        ASSERT_EQ(ran.status, 0) << ran.err;
        EXPECT_THAT(readAttributes(path(made))["brume:made"], HasSubstr("\"visibility\":77"));
        ran = brume("apply --like " + made + " -o " + again);
        ASSERT_EQ(ran.status, 0) << ran.err;
        EXPECT_TRUE(sameImage(path(made), path(again)));
        EXPECT_EQ(readAttributes(path(made)), readAttributes(path(again)));
    }
    // Of what was set before, all but what is set anew.
    ASSERT_EQ(brume("apply depth_fog street.exr --set depth_fog.visibility=30,60 --set depth_fog.start=2 -o "
                    "'swept_{visibility}.png'")
                  .status,
              0);
    ASSERT_EQ(brume("apply --like swept_60.png --set depth_fog.start=1 -o '{visibility}_{start}.png'").status,
              0);
    EXPECT_THAT(readAttributes(path("60_1.png"))["brume:made"],
                HasSubstr(R"("settings":{"depth_fog.visibility":"60","depth_fog.start":"1"})"));
    addFrame("other.exr", {40, 30}, 3);
    ASSERT_EQ(brume("apply --like a.png other.exr -o other.png").status, 0);
    ASSERT_EQ(brume("apply depth_fog other.exr -o same.png --seed 5 --set depth_fog.visibility=77").status,
              0);
    EXPECT_TRUE(sameImage(path("other.png"), path("same.png")));
    expectError("apply --like other.exr -o x.png", 3, "does not say how it was made");
}

TEST_F(Apply, theCameraOfAWholeDataSetIsSaidOnce) {
    const FramePair frame = test::sampleFrame();
    WriteOptions data;
    data.isData = true;
    for (const char* name : {"a", "b", "c"}) {
        writeImage(path(name + std::string(".png")), frame.color);
        writeImage(path(name + std::string(".depth.exr")), frame.depth, data);
    }
    addText("b.json", R"({"camera": {"horizontal_view_degrees": 90, "height": 3, "pitch_degrees": -5}})");
    addText("c.json", R"({"camera": {"horizontal_view_degrees": 20}})");
    const std::string fog = "apply height_fog --set height_fog.density=.3 ",
                      said = " --camera horizontal_view_degrees=90,height=3,pitch_degrees=-5";
    const auto assumed = brume(fog + "a.png -o assumed.png");
    EXPECT_THAT(assumed.err, HasSubstr("note: 'a.png' does not state its camera"));
    EXPECT_EQ(brume(fog + "b.png -o b.out.png").err, "");
    EXPECT_EQ(brume(fog + "a.png -o a.out.png" + said).err, "");
    EXPECT_EQ(brume(fog + "c.png -o c.out.png" + said).err, "");  // over what the sidecar says
    EXPECT_TRUE(sameImage(path("a.out.png"), path("b.out.png")));
    EXPECT_TRUE(sameImage(path("c.out.png"), path("b.out.png")));
    EXPECT_FALSE(sameImage(path("assumed.png"), path("b.out.png")));
    ASSERT_EQ(brume("apply --like a.out.png -o again.png").status, 0);
    EXPECT_TRUE(sameImage(path("again.png"), path("b.out.png")));
    EXPECT_THAT(brume(fog + "a.png -o a.out.png --resume").err, HasSubstr("was made with frame"));
}

TEST_F(Apply, sameCommandSameBytes) {
    addFrame("street.exr");
    ASSERT_EQ(brume("apply depth_fog street.exr -o a.png").status, 0);
    std::string first = bytesOf(path("a.png"));
    ASSERT_EQ(brume("apply depth_fog street.exr -o a.png").status, 0);
    EXPECT_TRUE(first == bytesOf(path("a.png")));
}

}  // namespace
