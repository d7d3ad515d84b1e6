// Every way that brume apply can be wrong: a status, one sentence, no file left.
#include <cmath>
#include <filesystem>

#include "frame/write.hpp"
#include "host/program.hpp"

using namespace brume;
using testing::HasSubstr;
using ApplyErrors = brume::test::Program;

namespace {

TEST_F(ApplyErrors, inputsThatCannotBeRead) {
    addFrame("street.exr");
    addText("empty.exr", "");
    addText("empty.png", "");
    std::string whole = test::bytesOf(path("street.exr"));
    addText("cut.exr", whole.substr(0, whole.size() * 2 / 3));
    addText("noise.png", "this is no picture at all, whatever its name says");
    expectError("apply depth_fog missing.exr -o o.png", 3, "missing.exr");
    expectError("apply depth_fog empty.exr -o o.png", 3, "empty.exr");
    expectError("apply depth_fog empty.png -o o.png", 3, "empty.png");
    expectError("apply depth_fog cut.exr -o o.png", 3, "cut.exr");
    expectError("apply depth_fog noise.png -o o.png", 3, "noise.png");
    expectError("apply depth_fog . -o o.png", 2, "one file for");
    expectError("apply street.exr depth_fog -o o.png", 2, "the preset comes first");
    expectError("convert street.exr -o street.npy", 2, "convert writes EXR");
    std::filesystem::create_directories(path("scans/b"));
    std::filesystem::create_directories(path("scans/a"));
    expectError("apply depth_fog scans -o out/", 3, "name one, such as scans/a");
    expectError("apply depth_fog 'none.####.exr' -o out/", 3, "none.####.exr");
    expectError("apply depth_fog 'none*.exr' -o out/", 3, "none*.exr");
}

TEST_F(ApplyErrors, depthThatDoesNotFit) {
    FramePair frame = test::sampleFrame();
    writeImage(path("plain.png"), frame.color);
    expectError("apply depth_fog plain.png -o o.png", 3, "has no depth");
    WriteOptions data;
    data.isData = true;
    writeImage(path("small.exr"), frame.depth(cv::Rect(0, 0, 20, 20)), data);
    expectError("apply depth_fog plain.png --depth small.exr -o o.png", 3, "20 × 20");
    writeImage(path("unknown.exr"), cv::Mat(frame.depth.size(), CV_32F, cv::Scalar(std::nan(""))), data);
    expectError("apply depth_fog plain.png --depth unknown.exr -o o.png", 3, "unknown everywhere");
    expectError("apply depth_fog plain.png --depth gone.exr -o o.png", 3, "gone.exr");
}

// Distances of a room, 5000 a metre, stated as another sensor's.
TEST_F(ApplyErrors, aStatedUnitBeyondItsSensorIsDoubted) {
    const cv::Mat color = test::sampleFrame({320, 240}).color;
    cv::Mat depth(color.size(), CV_32F);
    for (int j = 0; j < depth.rows; j++) depth.row(j).setTo(35000 - 100 * j);
    writeImage(path("room.png"), color);
    WriteOptions data;
    data.isData = true;
    writeImage(path("room.depth.exr"), depth, data);
    const auto said = [&](const std::string& encoding) {
        const auto ran = brume("apply depth_fog room.png -o o.png --depth-encoding " + encoding);
        EXPECT_EQ(ran.status, 0) << ran.err;
        return ran.err;
    };
    for (const char* wrong : {"kitti", "kinect", "realsense"})
        EXPECT_THAT(said(wrong), HasSubstr(std::string("looks wrong as ") + wrong + ": scale: ")) << wrong;
    EXPECT_THAT(said("realsense"), HasSubstr("tum (2.26 to 6.96 m)?"));
    EXPECT_THAT(said("tum"), testing::Not(HasSubstr(": scale: ")));
    EXPECT_THAT(brume("inspect room.png --depth-encoding kinect").out, HasSubstr("doubt: scale"));
    const auto seen = [&](const std::string& camera) {
        return brume("apply depth_fog room.png -o o.png --depth-encoding tum --camera " + camera).err;
    };
    EXPECT_THAT(seen("fx=262,fy=262,cx=160,cy=120"), testing::Not(HasSubstr("camera")));
    EXPECT_THAT(seen("fx=525,fy=525,cx=319.5,cy=239.5"), HasSubstr("are these numbers of another size"));
    EXPECT_THAT(seen("fx=2.62,fy=262"), HasSubstr("sees 178° across"));
    EXPECT_THAT(seen("fx=262,fy=350"), HasSubstr("far from square"));
}

TEST_F(ApplyErrors, absurdHeadersTakeNoMemory) {
    std::string png = "\x89PNG\r\n\x1a\n";  // declares 2^31 - 1 pixels each way
    png += std::string("\0\0\0\rIHDR\x7f\xff\xff\xff\x7f\xff\xff\xff\x08\x06\0\0\0\0\0\0\0", 25);
    addText("bomb.png", png);
    expectError("apply depth_fog bomb.png -o o.png", 3, "bomb.png");
}

TEST_F(ApplyErrors, outputsThatCannotBeWritten) {
    addFrame("street.exr");
    addText("file", "in the way");
    std::filesystem::create_directory(path("folder.png"));
    expectError("apply depth_fog street.exr -o file/o.png", 3, "file");
    expectError("apply depth_fog street.exr -o /proc/o.png", 3, "/proc/o.png");
    expectError("apply depth_fog street.exr -o /dev/full/o.png", 3, "/dev/full");
    expectError("apply depth_fog street.exr -o o.xyz", 2, ".xyz");
}

TEST_F(ApplyErrors, aFullDiskLeavesNothing) {
    addFrame("street.exr", {1280, 960});
    auto before = files();
    // Files of at most 4 MiB (8192 blocks): writing five fails as it does on a full disk.
    auto ran = test::run(
        folder_,
        "(trap '' XFSZ; ulimit -S -f 8192; BRUME apply depth_fog street.exr -o o.png --keep depth.npy)");
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, testing::StartsWith("brume: "));
    EXPECT_THAT(ran.err, HasSubstr("o.depth.npy"));
    EXPECT_EQ(files(), before);
}

TEST_F(ApplyErrors, wrongNamesGetTheNearest) {
    addFrame("street.exr");
    expectError("apply depth_fog street.exr -o o.png --depht d.exr", 2,
                "no option '--depht' (did you mean '--depth'?); see 'brume apply --help'");
    expectError("bench --backends=cpu", 2, "did you mean '--backend'?");
    expectError("apply -e depth_fog", 2, "no option '-e'; see 'brume apply --help'");
    expectError("apply depth_fog 'a.%99999999999999999999d.png' -o out/", 2, "fits no file name");
    expectError("apply depth_fog nowhere/ -o out/", 3, "no such folder");
    const std::string apply = "apply depth_fog street.exr -o o.png ";
    expectError("apply depth_fgo street.exr -o o.png", 2, "'depth_fog'");
    expectError(apply + "--set depth_fog.visibilty=3", 2, "'visibility'");
    expectError(apply + "--set dept_fog.visibility=3", 2, "'depth_fog'");
    expectError(apply + "--set depth_fog.model=exponental", 2, "'exponential'");
    expectError(apply + "--keep transmitance", 2, "'transmittance'");
    expectError(apply + "--depth-encoding tumm", 2, "'tum'");
    expectError(apply + "--depth-encoding mm", 2, "did you mean 'millimetres'?");
    expectError(apply + "--depth-encoding m", 2, "did you mean 'metres'?");
    expectError(apply + "--depth-encoding cm", 2, "did you mean 'linear:scale_to_metres=.01'?");
    expectError(apply + "--camera hieght=2", 2, "'height'");
    expectError("apply depth_fog street.exr -o '{stemm}.png'", 2, "'stem'");
    expectError("aply depth_fog", 2, "'apply'");
    expectError(apply + "--backend vulkan", 2, "vulkan");
    expectError(apply + "--color rgb", 2, "srgb");
    expectError(apply + "--sett a.b=1", 2, "--sett");
    expectError("apply gone.json street.exr -o o.png", 2, "gone.json");
}

TEST_F(ApplyErrors, wrongValues) {
    addFrame("street.exr");
    const std::string apply = "apply depth_fog street.exr -o o.png ";
    expectError(apply + "--set depth_fog.visibility=-3", 2, "-3");
    expectError(apply + "--set depth_fog.visibility=far", 2, "far");
    expectError(apply + "--set visibility=3", 2, "effect.parameter=value");
    expectError(apply + "--set depth_fog.visibility=", 2, "empty value");
    expectError(apply + "--set 'depth_fog.visibility=random(5)'", 2, "random(LOW,HIGH)");
    expectError(apply + "--set 'depth_fog.visibility=uniform(5,9)'", 2, "'uniform(5,9)' is no way to draw");
    expectError(apply + "--set 'depth_fog.visibility=random(9,5)'", 2, "LOW ≤ HIGH");
    expectError(apply + "--set 'depth_fog.visibility=random(-9,5)'", 2, "-9");
    expectError(apply + "--shard 3/2", 2, "3/2");
    expectError(apply + "--memory lots", 2, "lots");
    expectError("apply depth_fog '' -o a.png", 3, "the name of a frame is empty");
    expectError("apply depth_fog street.exr -o street.exr", 2, "would be overwritten");
    expectError("apply depth_fog street.exr", 2, "-o");
    expectError("apply depth_fog -o o.png", 2, "FRAME");
    expectError("apply", 2, "PRESET");
}

TEST_F(ApplyErrors, wrongPresets) {
    addFrame("street.exr");
    addText("broken.json", "{ \"effects\": [ }");
    addText("typo.json", R"({"effects": [{"effect": "depth_fog", "visiblity": 3}]})");
    expectError("apply broken.json street.exr -o o.png", 2, "broken.json:1");
    expectError("apply typo.json street.exr -o o.png", 2, "'visibility'");
}

// Captures are dear: whatever writes refuses to write over what was read, by any name.
TEST_F(ApplyErrors, WhatWasReadIsNotWrittenOver) {
    addFrame("a.exr");
    ASSERT_EQ(brume("apply blend a.exr -o c.png --keep depth").status, 0);  // a frame of two files
    addText("c.json", "{}");
    std::filesystem::create_directory_symlink(".", path("here"));
    const std::string before = test::bytesOf(path("c.depth.exr"));
    for (const char* words :
         {"-o c.depth.exr", "-o c.exr --keep depth", "-o here/c.depth.exr", "-o here/c.png"}) {
        const auto ran = brume(std::string("apply depth_fog c.png ") + words);
        EXPECT_EQ(ran.status, 2) << words;
        EXPECT_THAT(ran.err, HasSubstr("is an input; it would be overwritten")) << words;
    }
    EXPECT_EQ(test::bytesOf(path("c.depth.exr")), before);
    // Nor over what another frame of the run reads.
    std::filesystem::copy_file(path("c.png"), path("k_color.png"));
    std::filesystem::copy_file(path("c.depth.exr"), path("k_depth.exr"));
    addText("k_color.json", R"({"lights": [{"shadow_map": "maps/sun.exr"}]})");
    addFrame("maps/sun.exr");
    for (const std::string place : {"k_depth.exr", "maps/sun.exr"}) {
        const std::string there = test::bytesOf(path(place));
        const auto other = "other/" + std::filesystem::path(place).filename().string();
        addFrame(other);
        const auto ran = brume("apply depth_fog " + other + " k_color.png -o './" +
                               std::filesystem::path(place).parent_path().string() + "/{stem}.exr'");
        EXPECT_EQ(ran.status, 2) << place << ran.err;
        EXPECT_THAT(ran.err, HasSubstr(place + "' is an input; it would be overwritten")) << ran.err;
        EXPECT_EQ(test::bytesOf(path(place)), there);
    }
    for (const char* report : {"c.png", "c.depth.exr", "c.json", "o.png", "here/o.png"})
        expectError(std::string("apply depth_fog c.png -o o.png --report ") + report, 2,
                    "would be overwritten");
    EXPECT_EQ(brume("inspect a.exr --picture a.exr").status, 2);
    EXPECT_EQ(brume("apply depth_fog c.png -o o.png --keep depth --report r.json").status, 0);
}

// A name with a wrong letter is the nearest of its folder's.
TEST_F(ApplyErrors, misspeltFilesAreGuessed) {
    addFrame("valley.exr", {8, 6});
    addText("mist.ini", "[depth_fog]\n");
    addText("own/mist.fs", "/*{\"ISFVSN\": \"2\"}*/\n#include \"kit/imgae.glsl\"\nvoid main() {}\n");
    expectError("apply depth_fog valey.exr -o a.png", 3,
                "valey.exr: there is no such file (did you mean 'valley.exr'?)");
    expectError("apply depth_fog valley.exr --depth vally.exr -o a.png", 3, "did you mean 'valley.exr'?");
    expectError("apply ./mits.ini valley.exr -o a.png", 2, "did you mean './mist.ini'?");
    expectError("apply ./own/mits.fs valley.exr -o a.png", 2, "did you mean './own/mist.fs'?");
    expectError("apply ./own/mist.fs valley.exr -o a.png", 2, "did you mean \"kit/image.glsl\"?");
}

}  // namespace
