// Files that change under the window, and what it says where it cannot open.
#include <filesystem>
#include <fstream>

#include "frame/write.hpp"
#include "preview/desktop.hpp"

namespace brume::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const char* const head = R"(/*{"SPACE": "linear", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"},
 {"NAME": "amount", "TYPE": "float", "DEFAULT": 0.5, "MIN": 0, "MAX": 1}]}*/
#include "kit/image.glsl"
#include "shade.glsl"
)";
const char* const body = "void main() { store(vec4(fetch(inputImage, pixel()).rgb * shade(), 1.0)); }\n";

std::function<bool(const json&)> hasError(const std::string& part) {
    return [part](const json& s) { return s["error"].get<std::string>().find(part) != std::string::npos; };
}

TEST_F(PreviewWindow, AShaderIsReloadedAndAMistakeKeepsTheLastGoodOne) {
    addFrame("frame.exr", {240, 150});
    addText("effects/tint/tint.fs", std::string(head) + body);
    addText("effects/tint/shade.glsl", "vec3 shade() { return vec3(amount, 0.25, 0.25); }\n");
    addText("tint.json", R"({"effects": [{"effect": "tint", "amount": 0.75}]})");
    start("frame.exr tint.json");
    key("1");
    waitFor("one to one", [](const json& s) { return s["zoom"] == 1; });
    const cv::Mat first = applied("tint.json frame.exr --backend gl");
    expectPicture(first, "the shader as opened");

    // A mistake: named by file and line, and the picture stays.
    addText("effects/tint/tint.fs", std::string(head) + "\nvoid main() { store(vec4(nonsense)); }\n");
    waitFor("the mistake", hasError("tint.fs:6"));
    EXPECT_THAT(state()["error"].get<std::string>(), HasSubstr("nonsense"));
    // Even while a parameter moves: what runs is the last good shader.
    key("ctrl+z");
    waitSettled();
    expectPicture(first, "the last good shader");

    addText("effects/tint/tint.fs", std::string(head) + body);
    waitFor("mended", [](const json& s) { return s["error"] == "" && s["settled"] == true; });
    expectPicture(first, "the mended shader");

    // An include, mistaken and mended.
    addText("effects/tint/shade.glsl", "vec3 shade() { return vec3(0.25, amount, 0.25) }\n");
    waitFor("the include's mistake", hasError("shade.glsl:1"));
    expectPicture(first, "the last good include");
    addText("effects/tint/shade.glsl", "vec3 shade() { return vec3(0.25, amount, 0.25); }\n");
    waitFor("mended", [](const json& s) { return s["error"] == ""; });
    const cv::Mat second = applied("tint.json frame.exr --backend gl");
    EXPECT_GT(cv::norm(first, second, cv::NORM_INF), 3);
    expectPicture(second, "the include as mended");

    // The preset, mistaken and mended.
    addText("tint.json", R"({"effects": [{"effect": "tint", "amout": 0.1}]})");
    waitFor("the preset's mistake", hasError("amout"));
    addText("tint.json", R"({"effects": [{"effect": "tint", "amount": 0.1}]})");
    waitFor("mended",
            [](const json& s) { return s["error"] == "" && s["preset"]["effects"][0]["amount"] == .1; });
    expectPicture(applied("tint.json frame.exr --backend gl"), "the preset as mended");
    quit();
}

TEST_F(PreviewWindow, ARebuiltPluginRunsItsNewCode) {
    addFrame("frame.exr", {240, 150});
    const std::string fixtures = BRUME_BINARY_DIR "/tests/effects";
    std::filesystem::create_directories(path("effects/variant"));
    auto build = [&](const std::string& which) {
        const auto how = std::filesystem::copy_options::overwrite_existing;
        for (const char* ending : {".fs", ".so"})
            std::filesystem::copy_file(fixtures + "/variant_" + which + "/variant_" + which + ending,
                                       path("effects/variant/pending"), how),
                std::filesystem::rename(path("effects/variant/pending"),
                                        path(std::string("effects/variant/variant") + ending));
    };
    build("a");
    addText("variant.json", R"({"effects": [{"effect": "variant"}]})");
    start("frame.exr variant.json --backend cpu");
    key("1");
    waitFor("one to one", [](const json& s) { return s["zoom"] == 1; });
    const cv::Mat first = applied("variant.json frame.exr --backend cpu");
    expectPicture(first, "the plugin as opened");
    build("b");
    const cv::Mat second = applied("variant.json frame.exr --backend cpu");
    EXPECT_GT(cv::norm(first, second, cv::NORM_INF), 3);
    expectPicture(second, "the plugin as rebuilt");
    quit();
}

TEST_F(PreviewWindow, SaysWhatToDoWithoutADisplayOrWithAnOldOpenGl) {
    addFrame("frame.exr");
    const std::string display = Desktop::instance()->display();
    const Ran none = run(folder_, "env -u DISPLAY -u WAYLAND_DISPLAY BRUME preview frame.exr");
    EXPECT_EQ(none.status, 2);
    EXPECT_THAT(none.err, testing::StartsWith("brume: preview: there is no display"));
    EXPECT_THAT(none.err, HasSubstr("xvfb-run"));
    const Ran old =
        run(folder_, "env DISPLAY=" + display + " MESA_GL_VERSION_OVERRIDE=3.3 BRUME preview frame.exr");
    EXPECT_EQ(old.status, 2);
    EXPECT_THAT(old.err, HasSubstr("no OpenGL 4.5 core"));
    EXPECT_THAT(old.err, HasSubstr("update the graphics driver"));
    for (const Ran& ran : {none, old})
        EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
}

// Nobody sits at a window that only makes a picture: it must end, and say why.
TEST_F(PreviewWindow, AScreenshotThatCannotBeMadeEndsWithASentence) {
    addFrame("frame.exr");
    addText("damaged.exr", "no picture");
    const std::string preview =
        "env DISPLAY=" + Desktop::instance()->display() + " timeout 60 BRUME preview ";
    auto refusal = [&](const std::string& words, int status) {
        const Ran ran = run(folder_, preview + words);
        EXPECT_EQ(ran.status, status) << words << "\n" << ran.err;
        return ran.err;
    };
    EXPECT_THAT(refusal("frame.exr depth_fog --screenshot nowhere/shot.png", 3), HasSubstr("nowhere"));
    EXPECT_THAT(refusal("frame.exr depth_fog --show dept --screenshot shot.png", 2),
                HasSubstr("--show: no image 'dept' (did you mean 'depth'?)"));
    EXPECT_THAT(refusal("frame.exr depth_fog --screenshot shot.bmp", 2), HasSubstr(".png or .jpg"));
    EXPECT_THAT(refusal("damaged.exr depth_fog --screenshot shot.png", 3), HasSubstr("damaged.exr"));
    EXPECT_THAT(refusal("depth_fog --screenshot shot.png", 2), HasSubstr("name a frame"));
    EXPECT_THAT(refusal("frame.exr depth_fog --screenshot shot.png --max-pixels 1000", 3),
                HasSubstr("more than the limit of 1000"));
    EXPECT_THAT(refusal("frame.exr depth_fgo --screenshot shot.png", 2),
                HasSubstr("did you mean 'depth_fog'?"));
    EXPECT_FALSE(std::filesystem::exists(path("shot.png")));
    // The preset may come first, as apply wants it; and the picture is what its name says.
    EXPECT_EQ(refusal("depth_fog frame.exr --screenshot shot.jpeg", 0), "");
    EXPECT_EQ(bytesOf(path("shot.jpeg")).substr(0, 2), "\xff\xd8");
    // Nor does it take the place of what is shown.
    writeImage(path("a.png"), test::sampleFrame().color);
    addFrame("a.depth.exr");
    addText("fog.json", R"({"effects": [{"effect": "depth_fog"}]})");
    const auto before = files();
    for (const char* words : {"a.png fog.json --screenshot ./a.png", "a.png fog.json --state a.png",
                              "a.png fog.json --trace a.depth.exr", "a.png fog.json --state fog.json",
                              "frame.exr depth_fog --depth a.depth.exr --trace a.depth.exr"}) {
        EXPECT_THAT(refusal(words, 2), HasSubstr("is an input; it would be overwritten"));
        EXPECT_EQ(files(), before);
    }
    // One that can be made takes the place of a link of its name, not of what that leads to.
    addText("precious", "keep me");
    std::filesystem::create_symlink("precious", path("shot.png"));
    EXPECT_EQ(refusal("frame.exr depth_fog --screenshot shot.png", 0), "");
    EXPECT_EQ(bytesOf(path("precious")), "keep me");
    EXPECT_FALSE(std::filesystem::is_symlink(path("shot.png")));
    for (const char* name : {"state.json", "trace.jsonl"})
        std::filesystem::create_symlink("precious", path(name));
    EXPECT_EQ(refusal("frame.exr depth_fog --screenshot shot.png --state state.json --trace trace.jsonl", 0),
              "");
    EXPECT_EQ(bytesOf(path("precious")), "keep me");
    EXPECT_THAT(bytesOf(path("state.json")), HasSubstr("\"items\""));
    EXPECT_FALSE(std::filesystem::is_symlink(path("trace.jsonl")));
}

}  // namespace
}  // namespace brume::test
