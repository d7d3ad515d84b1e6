// The stack of effects, edited by hand.
#include "preview/desktop.hpp"

namespace brume::test {
namespace {

using nlohmann::json;

std::vector<std::string> stackOf(const json& state) {
    std::vector<std::string> names;
    for (const json& step : state["preset"]["effects"]) names.push_back(step.value("id", step["effect"]));
    return names;
}

auto stackIs(const std::vector<std::string>& names) {
    return [names](const json& s) { return stackOf(s) == names; };
}

TEST_F(PreviewWindow, EffectsAreAddedMovedDuplicatedSwitchedAndRemoved) {
    addFrame("frame.exr", {64, 40});
    start("frame.exr");
    EXPECT_EQ(stackOf(state()).size(), 0u);

    // Found by a word, added by Enter; and by a click.
    key("a");
    waitFor("the list", [](const json& s) { return s["typing"] == true; });
    type("debug_d");
    waitFor("the search", [](const json& s) { return !s["items"].contains("offer.blend"); });
    hold("Return", "added", stackIs({"debug_depth"}));
    click("add effect");
    click("offer.blend");
    waitFor("added", stackIs({"debug_depth", "blend"}));
    waitSettled();

    click("step.debug_depth.duplicate");
    waitFor("duplicated", stackIs({"debug_depth", "debug_depth2", "blend"}));
    click("step.debug_depth");  // folded: the others move up
    click("step.debug_depth2");
    dragTo(middleOf("step.blend"), middleOf("step.debug_depth"));
    waitFor("moved", stackIs({"blend", "debug_depth", "debug_depth2"}));
    click("step.debug_depth.on");
    waitFor("switched off",
            [](const json& s) { return s["preset"]["effects"][1].value("enabled", true) == false; });
    click("step.debug_depth2.remove");
    waitFor("removed", stackIs({"blend", "debug_depth"}));
    for (int k = 0; k < 3; k++) key("ctrl+z");
    waitFor("undone", stackIs({"debug_depth", "debug_depth2", "blend"}));
    key("ctrl+shift+z");
    waitFor("done again", stackIs({"blend", "debug_depth", "debug_depth2"}));
    waitSettled();
    EXPECT_EQ(state()["error"], "");
    quit();
}

// The button is pressed while the window is being drawn: what comes after it draws the steps as they are
// then.
TEST_F(PreviewWindow, UndoneByTheButtonTheStackIsDrawnAsItIsThen) {
    addFrame("frame.exr", {64, 40});
    start("frame.exr depth_fog");
    click("step.depth_fog.remove");
    waitFor("removed", stackIs({}));
    click("undo");
    waitFor("undone", stackIs({"depth_fog"}));
    waitSettled();
    click("step.depth_fog");
    click("add effect");
    click("offer.fog_blur");
    waitFor("added", stackIs({"depth_fog", "fog_blur"}));
    click("step.fog_blur");
    dragTo(middleOf("step.fog_blur"), middleOf("step.depth_fog"));
    waitFor("moved", stackIs({"fog_blur", "depth_fog"}));
    click("step.depth_fog");
    click("undo");
    waitFor("moved back", stackIs({"depth_fog", "fog_blur"}));
    waitSettled();
    EXPECT_EQ(state()["error"], "");
    quit();
}

TEST_F(PreviewWindow, ValuesAreTypedResetAndListed) {
    addFrame("frame.exr", {64, 40});
    start("frame.exr volume_fog");
    click("group.volume_fog.Whole scene");
    // Exact entry: ctrl and a click open the slider's text.
    const auto at = middleOf("volume_fog.density");
    move(at.x, at.y);
    xdotool("keydown ctrl");
    waitFor("ctrl", [](const json& s) { return s["control"] == true; });
    press();
    release();
    xdotool("keyup ctrl");
    waitFor("the text", [](const json& s) { return s["typing"] == true; });
    type("0.0123456789");
    hold("Return", "taken",
         [](const json& s) { return s["preset"]["effects"][0].value("density", 0.) == .0123456789; });
    click("volume_fog.density.reset");
    waitFor("reset", [](const json& s) { return !s["preset"]["effects"][0].contains("density"); });

    click("volume_fog.boxes.add");
    waitFor("a row", [](const json& s) { return s["preset"]["effects"][0]["boxes"].size() == 1; });
    click("volume_fog.boxes[0].remove");
    waitFor("no row", [](const json& s) { return s["preset"]["effects"][0]["boxes"].size() == 0; });
    key("ctrl+z");
    waitFor("a row again", [](const json& s) { return s["preset"]["effects"][0]["boxes"].size() == 1; });
    waitSettled();
    EXPECT_EQ(state()["error"], "");
    quit();
}

}  // namespace
}  // namespace brume::test
