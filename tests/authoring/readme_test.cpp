// What README.md prints can be copied: every `brume apply`, `inspect`, `list` and `convert-preset` in it runs
// as it stands there, in its order, on frames of the names it uses. (Its own effect is AUTHORING's, see
// document_test.cpp.)
#include <OpenImageIO/imageio.h>

#include <filesystem>
#include <sstream>

#include "frame/write.hpp"
#include "host/program.hpp"

namespace fs = std::filesystem;

namespace brume::test {
namespace {

// Lines of fenced blocks, and what stands between single backticks; the first block of JSON is my_fog.json.
struct Shown {
    std::vector<std::string> commands;
    std::string preset;
};

bool isCommand(const std::string& code) {
    if (code == "brume list") return true;
    for (const char* word : {"apply ", "inspect ", "convert-preset "})
        if (code.rfind(std::string("brume ") + word, 0) == 0) return true;
    return false;
}

Shown shownIn(const std::string& document) {
    const std::string built = "build/release/bin/";
    Shown shown;
    std::stringstream lines(document);
    std::string fence;
    int presets = 0;
    for (std::string line; std::getline(lines, line);) {
        if (line.rfind("```", 0) == 0) {
            fence = fence.empty() ? line : "";
            presets += fence == "```json";
        } else if (fence == "```json") {
            if (presets == 1) shown.preset += line + "\n";
        } else if (!fence.empty()) {
            if (line.rfind(built, 0) == 0) line.erase(0, built.size());
            if (isCommand(line)) shown.commands.push_back(line);
        } else {
            std::stringstream spans(line);
            bool isCode = false;
            for (std::string span; std::getline(spans, span, '`'); isCode = !isCode)
                if (isCode && isCommand(span)) shown.commands.push_back(span);
        }
    }
    return shown;
}

class Readme : public Program {
  protected:
    void add(const std::string& name, const cv::Mat& image) {
        fs::create_directories(fs::path(path(name)).parent_path());
        writeImage(path(name), image);
    }

    // 16 bits of 2.5 m in millimetres.
    void addDepth(const std::string& name) {
        fs::create_directories(fs::path(path(name)).parent_path());
        const std::vector<unsigned short> pixels(48 * 32, 2500);
        auto out = OIIO::ImageOutput::create("png");
        ASSERT_TRUE(out->open(path(name), OIIO::ImageSpec(48, 32, 1, OIIO::TypeUInt16)));
        ASSERT_TRUE(out->write_image(OIIO::TypeUInt16, pixels.data()));
        out->close();
    }
};

TEST_F(Readme, ItsCommandsRunAsPrinted) {
    const Shown shown = shownIn(bytesOf(BRUME_SOURCE_DIR "/README.md"));
    ASSERT_GE(shown.commands.size(), 18u);
    const cv::Mat color = sampleFrame().color;
    addText("my_fog.json", shown.preset);
    addFrame("forest_day.exr");
    addFrame("a.exr");
    add("shot.png", color);
    add("shot_z.exr", cv::Mat(color.size(), CV_32F, cv::Scalar(.99)));
    add("photo.png", color);
    for (const std::string name : {"a", "b", "c"}) {
        for (const char* folder : {"frames/", "shots/"}) {
            add(folder + name + ".png", color);
            addFrame(folder + name + ".depth.exr");
        }
        for (const char* folder : {"rgb/", "image/"}) add(folder + ("1" + name) + ".png", color);
        for (const char* folder : {"depth/", "groundtruth_depth/"}) addDepth(folder + ("1" + name) + ".png");
    }
    addText("associations.txt", "# time color time depth\n1.00 rgb/1a.png 1.01 depth/1a.png\n");
    addText("Filter.fs",
            "/*{\"ISFVSN\": \"2\", \"INPUTS\": [{\"NAME\": \"inputImage\", \"TYPE\": \"image\"}]}*/\n"
            "void main() { gl_FragColor = IMG_THIS_PIXEL(inputImage).bgra; }\n");
    addText("Foggy.ini", "Techniques=AdaptiveFog@AdaptiveFog.fx\n\n[AdaptiveFog.fx]\nMaxFogFactor=0.8\n");
    for (const std::string& command : shown.commands) {
        addText("step.sh", "brume() { '" BRUME_PROGRAM "' \"$@\"; }\n" + command + "\n");
        const Ran ran = run(folder_, "sh step.sh");
        EXPECT_EQ(ran.status, 0) << command << "\n" << ran.err;
    }
}

}  // namespace
}  // namespace brume::test
