// The names that programs write for the picture and its depth.
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputFile.h>

#include <array>

#include "exr_fixture.hpp"
#include "frame/read.hpp"
#include "frame_fixture.hpp"

namespace brume {
namespace {

using test::ExrPart;
using test::flat;
using test::sentenceOf;

struct Layout {
    const char* program;
    std::vector<ExrPart> parts;
    float depth = 5;  ///< m; the picture's red is .5 everywhere
};

ExrPart part(std::map<std::string, float> channels, std::string name = "", std::string view = "",
             std::vector<std::string> views = {}) {
    ExrPart p;
    for (const auto& [channel, value] : channels) p.channels[channel] = flat(value);
    p.name = name;
    p.view = view;
    p.multiView = views;
    return p;
}

const std::vector<Layout>& layouts() {
    static const std::vector<Layout> all = {
        {"plain", {part({{"R", .5f}, {"G", .2f}, {"B", .1f}, {"Z", 5}})}},
        {"Blender",
         {part({{"ViewLayer.Combined.R", .5f},
                {"ViewLayer.Combined.G", .2f},
                {"ViewLayer.Combined.B", .1f},
                {"ViewLayer.Combined.A", 1},
                {"ViewLayer.Depth.Z", 5},
                {"ViewLayer.Normal.X", 9},
                {"ViewLayer.Normal.Y", 9},
                {"ViewLayer.Normal.Z", 9},
                {"ViewLayer.Mist.Z", 9}})}},
        {"Blender, two view layers",
         {part({{"Sky.Combined.R", .5f},
                {"Sky.Combined.G", .2f},
                {"Sky.Combined.B", .1f},
                {"Background.Depth.Z", 9},
                {"Sky.Depth.Z", 5}})}},
        {"Blender, Depth.V",
         {part({{"ViewLayer.Combined.R", .5f},
                {"ViewLayer.Combined.G", .2f},
                {"ViewLayer.Combined.B", .1f},
                {"ViewLayer.Depth.V", 5}})}},
        {"Nuke",
         {part({{"R", .5f},
                {"G", .2f},
                {"B", .1f},
                {"A", 1},
                {"depth.Z", 5},
                {"forward.u", 9},
                {"forward.v", 9}})}},
        {"Nuke, parts",
         {part({{"R", .5f}, {"G", .2f}, {"B", .1f}, {"A", 1}}, "rgba"), part({{"Z", 5}}, "depth")}},
        {"Nuke, layers as parts",
         {part({{"depth.Z", 5}}, "depth"), part({{"red", .5f}, {"green", .2f}, {"blue", .1f}}, "rgba")}},
        {"Unreal",
         {part({{"R", .5f},
                {"G", .2f},
                {"B", .1f},
                {"A", 1},
                {"FinalImageMovieRenderQueue_WorldDepth.R", 500},
                {"FinalImageMovieRenderQueue_WorldDepth.G", 0},
                {"FinalImageMovieRenderQueue_WorldDepth.B", 0}})}},
        {"V-Ray",
         {part({{"R", .5f}, {"G", .2f}, {"B", .1f}, {"ZDepth.R", 5}, {"ZDepth.G", 5}, {"ZDepth.B", 5}})}},
        {"Houdini",
         {part({{"R", .5f}, {"G", .2f}, {"B", .1f}, {"Pz", 5}, {"P.x", 9}, {"P.y", 9}, {"P.z", 9}})}},
        {"stereo, one part",
         {part({{"R", .5f},
                {"G", .2f},
                {"B", .1f},
                {"Z", 5},
                {"left.R", 9},
                {"left.G", 9},
                {"left.B", 9},
                {"left.Z", 9}},
               "", "", {"right", "left"})}},
        {"stereo, the other view's depth first",
         {part({{"Z", 9}}, "depth.left", "left"), part({{"Z", 5}}, "depth.right", "right"),
          part({{"R", .5f}, {"G", .2f}, {"B", .1f}}, "rgba.right", "right"),
          part({{"R", 9}, {"G", 9}, {"B", 9}}, "rgba.left", "left")}},
    };
    return all;
}

class ExrLayers : public test::FrameTest, public testing::WithParamInterface<size_t> {};

TEST_P(ExrLayers, PictureAndItsDepthAreFound) {
    const Layout& layout = layouts()[GetParam()];
    test::writeExrParts(file("a.exr"), layout.parts);
    const FramePair frame = readFrame(file("a.exr"));
    const cv::Vec4f p = frame.color.at<cv::Vec4f>(3, 3);
    if (layout.parts[0].view == "left") {
        // The first part decides the view: its own picture, its own depth.
        EXPECT_EQ(p[0], 9);
        EXPECT_EQ(frame.depth.at<float>(3, 3), 9);
        return;
    }
    EXPECT_EQ(p, cv::Vec4f(.5f, .2f, .1f, 1));
    EXPECT_FLOAT_EQ(frame.depth.at<float>(3, 3), layout.depth);
}

INSTANTIATE_TEST_SUITE_P(Programs, ExrLayers, testing::Range(size_t(0), layouts().size()),
                         [](const auto& info) {
                             std::string name = layouts()[info.param].program;
                             std::erase_if(
                                 name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
                             return name;
                         });

class ExrWindows : public test::FrameTest {};

TEST_F(ExrWindows, OneViewsDepthNeverServesTheOther) {
    // Only the left view has depth; the main view is the right one.
    test::writeExrParts(
        file("a.exr"),
        {part(
            {{"R", .5f}, {"G", .2f}, {"B", .1f}, {"left.R", 9}, {"left.G", 9}, {"left.B", 9}, {"left.Z", 9}},
            "", "", {"right", "left"})});
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { readFrame(file("a.exr")); }).find("no depth"),
              std::string::npos);
}

TEST_F(ExrWindows, DataWindowIsPlacedInTheDisplayWindow) {
    ExrPart p = part({{"R", 1}, {"G", 1}, {"B", 1}, {"A", 1}, {"Z", 3}});  // 8 × 6
    p.displaySize = {20, 10};
    p.offset = {-2, 7};  // its left and lower parts are outside
    test::writeExrParts(file("a.exr"), {p});
    const FramePair frame = readFrame(file("a.exr"));
    ASSERT_EQ(frame.size(), cv::Size(20, 10));
    for (int j = 0; j < 10; ++j)
        for (int i = 0; i < 20; ++i) {
            const bool inside = i < 6 && j >= 7;
            EXPECT_EQ(frame.color.at<cv::Vec4f>(j, i)[0], inside ? 1 : 0) << i << " " << j;
            EXPECT_EQ(frame.color.at<cv::Vec4f>(j, i)[3], inside ? 1 : 0);
            EXPECT_EQ(frame.depth.at<float>(j, i), inside ? 3 : INFINITY) << "nothing there: sky";
        }
}

TEST_F(ExrWindows, DataOutsideTheDisplayIsRefused) {
    ExrPart p = part({{"R", 1}, {"G", 1}, {"B", 1}, {"Z", 3}});
    p.displaySize = {20, 10};
    p.offset = {100, 0};
    test::writeExrParts(file("a.exr"), {p});
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { readFrame(file("a.exr")); }).find("display window"),
              std::string::npos);
}

TEST_F(ExrWindows, AlphaIsUnassociatedAndAGlowSurvives) {
    ExrPart p = part({{"R", .2f}, {"G", .1f}, {"B", 0}, {"A", .5f}, {"Z", 3}});
    p.channels["A"] = p.channels["A"].clone();
    p.channels["A"].at<float>(0, 0) = 0;
    test::writeExrParts(file("a.exr"), {p});
    const FramePair frame = readFrame(file("a.exr"));
    EXPECT_EQ(frame.color.at<cv::Vec4f>(2, 2), cv::Vec4f(.4f, .2f, 0, .5f));
    EXPECT_EQ(frame.color.at<cv::Vec4f>(0, 0), cv::Vec4f(.2f, .1f, 0, 0));
}

// Two pixels of premultiplied samples, not in their order.
TEST_F(ExrWindows, DeepSamplesAreFlattenedFrontToBack) {
    Imf::Header header(2, 1);
    header.compression() = Imf::ZIPS_COMPRESSION;
    header.setType(Imf::DEEPSCANLINE);
    unsigned counts[2] = {3, 2};
    float z[5] = {9, 2, 5, /**/ 4, 3}, alpha[5] = {.1f, .3f, .4f, /**/ 0, .2f},
          red[5] = {.3f, .1f, .2f, /**/ .7f, .05f};
    const auto at = [](float* values) { return std::array<float*, 2>{values, values + 3}; };
    std::array<float*, 2> ofZ = at(z), ofAlpha = at(alpha), ofRed = at(red);
    Imf::DeepFrameBuffer buffer;
    buffer.insertSampleCountSlice(Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts), sizeof counts[0]));
    for (const auto& [name, pointers] :
         {std::pair{"Z", &ofZ}, {"A", &ofAlpha}, {"R", &ofRed}, {"G", &ofRed}, {"B", &ofRed}}) {
        header.channels().insert(name, Imf::Channel(Imf::FLOAT));
        buffer.insert(name, Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(pointers->data()),
                                           sizeof(float*), 0, sizeof(float)));
    }
    {
        Imf::DeepScanLineOutputFile out(file("deep.exr").c_str(), header);
        out.setFrameBuffer(buffer);
        out.writePixels(1);
    }
    const FramePair frame = readFrame(file("deep.exr"));
    // 1 - .7·.6·.9 covered; of the light from behind .42 is left behind the sample at 5 m.
    const cv::Vec4f first = frame.color.at<cv::Vec4f>(0, 0), second = frame.color.at<cv::Vec4f>(0, 1);
    EXPECT_NEAR(first[3], .622, 1e-6);
    EXPECT_NEAR(first[0] * first[3], .1 + .7 * .2 + .42 * .3, 1e-6);
    EXPECT_EQ(frame.depth.at<float>(0, 0), 5);
    // A glow in front of nothing: half of the light is never gone, so the depth is the last that covers.
    EXPECT_NEAR(second[3], .2, 1e-6);
    EXPECT_NEAR(second[0] * second[3], .05 + .8 * .7, 1e-6);
    EXPECT_EQ(frame.depth.at<float>(0, 1), 3);
}

}  // namespace
}  // namespace brume
