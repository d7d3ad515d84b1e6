// brume convert and brume inspect, as run by people.
#include <sys/wait.h>

#include <array>
#include <cstdio>

#include "exr_fixture.hpp"
#include "frame/read.hpp"
#include "frame/write.hpp"
#include "frame_fixture.hpp"

namespace brume {
namespace {

using test::bitsThatDiffer;
using test::flat;

class Commands : public test::FrameTest {
  protected:
    struct Result {
        int status;
        std::string output;
    };
    Result brume(const std::string& arguments) const {
        FILE* pipe = popen(("'" BRUME_PROGRAM "' " + arguments + " 2>&1").c_str(), "r");
        Result result{-1, ""};
        std::array<char, 4096> buffer;
        while (size_t n = fread(buffer.data(), 1, buffer.size(), pipe))
            result.output.append(buffer.data(), n);
        const int status = pclose(pipe);
        result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
        return result;
    }
    std::string quoted(const std::string& name) const { return "'" + file(name) + "'"; }
    static std::string capture(const std::string& name) {
        return "'" + std::string(BRUME_CAPTURES) + "/" + name + "'";
    }
};

#define NEEDS_CAPTURES \
    if (std::string(BRUME_CAPTURES).empty()) GTEST_SKIP() << "BRUME_CAPTURES is not set"

TEST_F(Commands, ConvertLosesNothing) {
    NEEDS_CAPTURES;
    for (const char* name : {"openarena/czest1dm.png", "blender/flat_clear.exr", "tum/color.png",
                             "lingbot/night_skatepark.jpg", "habitat/skokloster_color.npy"}) {
        const Result result = brume("convert " + capture(name) + " -o " + quoted("one.exr"));
        ASSERT_EQ(result.status, 0) << result.output;
        const FramePair before = readFrame(std::string(BRUME_CAPTURES) + "/" + name),
                        after = readFrame(file("one.exr"));
        EXPECT_EQ(bitsThatDiffer(before.color, after.color), 0) << name;
        EXPECT_EQ(bitsThatDiffer(before.depth, after.depth), 0) << name;
        EXPECT_EQ(before.camera.fx, after.camera.fx);
        EXPECT_EQ(before.camera.worldFromCamera, after.camera.worldFromCamera);
        const Result again = brume("inspect " + quoted("one.exr"));
        EXPECT_EQ(again.status, 0);
        EXPECT_NE(again.output.find("nothing looks wrong"), std::string::npos) << again.output;
    }
    EXPECT_EQ(fileCount(), 1);
}

TEST_F(Commands, ConvertRefusesToOverwriteItsInput) {
    test::writeExrParts(file("a.exr"), {{{{"R", flat(1)}, {"G", flat(1)}, {"B", flat(1)}, {"Z", flat(2)}}}});
    const Result result = brume("convert " + quoted("a.exr") + " -o " + quoted("a.exr"));
    EXPECT_EQ(result.status, 2);
    EXPECT_NE(result.output.find("overwrite"), std::string::npos) << result.output;
    EXPECT_EQ(brume("convert " + quoted("a.exr") + " -o " + quoted("b/c.exr")).status, 3);
    EXPECT_EQ(brume("convert " + quoted("a.exr") + " -o " + quoted("folder")).status, 0);
    EXPECT_EQ(readFrame(file("folder/a.exr")).depth.at<float>(0, 0), 2);
}

TEST_F(Commands, InspectRanksWhatIsNotStatedAndDrawsIt) {
    NEEDS_CAPTURES;
    std::filesystem::copy(std::string(BRUME_CAPTURES) + "/tum/color.png", file("a.png"));
    std::filesystem::copy(std::string(BRUME_CAPTURES) + "/tum/color.depth.png", file("a.depth.png"));
    EXPECT_EQ(brume("convert " + quoted("a.png") + " -o " + quoted("b.exr")).status, 3)
        << "it is not guessed";
    const Result ranked = brume("inspect " + quoted("a.png") + " --picture " + quoted("p.png"));
    ASSERT_EQ(ranked.status, 0) << ranked.output;
    EXPECT_NE(ranked.output.find("tum"), std::string::npos);
    EXPECT_GT(readImage(file("p.png")).cols, 1200);
    EXPECT_EQ(readImage(file("p.readings.png")).cols, 4 * 320);
    const Result wrong = brume("inspect " + quoted("a.png") + " --depth-encoding linear");
    EXPECT_NE(wrong.output.find("doubt: scale"), std::string::npos) << wrong.output;
    const Result right = brume("inspect " + quoted("a.png") + " --depth-encoding tum");
    EXPECT_NE(right.output.find("nothing looks wrong"), std::string::npos) << right.output;
    const Result typo = brume("inspect " + quoted("a.png") + " --depth-encoding tun");
    EXPECT_EQ(typo.status, 2);
    EXPECT_NE(typo.output.find("tum"), std::string::npos) << typo.output;
}

TEST_F(Commands, HostileFilesEndWithASentence) {
    NEEDS_CAPTURES;
    int seen = 0;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::filesystem::path(BRUME_CAPTURES) / "malformed")) {
        if (entry.path().filename() == "odd_rgbaz_small.exr") continue;
        ++seen;
        const Result result = brume("convert '" + entry.path().string() + "' -o " + quoted("out.exr"));
        EXPECT_EQ(result.status, 3) << entry.path() << ": " << result.output;
        EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
        EXPECT_NE(result.output.find(entry.path().filename().string()), std::string::npos) << result.output;
    }
    EXPECT_GT(seen, 10);
    EXPECT_EQ(fileCount(), 0);
}

}  // namespace
}  // namespace brume
