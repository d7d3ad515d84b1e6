// brume apply on many frames: the same whatever the order, nothing lost whatever happens.
#include <cmath>

#include "error.hpp"
#include "frame/read.hpp"
#include "frame/write.hpp"
#include "host/many_frames.hpp"

using namespace brume;
using brume::test::bytesOf;
using testing::HasSubstr;
namespace fs = std::filesystem;

namespace {

class Batch : public test::ManyFrames {};

TEST_F(Batch, aSequenceBecomesAFolderWithASummaryAndASheet) {
    addFrames(10);
    auto ran = brume("apply depth_fog 'in/f.####.exr' -o out --format png");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("10 made"));
    EXPECT_EQ(pictures("out").size(), 10u);
    EXPECT_TRUE(fs::exists(path("out/contact_sheet.png")));
    cv::Mat sheet = readImage(path("out/contact_sheet.png"));
    EXPECT_EQ(sheet.size(), cv::Size(8 + 4 * 48, 8 + 2 * 54))
        << "four by two, each 40 by 24 above its caption";
}

TEST_F(Batch, folderGlobListAndPatternMeanTheSame) {
    addFrames(3);
    addText("list.txt", "# frames\nin/f.0001.exr\nin/f.0002.exr\nin/f.0003.exr\n");
    std::map<std::string, std::string> first;
    for (std::string input :
         {"in", "'in/*.exr'", "in/f.%04d.exr", "list.txt", "in/f.0001.exr in/f.0002.exr in/f.0003.exr"}) {
        fs::remove_all(path("out"));
        auto ran = brume("apply depth_fog " + input + " -o out");
        ASSERT_EQ(ran.status, 0) << input << ": " << ran.err;
        if (first.empty()) first = pictures("out");
        EXPECT_EQ(pictures("out").size(), 3u);
    }
}

TEST_F(Batch, theSameBytesWithAnyNumberOfJobs) {
    addFrames(9);
    const std::string apply =
        "apply depth_fog in --format png --set 'depth_fog.visibility=random(20,90)' "
        "--set depth_fog.start=0,3 --keep transmittance ";
    std::map<std::string, std::string> first;
    for (std::string how : {"--jobs 1", "--jobs 2", "--jobs 7", "--jobs 4 --memory 1M"}) {
        fs::remove_all(path("out"));  // the record holds no path of the output
        auto ran = brume(apply + how + " -o out");
        ASSERT_EQ(ran.status, 0) << ran.err;
        if (first.empty()) first = pictures("out");
        EXPECT_EQ(first.size(), 36u);
        EXPECT_TRUE(pictures("out") == first) << how;
    }
}

TEST_F(Batch, drawsStayInRangeDifferAndAreRecorded) {
    addFrames(12);
    const std::string apply =
        "apply depth_fog in -o out --format png --set 'depth_fog.visibility=random(10,1000,log)' "
        "--set 'depth_fog.color=random((.1,.2,.3),(.2,.2,.9))' --set "
        "'depth_fog.model=choice(exponential,linear)' "
        "--report r.json ";
    ASSERT_EQ(brume(apply).status, 0);
    auto report = reportAt("r.json");
    std::set<double> drawn;
    std::set<std::string> models;
    for (const auto& frame : report["frames"]) {
        double visibility = frame["settings"]["depth_fog.visibility"].get<double>();
        EXPECT_TRUE(visibility >= 10 && visibility <= 1000);
        drawn.insert(visibility);
        models.insert(frame["settings"]["depth_fog.model"].get<std::string>());
        auto color = frame["settings"]["depth_fog.color"].get<std::vector<double>>();
        ASSERT_EQ(color.size(), 3u);
        EXPECT_EQ(color[1], .2);
    }
    EXPECT_EQ(drawn.size(), 12u);
    EXPECT_EQ(models.size(), 2u);
    EXPECT_EQ(report["preset"]["effects"][0]["effect"], "depth_fog") << report["preset"];
    EXPECT_EQ(report["seed"], 0);
    auto first = pictures("out");
    fs::remove_all(path("out"));
    ASSERT_EQ(brume(apply).status, 0);
    EXPECT_TRUE(pictures("out") == first) << "the same draws again";
    fs::remove_all(path("out"));
    ASSERT_EQ(brume(apply + " --seed 2").status, 0);
    EXPECT_FALSE(pictures("out") == first) << "others with another seed";
    EXPECT_EQ(reportAt("r.json")["seed"], 2);
}

// 120 numbers: a third of them in each third of the range, counted in decades or evenly, as asked.
TEST_F(Batch, drawsAreSpreadAsAsked) {
    addFrames(60);
    const auto apply = [&](const std::string& draw) {
        return brume("apply depth_fog in -o out --format png --report r.json --set 'depth_fog.color=" + draw +
                     "'")
            .status;
    };
    EXPECT_EQ(apply("random((.001,.001,0),(1,1,0),log)"), 2) << "0 has no logarithm";
    for (const bool isLog : {true, false}) {
        ASSERT_EQ(apply(text("random((.001,.001,0.5),(1,1,0.5)", isLog ? ",log" : "", ")")), 0);
        int inThird[3] = {};
        const auto report = reportAt("r.json");
        for (const auto& frame : report["frames"])
            for (int n : {0, 1}) {
                const double x = frame["settings"]["depth_fog.color"][n].get<double>();
                const double share = isLog ? 1 + std::log10(x) / 3 : (x - .001) / .999;
                inThird[std::clamp(int(share * 3), 0, 2)]++;
            }
        // 40 each, with a standard deviation of 5.
        for (int count : inThird) EXPECT_NEAR(count, 40, 15) << (isLog ? "in decades" : "evenly");
    }
}

TEST_F(Batch, framesThatNoDepthLiesNearAreSaidToBeLeftOut) {
    const FramePair frame = test::sampleFrame({32, 24});
    WriteOptions data;
    data.isData = true;
    fs::create_directories(path("rgb"));
    fs::create_directories(path("depth"));
    for (const char* time : {"1.00", "2.00", "3.00"})
        writeImage(path("rgb/" + std::string(time) + ".png"), frame.color);
    for (const char* time : {"1.01", "3.01"})
        writeImage(path("depth/" + std::string(time) + ".exr"), frame.depth, data);
    const auto ran = brume("apply depth_fog rgb --depth depth -o out --report r.json");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.err, HasSubstr("note: 1 of 3 frames are left out, 'rgb/2.00.png' the first"));
    const auto report = reportAt("r.json");
    ASSERT_EQ(report["frames"].size(), 2u);
    EXPECT_EQ(report["frames"][1]["depth"], "depth/3.01.exr") << "which depth a frame was paired with";
}

TEST_F(Batch, aBadFrameIsNamedAndTheOthersAreMade) {
    addFrames(6);
    addText("in/f.0003.exr", bytesOf(path("in/f.0003.exr")).substr(0, 700));
    addText("list.txt", "in/f.0001.exr\nin/gone.exr\nin/f.0002.exr\n");
    auto ran = brume("apply depth_fog in -o out --keep-going --report r.json");
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, HasSubstr("f.0003.exr"));
    EXPECT_THAT(ran.err, HasSubstr("1 of 6 outputs failed"));
    EXPECT_EQ(pictures("out").size(), 5u);
    auto report = reportAt("r.json");
    EXPECT_EQ(report["summary"]["failed"], 1);
    EXPECT_EQ(report["frames"][2]["state"], "failed");
    EXPECT_THAT(report["frames"][2]["error"].get<std::string>(), HasSubstr("f.0003.exr"));
    ran = brume("apply depth_fog list.txt -o out2 --keep-going");
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, HasSubstr("gone.exr"));
    EXPECT_EQ(pictures("out2").size(), 2u);
    // Without --keep-going the first bad frame ends the run.
    ran = brume("apply depth_fog in -o out3 --jobs 1");
    EXPECT_EQ(ran.status, 3);
    EXPECT_EQ(pictures("out3").size(), 2u);
    EXPECT_THAT(ran.err, HasSubstr("--keep-going would try the others"));
}

TEST_F(Batch, aFrameWithoutItsDepthIsNamedAndTheOthersAreMade) {
    addFrames(3);
    for (const char* name : {"f.0001.exr", "f.0003.exr"})
        fs::copy(path("in/" + std::string(name)), path("z_" + std::string(name)));
    std::string apply = "apply depth_fog in --depth '../z_{stem}.exr' -o out";
    auto ran = brume(apply);
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, HasSubstr("f.0002.exr: its depth"));
    EXPECT_FALSE(fs::exists(path("out"))) << "known before any work";
    ran = brume(apply + " --keep-going");
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, HasSubstr("1 of 3 outputs failed"));
    EXPECT_THAT(ran.err, HasSubstr("f.0002.exr"));
    EXPECT_EQ(pictures("out").size(), 2u);
}

TEST_F(Batch, spacesAroundASettingCountForNothing) {
    addFrames(1);
    auto ran = brume("apply depth_fog in -o out --set ' depth_fog.visibility = 40, 80 ' --report r.json");
    ASSERT_EQ(ran.status, 0) << ran.err;
    auto frames = reportAt("r.json")["frames"];
    ASSERT_EQ(frames.size(), 2u);
    EXPECT_EQ(frames[0]["settings"]["depth_fog.visibility"], 40);
    EXPECT_EQ(frames[1]["settings"]["depth_fog.visibility"], 80);
}

TEST_F(Batch, shardsTogetherAreTheWholeRun) {
    addFrames(10);
    const std::string apply =
        "apply depth_fog in --format png --set 'depth_fog.visibility=random(20,90)' --no-sheet ";
    ASSERT_EQ(brume(apply + "-o whole").status, 0);
    for (std::string shard : {"3/3", "1/3", "2/3"}) {
        auto ran = brume(apply + "-o parts --shard " + shard + " --report r" + shard.substr(0, 1) + ".json");
        ASSERT_EQ(ran.status, 0) << ran.err;
    }
    EXPECT_TRUE(pictures("parts") == pictures("whole"));
    std::set<int> indexes;
    for (const char* name : {"r1.json", "r2.json", "r3.json"}) {
        auto report = reportAt(name);
        for (const auto& frame : report["frames"]) indexes.insert(frame["index"].get<int>());
    }
    EXPECT_EQ(indexes.size(), 10u);
    auto merged =
        test::run(folder_, "'" BRUME_SOURCE_DIR "/samples/cluster/merge_reports.py' r3.json r1.json r2.json");
    ASSERT_EQ(merged.status, 0) << merged.err;
    auto whole = nlohmann::json::parse(merged.out);
    EXPECT_EQ(whole["summary"]["made"], 10);
    for (const char* key : {"version", "preset", "seed", "backend"}) {
        ASSERT_TRUE(whole.contains(key)) << key;
        EXPECT_EQ(whole[key], reportAt("r1.json")[key]);
    }
    for (size_t k = 0; k < 10; k++) EXPECT_EQ(whole["frames"][k]["index"], k);
    EXPECT_EQ(
        test::run(folder_, "'" BRUME_SOURCE_DIR "/samples/cluster/merge_reports.py' r1.json r1.json").status,
        1);
}

TEST_F(Batch, twoRunsIntoOneFolderAreRefused) {
    addFrames(2);
    fs::create_directory(path("out"));
    auto ran = test::run(
        folder_, "flock -x out sleep 3 & sleep .3; BRUME apply depth_fog in -o out; s=$?; kill %1; exit $s");
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, HasSubstr("another brume is writing into 'out'"));
}

TEST_F(Batch, aContactSheetThatCannotBeWrittenCostsNoReport) {
    addFrames(9);
    fs::create_directories(path("out/contact_sheet.png/full"));
    const auto ran = brume("apply depth_fog in -o out --report r.json");
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, testing::HasSubstr("brume: out/contact_sheet.png: is a folder"));
    EXPECT_EQ(reportAt("r.json")["summary"]["made"], 9);
}

TEST_F(Batch, outputsThatWouldMeetAreRefusedBeforeAnyWork) {
    addFrame("a/one.exr");
    addFrame("b/one.exr");
    expectError("apply depth_fog a b -o out", 2, "use a name with {index}");  // {stem} would not help
    addFrame("b/two.exr");
    expectError("apply depth_fog b -o 'out/x{param}.png'", 2, "use a name with {stem}");
    fs::remove(path("b/two.exr"));
    expectError("apply depth_fog a b -o one.exr", 2, "one file for 2 frames");
    expectError("apply depth_fog a b -o a", 2, "is an input");
    EXPECT_EQ(brume("apply depth_fog a b -o 'out/{index:3}_{stem}.png'").status, 0);
    EXPECT_EQ(pictures("out").size(), 2u);
}

TEST_F(Batch, persistentEffectsPassInOrder) {
    addFrames(4);
    // Each picture is the mean of this frame and the last picture.
    addText("trail.fs", R"(/*{"ISFVSN": "2", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}],
"PASSES": [{"TARGET": "last", "PERSISTENT": true, "FLOAT": true}, {}]}*/
void main() {
    if (PASSINDEX == 0) gl_FragColor = mix(IMG_THIS_PIXEL(last), IMG_THIS_PIXEL(inputImage), 0.5);
    else gl_FragColor = IMG_THIS_PIXEL(last);
}
)");
    std::map<std::string, std::string> first;
    for (std::string jobs : {"1", "4"}) {
        fs::remove_all(path("out"));
        auto ran = brume("apply ./trail.fs in -o out --jobs " + jobs);
        ASSERT_EQ(ran.status, 0) << ran.err;
        if (first.empty()) first = pictures("out");
        EXPECT_TRUE(pictures("out") == first);
    }
    ASSERT_EQ(brume("apply ./trail.fs in/f.0004.exr -o alone.exr").status, 0);
    EXPECT_NE(bytesOf(path("alone.exr")), first["f.0004.exr"]);
    expectError("apply ./trail.fs in -o out --resume", 2, "from frame to frame");
}

}  // namespace
