// Ways to look at the picture, sequences, and a window that stays alive while a chain is slow.
#include "preview/desktop.hpp"

namespace brume::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST_F(PreviewWindow, ThePixelUnderThePointerIsKnown) {
    addFrame("frame.exr", {240, 150});
    start("frame.exr depth_fog");
    key("1");
    waitFor("one to one", [](const json& s) { return s["zoom"] == 1; });
    const json at = state()["picture"];
    move(at[0].get<double>() + 120, at[1].get<double>() + 140);
    waitFor("the probe", [](const json& s) {
        return s.contains("probe") && s["probe"]["pixel"] == "120, 140" && s["probe"]["transmittance"] != "…";
    });
    const json probe = state()["probe"];
    EXPECT_THAT(probe["before"].get<std::string>(), HasSubstr("0.5"));
    // The frame's ground is 1.6 m below the eye.
    EXPECT_THAT(probe["world"].get<std::string>(), HasSubstr(" 0.00 "));
    EXPECT_THAT(probe["depth"].get<std::string>(), HasSubstr(" m"));

    // Zoom about the pointer: the same pixel stays under it.
    xdotool("click 4");
    waitFor("zoomed", [](const json& s) { return s["zoom"] > 1; });
    EXPECT_EQ(state()["probe"]["pixel"], "120, 140");
    key("f");
    waitFor("fitted", [](const json& s) { return s["fit"] == true; });

    // Depth, transmittance, the difference of both halves: each is another picture.
    for (const char* look : {"d", "i", "x"}) {
        const int pictures = state()["pictures"];
        key(look);
        waitFor("another picture",
                [&](const json& s) { return s["pictures"] > pictures && s["settled"] == true; });
        EXPECT_EQ(state()["error"], "");
    }
    const json difference = state()["difference"];
    EXPECT_LT(difference["largest"].get<double>(), 1e-5);  // depth_fog's TOLERANCE on colours up to 1
    EXPECT_EQ(difference["unlike"], 0);
    quit();
}

TEST_F(PreviewWindow, ASequenceIsScrubbedAndPlayed) {
    for (int k = 0; k < 4; k++) addFrame("in/shot." + std::to_string(k) + ".exr", {64, 40}, 4 * k);
    start("in/shot.#.exr depth_fog");
    EXPECT_EQ(state()["frames"], 4);
    key("Right");
    waitFor("the next frame", [](const json& s) { return s["frame"] == 1 && s["settled"] == true; });
    key("End");
    waitFor("the last frame", [](const json& s) { return s["frame"] == 3 && s["settled"] == true; });
    drag("timeline", .9, .05);
    waitFor("the first frame", [](const json& s) { return s["frame"] == 0 && s["settled"] == true; });
    key("space");
    // It loops: frame 0 comes round after frame 3.
    waitFor("frame 3", [](const json& s) { return s["playing"] == true && s["frame"] == 3; });
    waitFor("round again", [](const json& s) { return s["playing"] == true && s["frame"] == 1; });
    key("space");
    waitFor("stopped", [](const json& s) { return s["playing"] == false && s["settled"] == true; });
    quit();
}

// volume_fog in many steps takes long in software; the window goes on drawing meanwhile.
class SlowChain : public PreviewWindow, public testing::WithParamInterface<std::pair<const char*, int>> {};

TEST_P(SlowChain, DoesNotHoldTheWindowUp) {
    addFrame("frame.exr", {520, 400});
    addText("slow.json",
            R"({"effects": [{"effect": "volume_fog", "method": "midpoint", "early_stop": false,
      "noise": "additive", "noise_every": 1, "steps": )" +
                std::to_string(GetParam().second) + "}]}");
    start(std::string("frame.exr slow.json --backend ") + GetParam().first, false);
    waitFor("a coarse picture first", [](const json& s) { return s["scale"] > 1; });
    key("F1");
    waitFor("help", [](const json& s) { return s["help"] == true; });
    EXPECT_EQ(state()["settled"], false);
    const int drawn = state()["drawn"];
    key("F1");
    waitFor("no help", [](const json& s) { return s["help"] == false; });
    EXPECT_EQ(state()["settled"], false);
    EXPECT_GT(state()["drawn"].get<int>(), drawn);
    waitSettled();
    EXPECT_EQ(state()["scale"], 1);
    quit();
}

INSTANTIATE_TEST_SUITE_P(Preview, SlowChain, testing::Values(std::pair("gl", 48), std::pair("cpu", 512)));

TEST_F(PreviewWindow, RemembersItsLayout) {
    addFrame("frame.exr", {64, 40});
    start("frame.exr");
    const auto splitter = middleOf("splitter");
    dragTo(splitter, splitter - cv::Point2d(90, 0));
    key("F4");
    waitFor("timing", [](const json& s) { return s["tab"] == "Timing"; });
    const double place = middleOf("splitter").x;
    EXPECT_NEAR(place, splitter.x - 90, 4);
    quit();
    start("frame.exr");
    EXPECT_NEAR(middleOf("splitter").x, place, 2);
    EXPECT_EQ(state()["tab"], "Timing");
    quit();
}

}  // namespace
}  // namespace brume::test
