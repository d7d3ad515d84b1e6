// What the window knows, without one: document, history, stack, apply's line.
#include "preview/session.hpp"

#include <filesystem>

#include "error.hpp"
#include "frame/read.hpp"
#include "host/program.hpp"
#include "preview/stack.hpp"

namespace brume::preview {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

class SessionTest : public test::Program {
  protected:
    void set(const std::string& name, double number, bool isDrag = false) {
        const Step& step = session.chain().steps.at(0);
        ParameterValue value = step.values.at(name);
        value.numbers = {number};
        session.setValue(0, *findParameter(step.effect->header.parameters, name), value, isDrag);
    }
    double get(const std::string& name) { return session.chain().steps.at(0).values.at(name).numbers[0]; }
    std::vector<std::string> ids() {
        std::vector<std::string> all;
        for (const Step& step : session.chain().steps) all.push_back(step.id);
        return all;
    }
    Session session{EffectRegistry::standard()};
};

TEST(Labels, AreWrittenAlikeWhateverTheHeaderSays) {
    EXPECT_EQ(titleOf("max_opacity"), "Max opacity");
    EXPECT_EQ(titleOf("fog colour, dense"), "Fog colour, dense");
    EXPECT_EQ(titleOf("x density"), "x density");
    EXPECT_EQ(titleOf("Airlight"), "Airlight");
    EXPECT_EQ(titleOf(""), "");
}

TEST_F(SessionTest, ADragIsOneStepBackAndTheNextDragAnother) {
    session.openPreset("depth_fog");
    EXPECT_FALSE(session.history().canUndo());
    const double first = get("visibility");
    for (double v : {10., 20., 30.}) set("visibility", v, true);
    session.endDrag();
    for (double v : {40., 50.}) set("visibility", v, true);
    session.undo();
    EXPECT_EQ(get("visibility"), 30);
    session.undo();
    EXPECT_EQ(get("visibility"), first);
    EXPECT_FALSE(session.history().canUndo());
    session.redo();
    EXPECT_EQ(get("visibility"), 30);
    EXPECT_EQ(session.history().redoes(), "visibility of depth_fog");
    set("visibility", 60);  // what was undone is gone
    EXPECT_FALSE(session.history().canRedo());
    session.undo();
    EXPECT_EQ(get("visibility"), 30);
}

TEST_F(SessionTest, SavingKeepsEveryNumberAndKnowsItIsSaved) {
    session.openPreset("spirit_night");
    EXPECT_TRUE(session.isSaved());
    session.addEffect("depth_fog");
    EXPECT_THAT(ids().back(), testing::Not("depth_fog"));  // the preset has one; ids differ
    session.edit("a number", "", [](Chain& next) {
        next.steps.back().values["visibility"].numbers = {1. / 3};
        next.steps.back().given.insert("visibility");
    });
    EXPECT_FALSE(session.isSaved());
    session.savePreset(path("saved.json"));
    EXPECT_TRUE(session.isSaved());
    const Chain read = readPreset(path("saved.json"), EffectRegistry::standard());
    ASSERT_EQ(read.steps.size(), session.chain().steps.size());
    for (size_t k = 0; k < read.steps.size(); k++) {
        EXPECT_EQ(read.steps[k].id, session.chain().steps[k].id);
        EXPECT_EQ(read.steps[k].values, session.chain().steps[k].values);
        EXPECT_EQ(read.steps[k].given, session.chain().steps[k].given);
    }
    session.undo();
    EXPECT_FALSE(session.isSaved());
    session.redo();
    EXPECT_TRUE(session.isSaved());
    EXPECT_THROW(session.savePreset(path("no/such/folder/saved.json")), Error);
}

TEST_F(SessionTest, StepsMoveAndAreCopiedUnderIdsOfTheirOwn) {
    for (const char* name : {"depth_fog", "blend", "debug_depth"}) session.addEffect(name);
    session.edit("copy", "", [](Chain& next) { duplicateStep(next, 0); });
    EXPECT_THAT(ids(), ElementsAre("depth_fog", "depth_fog2", "blend", "debug_depth"));
    session.edit("down", "", [](Chain& next) { moveStep(next, 0, 2); });
    EXPECT_THAT(ids(), ElementsAre("depth_fog2", "blend", "depth_fog", "debug_depth"));
    session.edit("up", "", [](Chain& next) { moveStep(next, 3, 0); });
    EXPECT_THAT(ids(), ElementsAre("debug_depth", "depth_fog2", "blend", "depth_fog"));
    session.edit("name", "", [](Chain& next) { next.steps[1].output = "mist"; });
    EXPECT_THAT(imagesBefore(session.chain(), 1), ElementsAre("color", "captured", "transmittance"));
    EXPECT_THAT(imagesBefore(session.chain(), 2), ElementsAre("color", "captured", "transmittance", "mist"));
    EXPECT_THAT(namedImages(session.chain()), ElementsAre("transmittance", "mist"));
}

// The line is run, and must make what the window's chain makes.
TEST_F(SessionTest, TheApplyLineMakesTheSamePicture) {
    addFrame("a frame.exr");
    addText("fog.json",
            R"({"effects": [{"effect": "depth_fog", "measure": "optical range", "visibility": 30}]})");
    const auto here = std::filesystem::current_path();
    std::filesystem::current_path(folder_);
    session.limitPixels(500'000'000);
    session.openFrames({.frames = {"a frame.exr"}, .camera = "height=3"});
    session.openPreset("fog.json");
    set("visibility", 12.5);
    session.edit("colour", "", [](Chain& next) {
        next.steps[0].values["color"].numbers = {.25, .5, .125, 1};
        next.steps[0].given.insert("color");
    });
    const std::string line = applyLine(session, "cpu");
    session.savePreset("same.json");
    session.edit("nothing a --set can say", "", [](Chain& next) { next.steps[0].enabled = false; });
    EXPECT_THROW(applyLine(session, "cpu"), Error);
    std::filesystem::current_path(here);
    EXPECT_THAT(line, HasSubstr("--set depth_fog.visibility=12.5"));
    EXPECT_THAT(line, HasSubstr("--camera height=3"));
    EXPECT_THAT(line, HasSubstr("--max-pixels 500000000"));
    const test::Ran ran = test::run(folder_, "BRUME" + line.substr(std::string("brume").size()));
    EXPECT_EQ(ran.status, 0) << ran.err << line;
    EXPECT_EQ(brume("apply same.json 'a frame.exr' -o same.png --backend cpu --camera height=3").status, 0);
    EXPECT_EQ(cv::norm(readImage(path("a frame.fogged.png")), readImage(path("same.png")), cv::NORM_INF), 0);
}

TEST_F(SessionTest, AMistakenFileLeavesEverythingAsItWas) {
    addFrame("frame.exr");
    addText("wrong.json", R"({"effects": [{"effect": "depth_fogg"}]})");
    session.openPreset("depth_fog");
    session.openFrames({.frames = {path("frame.exr")}});
    const std::string before = writePreset(session.chain());
    const auto frames = session.framesRevision();
    EXPECT_THROW(session.openPreset(path("wrong.json")), Error);
    EXPECT_THROW(session.openFrames({.frames = {path("none.exr")}}), Error);
    EXPECT_THROW(session.openFrames({.frames = {path("frame.exr")}, .color = "purple"}), Error);
    EXPECT_THROW(session.readDepthAs("kity"), Error);
    EXPECT_THROW(session.addEffect("depth_fogg"), Error);
    EXPECT_EQ(writePreset(session.chain()), before);
    EXPECT_EQ(session.framesRevision(), frames);
    EXPECT_EQ(session.frames().size(), 1u);
    EXPECT_EQ(session.presetName(), "depth_fog");
}

TEST_F(SessionTest, DroppedFilesAreKnownByWhatTheyAre) {
    addFrame("a.exr");
    addFrame("b.exr");
    addText("fog.json", R"({"effects": [{"effect": "depth_fog"}]})");
    session.openAny({path("a.exr"), path("fog.json"), path("b.exr")});
    EXPECT_EQ(session.frames().size(), 2u);
    EXPECT_THAT(ids(), ElementsAre("depth_fog"));
    EXPECT_THAT(session.presetName(), EndsWith("fog.json"));
}

}  // namespace
}  // namespace brume::preview
