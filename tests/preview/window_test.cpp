// The window, from outside: what a person does and sees.
#include <filesystem>
#include <fstream>

#include "preview/desktop.hpp"

namespace brume::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

double visibilityOf(const json& state) { return state["preset"]["effects"][0].value("visibility", 0.); }

TEST_F(PreviewWindow, ASliderChangesThePictureAndWhatIsSavedAppliesToTheSamePixels) {
    addFrame("frame.exr", {240, 150});
    addText("fog.json",
            R"({"effects": [{"effect": "depth_fog", "measure": "optical range", "visibility": 30}]})");
    addText("untouched.json", R"({"effects": []})");
    start("frame.exr fog.json");
    key("1");
    waitFor("one to one", [](const json& s) { return s["zoom"] == 1; });
    const cv::Mat before = applied("fog.json frame.exr --backend gl");
    expectPicture(before, "the preset as opened");

    // The slider: one drag is one change, and one step back.
    drag("depth_fog.visibility", .3, .8);
    waitFor("another visibility", [](const json& s) { return visibilityOf(s) > 0 && visibilityOf(s) != 30; });
    waitSettled();
    EXPECT_GT(cv::norm(picture(), before, cv::NORM_INF), 3);
    const double dragged = visibilityOf(state());
    key("ctrl+z");
    waitFor("undo", [](const json& s) { return visibilityOf(s) == 30; });
    waitSettled();
    expectPicture(before, "the preset after undo");
    key("ctrl+y");
    waitFor("redo", [&](const json& s) { return visibilityOf(s) == dragged; });
    EXPECT_EQ(state()["saved"], false);

    // Saved, it says the same, and apply makes what is on the screen.
    key("ctrl+s");
    waitFor("the dialog", [](const json& s) { return s["typing"] == true; });
    type("saved.json");
    waitFor("the name", [](const json& s) { return s["asked"] == "saved.json"; });
    hold("Return", "saved", [](const json& s) { return s["saved"] == true; });
    waitSettled();
    expectPicture(applied("saved.json frame.exr --backend gl"), "the saved preset");
    EXPECT_NE(bytesOf(path("saved.json")).find(std::to_string(int(dragged))), std::string::npos);

    // The wipe: the frame as captured on the left of a line that is dragged.
    const cv::Mat after = applied("saved.json frame.exr --backend gl");
    const cv::Mat captured = applied("untouched.json frame.exr --backend gl");
    key("w");
    waitFor("the wipe", [](const json& s) { return s["items"].contains("wipe"); });
    const cv::Point2d line = middleOf("wipe");
    dragTo(line, line - cv::Point2d(60, 0));
    move(5, 5);
    const double wipe = state()["wipe"];
    EXPECT_NEAR(wipe, .5 - 60. / 240, .02);
    const cv::Mat wiped = picture();
    const int at = int(wipe * 240);
    const cv::Rect left(0, 0, at - 12, 150), right(at + 12, 0, 240 - at - 12, 150);
    EXPECT_EQ(cv::norm(wiped(left), captured(left), cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(wiped(right), after(right), cv::NORM_INF), 0);
    quit();
}

}  // namespace
}  // namespace brume::test
