#include "frame/sequence.hpp"

#include <cmath>
#include <random>

#include "frame/attributes.hpp"
#include "frame/pairing.hpp"
#include "frame/write.hpp"
#include "frame_fixture.hpp"

namespace brume {
namespace {

using test::sentenceOf;

class Sequences : public test::FrameTest {
  protected:
    void touch(std::initializer_list<const char*> names) const {
        for (const char* name : names) writeText(name, "x");
    }
    /// "color>depth" of each, without the folder.
    std::vector<std::string> expanded(const std::vector<std::string>& frames,
                                      const std::string& depth = "") const {
        std::vector<std::string> out;
        for (const FrameFiles& f : expandFrames(frames, depth)) {
            const auto local = [&](const std::string& path) {
                return path.empty() ? path : std::filesystem::path(path).lexically_relative(folder).string();
            };
            out.push_back(local(f.color) + (f.depth.empty() ? "" : ">" + local(f.depth)));
        }
        return out;
    }
    using Names = std::vector<std::string>;
};

TEST_F(Sequences, FoldersCountAsPeopleDo) {
    touch({"f10.png", "f9.png", "f009a.png", "f9.depth.exr", "notes.txt", ".hidden.png", "f9.json"});
    EXPECT_EQ(expanded({folder.string()}), (Names{"f9.png", "f009a.png", "f10.png"}));
}

// What a long run leaves beside its pictures, which another run may be given.
TEST_F(Sequences, AContactSheetIsNoFrame) {
    touch({"a.png", "contact_sheet.png", "contact_sheet_3of8.png", "contact_sheets.png"});
    EXPECT_EQ(expanded({folder.string()}), (Names{"a.png", "contact_sheets.png"}));
    EXPECT_EQ(expanded({file("contact_sheet.png")}), Names{"contact_sheet.png"}) << "named, it is meant";
}

// What apply keeps beside a picture is no frame where it says so, or the picture does; by a name alone it is.
TEST_F(Sequences, WhatApplyKeptIsNoFrame) {
    const cv::Mat image = test::randomColor({4, 3}, 0, 1, 1);
    const auto write = [&](const std::string& name, const char* kept) {
        WriteOptions options;
        if (kept) options.attributes[recordKey] = text("{\"kept\":[\"", kept, "\"]}");
        writeImage(file(name), image, options);
    };
    write("a.exr", "a.transmittance.npy");
    write("a.transmittance.npy", nullptr);
    write("b.jpg", nullptr);
    write("b.glow.exr", "b.glow.exr");
    write("c.png", "c.depth.exr");
    write("c.depth.exr", "c.depth.exr");
    write("c.final.png", nullptr);            // the user's own
    write("lone.glow.exr", "lone.glow.exr");  // its picture is elsewhere
    const Names frames = {"a.exr", "b.jpg", "c.final.png", "c.png", "lone.glow.exr"};
    EXPECT_EQ(expanded({folder.string()}), frames);
    EXPECT_EQ(expanded({file("*")}), frames);
    EXPECT_EQ(expanded({file("*.glow.exr")}), (Names{"b.glow.exr", "lone.glow.exr"}))
        << "named, they are meant";
    EXPECT_EQ(expanded({file("a.transmittance.npy")}), Names{"a.transmittance.npy"});
    EXPECT_EQ(expanded({file("c.png")}, folder.string()), Names{"c.png>c.depth.exr"});
}

TEST_F(Sequences, DepthBesideIsNoFrameAndIsFound) {
    touch({"a.png", "a.depth.exr", "b_color.npy", "b_depth.npy", "c_rgb.png", "c_depth.png", "d.jpg",
           "d_depth.png", "ocean_depth.png", "lone.depth.exr"});
    EXPECT_EQ(expanded({folder.string()}),
              (Names{"a.png", "b_color.npy", "c_rgb.png", "d.jpg", "ocean_depth.png"}));
    for (const auto& [color, depth] : {std::pair{"a.png", "a.depth.exr"},
                                       {"b_color.npy", "b_depth.npy"},
                                       {"c_rgb.png", "c_depth.png"},
                                       {"d.jpg", "d_depth.png"},
                                       {"ocean_depth.png", ""}})
        EXPECT_EQ(depthFilesBeside(file(color)), *depth ? Names{file(depth)} : Names{}) << color;
}

// Which of two is meant, nobody can tell.
TEST_F(Sequences, ADepthOfTwoFormatsIsRefused) {
    touch({"rgb/a.png", "rgb/b.png", "z/a.exr", "z/a.png", "z/b.exr", "z/unasked.exr", "z/unasked.png"});
    const std::vector<FrameFiles> frames = expandFrames({file("rgb")}, file("z"));
    ASSERT_EQ(frames.size(), 2u);
    EXPECT_EQ(frames[0].missing, file("rgb/a.png") + ": its depth could be " + file("z/a.exr") + " or " +
                                     file("z/a.png") + "; say which, as --depth 'FOLDER/{stem}.EXT'");
    EXPECT_EQ(frames[1].missing, "");
    EXPECT_EQ(expanded({file("rgb")}, file("z/{stem}.exr")),
              (Names{"rgb/a.png>z/a.exr", "rgb/b.png>z/b.exr"}));
    touch({"c.png", "c.depth.exr", "c.depth.tif"});
    EXPECT_EQ(depthFilesBeside(file("c.png")), (Names{file("c.depth.exr"), file("c.depth.tif")}));
}

TEST_F(Sequences, EndingsMayBeInCapitals) {
    touch({"A.PNG", "A.depth.EXR", "b_color.JPG", "b_depth.png"});
    EXPECT_EQ(expanded({folder.string()}), (Names{"A.PNG", "b_color.JPG"}));
    EXPECT_EQ(depthFilesBeside(file("A.PNG")), Names{file("A.depth.EXR")});
    EXPECT_EQ(depthFilesBeside(file("b_color.JPG")), Names{file("b_depth.png")});
}

TEST_F(Sequences, ALightsMapIsNoFrame) {
    touch({"walk.sun.exr", "walk_0.exr", "walk_0.depth.exr", "walk_1.exr", "walk_1.depth.exr", "one.exr",
           "one.moon.exr", "one.json", "walk_1.json"});
    writeText("walk_0.json", R"({"lights": [{"shadow_map": "walk.sun.exr"}]})");
    writeText("one.json", R"({"lights": [{"shadow_map": "walk.sun.exr"}]})");
    const Names frames = {"one.exr", "walk_0.exr", "walk_1.exr"};
    EXPECT_EQ(expanded({folder.string()}), frames);
    EXPECT_EQ(expanded({file("*.exr")}), frames);
}

TEST_F(Sequences, AMissingDepthConcernsItsFrameOnly) {
    touch({"rgb/1.png", "rgb/2.png", "rgb/3.png", "z/1.exr", "z/3.exr", "n/d_1.exr", "n/d_2.exr"});
    for (const std::string& depth : {file("z"), std::string("../z/{stem}.exr"), file("z/#.exr")}) {
        const auto frames = expandFrames({file("rgb")}, depth);
        ASSERT_EQ(frames.size(), 3u) << depth;
        EXPECT_EQ(frames[0].missing + frames[2].missing, "") << depth;
        EXPECT_NE(frames[1].missing.find("2.png"), std::string::npos) << depth;
        EXPECT_EQ(sentenceOf(ErrorKind::Io, [&] { readFrame(frames[1], 1); }), frames[1].missing);
    }
    const auto byNumber = expandFrames({file("rgb")}, file("n"));
    EXPECT_EQ(byNumber[1].depth, file("n/d_2.exr"));
    EXPECT_NE(byNumber[2].missing, "");
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { expanded({file("rgb")}, "{stem}.no"); }).find("1.png"),
              std::string::npos);
}

TEST_F(Sequences, APictureIsNotItsOwnDepth) {
    touch({"a.png", "b.png", "z/a.png", "z/b.png"});
    for (const std::string& depth : {folder.string(), file("./*.png"), file("z/..")})
        EXPECT_EQ(sentenceOf(ErrorKind::Io,
                             [&] {
                                 expanded({file("a.png"), file("b.png")}, depth);
                             }),
                  depth +
                      ": holds no depth but the pictures themselves; without --depth it is looked for in "
                      "them (EXR) and beside them, as NAME.depth.EXT");
    touch({"a.depth.exr", "b_depth.png"});
    EXPECT_EQ(expanded({file("a.png")}, folder.string()), Names{"a.png>a.depth.exr"});
}

TEST_F(Sequences, TwoViewsOfOneNumberDoNotShareADepth) {
    touch({"rgb/left_1.png", "rgb/left_2.png", "rgb/right_1.png", "rgb/right_2.png", "z/1.exr", "z/2.exr"});
    EXPECT_NE(
        sentenceOf(ErrorKind::Io, [&] { expanded({file("rgb")}, file("z")); }).find("no depth of the same"),
        std::string::npos);
    for (const FrameFiles& f : expandFrames({file("rgb/left_*.png")}, file("z"))) EXPECT_EQ(f.missing, "");
}

TEST_F(Sequences, Patterns) {
    touch({"s.0001.exr", "s.0002.exr", "s.0010.exr", "s.12345.exr", "s.003.exr", "s.abcd.exr", "t.0001.exr"});
    EXPECT_EQ(expanded({file("s.####.exr")}),
              (Names{"s.0001.exr", "s.0002.exr", "s.0010.exr", "s.12345.exr"}));
    EXPECT_EQ(expanded({file("s.%04d.exr")}),
              (Names{"s.0001.exr", "s.0002.exr", "s.0010.exr", "s.12345.exr"}));
    EXPECT_EQ(expanded({file("?.0001.exr")}), (Names{"s.0001.exr", "t.0001.exr"}));
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { expanded({file("u.####.exr")}); }).find("no file matches"),
              std::string::npos);
}

TEST_F(Sequences, DepthByPatternStemNumberOrFolder) {
    touch({"rgb/a_01.png", "rgb/a_02.png", "depth/a_01.exr", "depth/a_02.exr", "z/depth_0001.png",
           "z/depth_0002.png", "rgb/sub/a_01.npy", "rgb/sub/a_02.npy"});
    const Names byStem = {"rgb/a_01.png>depth/a_01.exr", "rgb/a_02.png>depth/a_02.exr"};
    EXPECT_EQ(expanded({file("rgb")}, file("depth")), byStem);
    EXPECT_EQ(expanded({file("rgb")}, "../depth/{stem}.exr"), byStem);
    EXPECT_EQ(expanded({file("rgb/a_##.png")}, file("z/depth_####.png")),
              (Names{"rgb/a_01.png>z/depth_0001.png", "rgb/a_02.png>z/depth_0002.png"}));
    EXPECT_EQ(expanded({file("rgb")}, file("z")),
              (Names{"rgb/a_01.png>z/depth_0001.png", "rgb/a_02.png>z/depth_0002.png"}));
    EXPECT_EQ(expanded({file("rgb")}, file("depth/*.exr")), byStem);
    for (const FrameFiles& f : expandFrames({file("rgb")}, noDepth)) EXPECT_EQ(f.depth, noDepth);
    EXPECT_EQ(expanded({file("rgb")}, file("z/depth_000?.png")),
              (Names{"rgb/a_01.png>z/depth_0001.png", "rgb/a_02.png>z/depth_0002.png"}));
    EXPECT_EQ(expanded({file("rgb/a_02.png")}, file("depth/a_02.exr")), (Names{byStem[1]}));
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { expanded({file("rgb")}, file("depth/a_01.exr")); })
                  .find("one depth file"),
              std::string::npos);
    const auto refusal = [&](const std::string& depth) {
        return sentenceOf(ErrorKind::Io, [&] { expanded({file("rgb")}, depth); });
    };
    EXPECT_NE(refusal(file("dept")).find("there is no such depth file, folder"), std::string::npos);
    EXPECT_NE(refusal(file("depth/*.tif")).find("no file matches"), std::string::npos);
    EXPECT_NE(refusal("../depth/{name}.exr").find("is written {stem}"), std::string::npos);
    // Names that differ: both places that were looked at, and what pairs otherwise.
    const std::string other = refusal("z/{stem}.png");
    EXPECT_NE(other.find("neither z/a_01.png nor " + file("rgb/z/a_01.png")), std::string::npos) << other;
    EXPECT_NE(other.find("give --depth the folder"), std::string::npos) << other;
    touch({"rgb/a_03.png"});
    EXPECT_NE(expandFrames({file("rgb")}, file("depth")).back().missing.find("a_03"), std::string::npos);
}

TEST_F(Sequences, TumPairsNearestTimestamps) {
    touch({"rgb/1.00.png", "rgb/1.05.png", "rgb/1.10.png", "depth/1.012.png", "depth/1.048.png",
           "depth/1.30.png"});
    const Names wanted = {"rgb/1.00.png>depth/1.012.png", "rgb/1.05.png>depth/1.048.png"};
    EXPECT_EQ(expanded({file("rgb")}, file("depth")), wanted) << "1.10 has none within .02 s";
    writeText("rgb.txt", "# color images\n1.00 rgb/1.00.png\n1.05 rgb/1.05.png\n1.10 rgb/1.10.png\n");
    writeText("depth.txt",
              "# depth maps\n1.012 depth/1.012.png\n1.048 depth/1.048.png\n1.30 depth/1.30.png\n");
    EXPECT_EQ(expanded({file("rgb.txt")}, file("depth.txt")), wanted);
    const std::vector<FrameFiles> frames = expandFrames({file("rgb.txt")}, file("depth.txt"));
    EXPECT_EQ(frames[0].time, 0.);
    EXPECT_NEAR(*frames[1].time, .05, 1e-12);
    writeText("associations.txt",
              "1.00 rgb/1.00.png 1.012 depth/1.012.png\n1.05 rgb/1.05.png 1.048 depth/1.048.png\n");
    EXPECT_EQ(expanded({file("associations.txt")}), wanted);
}

// What pairing closest first means, by looking at every pair.
std::vector<int> closestFirst(const std::vector<double>& frames, const std::vector<double>& depths) {
    std::vector<int> depthOf(frames.size(), -1);
    std::vector<bool> taken(depths.size());
    for (;;) {
        double least = .02;  // s, as TUM
        int frame = -1, depth = -1;
        for (size_t f = 0; f < frames.size(); f++)
            for (size_t d = 0; d < depths.size(); d++)
                if (const double apart = std::abs(frames[f] - depths[d]);
                    depthOf[f] < 0 && !taken[d] && (frame < 0 ? apart <= least : apart < least))
                    least = apart, frame = int(f), depth = int(d);
        if (frame < 0) return depthOf;
        depthOf[frame] = depth;
        taken[depth] = true;
    }
}

TEST_F(Sequences, TimesPairClosestFirst) {
    std::mt19937 random(3);
    for (int round = 0; round < 60; round++) {
        // In 64ths of a second (.015625), so that many are equal or equally far.
        const auto times = [&](int count) {
            std::vector<double> list;
            for (int k = 0; k < count; k++) list.push_back(double(random() % 12) / 64);
            return list;
        };
        const std::vector<double> frames = times(1 + round % 9), depths = times(1 + round % 7);
        std::string list, depthList;
        for (size_t k = 0; k < frames.size(); k++)
            list += std::to_string(frames[k]) + text(" f", k, ".png\n");
        for (size_t k = 0; k < depths.size(); k++)
            depthList += std::to_string(depths[k]) + text(" d", k, ".png\n");
        writeText("rgb.txt", list);
        writeText("z.txt", depthList);
        Names wanted;
        const std::vector<int> depthOf = closestFirst(frames, depths);
        for (size_t k = 0; k < frames.size(); k++)
            if (depthOf[k] >= 0) wanted.push_back(text("f", k, ".png>d", depthOf[k], ".png"));
        if (wanted.empty())
            sentenceOf(ErrorKind::Io, [&] { expanded({file("rgb.txt")}, file("z.txt")); });
        else
            EXPECT_EQ(expanded({file("rgb.txt")}, file("z.txt")), wanted) << list << "---\n" << depthList;
    }
}

// 30,000 frames and depths of one time were 900 million pairs, 20 GB.
TEST_F(Sequences, ManyEqualTimesPairQuickly) {
    std::string frames, depths;
    for (int k = 0; k < 30000; k++) frames += "1.0 a.png\n", depths += text("1.0 d", k, ".exr\n");
    writeText("rgb.txt", frames);
    writeText("z.txt", depths);
    const Names paired = expanded({file("rgb.txt")}, file("z.txt"));
    ASSERT_EQ(paired.size(), 30000u);
    EXPECT_EQ(paired.back(), "a.png>d29999.exr");
}

TEST_F(Sequences, Lists) {
    touch({"a.png", "b.png", "d/a.exr", "d/b.exr"});
    writeText("list.txt", "a.png d/a.exr\nb.png d/b.exr  # the second\n\n");
    EXPECT_EQ(expanded({file("list.txt")}), (Names{"a.png>d/a.exr", "b.png>d/b.exr"}));
    writeText("bad.txt", "a.png d/a.exr more\n");
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { expanded({file("bad.txt")}); }).find("bad.txt:1"),
              std::string::npos);
    writeText("empty.txt", "# nothing\n");
    sentenceOf(ErrorKind::Io, [&] { expanded({file("empty.txt")}); });
    sentenceOf(ErrorKind::Io, [&] { expanded({file("none.txt")}); });
}

}  // namespace
}  // namespace brume
