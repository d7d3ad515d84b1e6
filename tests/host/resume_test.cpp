// Outputs that are there already: how they were made, whether they still are what they should be, --resume.
#include "error.hpp"
#include "host/many_frames.hpp"

using namespace brume;
using brume::test::bytesOf;
using testing::HasSubstr;
namespace fs = std::filesystem;

namespace {

class Resume : public test::ManyFrames {};

TEST_F(Resume, makesOnlyWhatIsMissing) {
    addFrames(5);
    ASSERT_EQ(brume("apply depth_fog in -o out").status, 0);
    auto whole = pictures("out");
    fs::remove(path("out/f.0002.exr"));
    fs::remove(path("out/f.0005.exr"));
    auto before = fs::last_write_time(path("out/f.0001.exr"));
    auto ran = brume("apply depth_fog in -o out --resume --report r.json");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(reportAt("r.json")["summary"]["made"], 2);
    EXPECT_EQ(reportAt("r.json")["summary"]["up_to_date"], 3);
    EXPECT_EQ(fs::last_write_time(path("out/f.0001.exr")), before);
    EXPECT_EQ(pictures("out").size(), whole.size());
    EXPECT_THAT(ran.out, HasSubstr("3 were up to date"));
    ran = brume("apply depth_fog in -o out --resume");
    EXPECT_EQ(ran.out, "0 made; 5 were up to date\n") << "no rates of nothing";
}

TEST_F(Resume, inspectShowsHowAPictureWasMade) {
    addFrames(2);
    ASSERT_EQ(brume("apply depth_fog in -o out --format png --set depth_fog.visibility=37 --seed 5").status,
              0);
    auto ran = brume("inspect out/f.0002.png");
    EXPECT_EQ(ran.status, 0) << ran.err;
    for (const char* word :
         {"made by   brume ", "in/f.0002.exr", "seed 5, frame 1", "depth_fog.visibility = 37",
          "\"visibility\":37", "its input is as it was", "brume apply --like out/f.0002.png -o COPY"})
        EXPECT_THAT(ran.out, HasSubstr(word));
    fs::remove(path("in/f.0002.exr"));
    EXPECT_THAT(brume("inspect out/f.0002.png").out, HasSubstr("which is gone"));
    // With its depth it is a frame, too.
    ASSERT_EQ(brume("apply depth_fog in -o deep --with-depth").status, 0);
    ran = brume("inspect deep/f.0001.exr");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("made by   brume "));
    EXPECT_THAT(ran.out, HasSubstr("  depth     "));
}

TEST_F(Resume, refusesWhatWasMadeOtherwise) {
    addFrames(2);
    ASSERT_EQ(brume("apply depth_fog in -o out").status, 0);
    auto ran = brume("apply depth_fog in -o out --resume --set depth_fog.visibility=7");
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, HasSubstr("another preset"));
    EXPECT_THAT(brume("apply depth_fog in -o out --resume --seed 9").err, HasSubstr("seed"));
    addFrame("in/f.0001.exr", {40, 24}, 77);
    ran = brume("apply depth_fog in -o out --resume");
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, HasSubstr("changed"));
    addText("out/f.0001.exr", bytesOf(path("in/f.0002.exr")));
    EXPECT_THAT(brume("apply depth_fog in -o out --resume").err, HasSubstr("does not say how it was made"));
}

// Whoever writes an effect would take the old pictures for the new effect's.
TEST_F(Resume, noticesThatAnEffectChanged) {
    addFrames(2);
    auto addEffect = [&](const char* share) {
        addText(
            "dim.fs",
            text("/*{\"ISFVSN\": \"2\", \"INPUTS\": [{\"NAME\": \"inputImage\", \"TYPE\": \"image\"}]}*/\n",
                 "void main() { gl_FragColor = ", share, " * IMG_THIS_PIXEL(inputImage); }\n"));
    };
    addEffect("0.5");
    ASSERT_EQ(brume("apply ./dim.fs in -o out").status, 0);
    ASSERT_EQ(brume("apply ./dim.fs in -o out --resume").status, 0);
    addEffect("0.4");
    const auto ran = brume("apply ./dim.fs in -o out --resume");
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, HasSubstr("was made before an effect of it changed"));
}

// What is asked for besides the picture is made, too, and is of the same making as the picture.
TEST_F(Resume, makesKeptImagesThatAreMissing) {
    addFrames(2);
    ASSERT_EQ(brume("apply depth_fog in -o whole --keep transmittance --keep depth.npy").status, 0);
    const auto whole = pictures("whole");
    const std::string resume = "apply depth_fog in -o out --keep transmittance --keep depth.npy --resume";
    ASSERT_EQ(brume("apply depth_fog in -o out").status, 0);
    auto ran = brume(resume + " --report r.json");  // a picture made without them
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(reportAt("r.json")["summary"]["made"], 2);
    EXPECT_TRUE(pictures("out") == whole);
    fs::remove(path("out/f.0002.depth.npy"));  // one that was lost
    ASSERT_EQ(brume(resume + " --report r.json").status, 0);
    EXPECT_EQ(reportAt("r.json")["summary"]["made"], 1);
    EXPECT_TRUE(pictures("out") == whole);
    ASSERT_EQ(brume(resume + " --report r.json").status, 0);
    EXPECT_EQ(reportAt("r.json")["summary"]["up_to_date"], 2);
    // Kept images of an earlier fog beside pictures of a later one.
    ASSERT_EQ(brume("apply depth_fog in -o out --keep transmittance --set depth_fog.visibility=9").status, 0);
    ASSERT_EQ(brume("apply depth_fog in -o out").status, 0);
    ASSERT_EQ(brume(resume).status, 0);
    EXPECT_TRUE(pictures("out") == whole);
    // Without them there is nothing to make.
    ASSERT_EQ(brume("apply depth_fog in -o out --resume --report r.json").status, 0);
    EXPECT_EQ(reportAt("r.json")["summary"]["up_to_date"], 2);
}

TEST_F(Resume, noticesSidecarsThatCameLaterAndOtherLightMaps) {
    addFrames(1);
    ASSERT_EQ(brume("apply depth_fog in -o out").status, 0);
    addText("in/f.0001.json", R"({"camera": {"horizontal_view_degrees": 110}})");
    auto ran = brume("apply depth_fog in -o out --resume");
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, HasSubstr("made before 'in/f.0001.json' was there"));
    EXPECT_THAT(brume("inspect out/f.0001.exr").out, HasSubstr("made before 'in/f.0001.json' was there"));

    addFrame("sun.exr", {8, 8}, 1);
    addText("in/f.0001.json", R"({"lights": [{"shadow_map": "../sun.exr"}]})");
    ASSERT_EQ(brume("apply depth_fog in -o lit").status, 0);
    ASSERT_EQ(brume("apply depth_fog in -o lit --resume").status, 0);
    addFrame("sun.exr", {8, 8}, 2);
    ran = brume("apply depth_fog in -o lit --resume");
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, HasSubstr("sun.exr' changed"));
}

TEST_F(Resume, touchedButUnchangedInputsAreUpToDate) {
    addFrames(2);
    ASSERT_EQ(brume("apply depth_fog in -o out").status, 0);
    fs::last_write_time(path("in/f.0001.exr"), fs::file_time_type::clock::now() + std::chrono::hours(1));
    auto ran = brume("apply depth_fog in -o out --resume --report r.json");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(reportAt("r.json")["summary"]["up_to_date"], 2);
}

TEST_F(Resume, killedAtAnyTimeLeavesOnlyWholeFilesAndResumes) {
    addFrames(40, {320, 240});
    ASSERT_EQ(brume("apply depth_fog in -o whole --no-sheet").status, 0);
    auto whole = pictures("whole");
    for (const char* signal : {"KILL", "TERM"}) {
        fs::remove_all(path("out"));
        auto ran = test::run(
            folder_,
            std::string("BRUME apply depth_fog in -o out --no-sheet --jobs 2 & pid=$!; "
                        "while kill -0 $pid && [ $(ls out 2>/dev/null | wc -l) -lt 5 ]; do sleep .005; done; "
                        "kill -") +
                signal + " $pid; wait $pid");
        EXPECT_EQ(ran.status, signal == std::string("KILL") ? 137 : 3) << ran.err;
        if (ran.status == 3) {
            EXPECT_THAT(ran.err, HasSubstr("--resume continues"));
        }
        size_t left = 0;
        for (const auto& [name, bytes] : pictures("out")) {
            if (name[0] == '.') continue;
            EXPECT_TRUE(bytes == whole[name]) << name << " after " << signal;
            left++;
        }
        EXPECT_GE(left, 5u);
        EXPECT_LT(left, 40u);
        ran = brume("apply depth_fog in -o out --no-sheet --resume");
        EXPECT_EQ(ran.status, 0) << ran.err;
        EXPECT_TRUE(pictures("out") == whole) << "and nothing else lies there";
    }
}

}  // namespace
