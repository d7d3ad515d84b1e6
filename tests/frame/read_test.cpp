#include "frame/read.hpp"

#include <OpenImageIO/imageio.h>

#include <nlohmann/json.hpp>

#include "exr_fixture.hpp"
#include "frame/airlight.hpp"
#include "frame/capture.hpp"
#include "frame/color_encoding.hpp"
#include "frame/guided_depth.hpp"
#include "frame/write.hpp"
#include "frame_fixture.hpp"

namespace brume {
namespace {

using test::bitsThatDiffer;
using test::flat;
using test::randomColor;
using test::sentenceOf;

class Reading : public test::FrameTest {
  protected:
    /// By another library, so that nothing reads only what it wrote.
    void writeThroughOiio(const std::string& name, const cv::Mat& pixels,
                          const std::string& compression = "") {
        const OIIO::TypeDesc type = pixels.depth() == CV_8U    ? OIIO::TypeUInt8
                                    : pixels.depth() == CV_16U ? OIIO::TypeUInt16
                                                               : OIIO::TypeFloat;
        OIIO::ImageSpec spec(pixels.cols, pixels.rows, pixels.channels(), type);
        spec["oiio:UnassociatedAlpha"] = 1;
        if (!compression.empty()) spec["compression"] = compression;
        const auto out = OIIO::ImageOutput::create(file(name));
        ASSERT_TRUE(out && out->open(file(name), spec) && out->write_image(type, pixels.data) &&
                    out->close());
    }

    /// 6 × 4, every number different.
    static cv::Mat ramp(int type) {
        cv::Mat pixels(4, 6, type);
        for (int k = 0; k < 24 * pixels.channels(); ++k) {
            if (pixels.depth() == CV_8U) pixels.ptr<uchar>()[k] = uchar(10 + 3 * k);
            if (pixels.depth() == CV_16U) pixels.ptr<ushort>()[k] = ushort(1000 + 251 * k);
            if (pixels.depth() == CV_32F) pixels.ptr<float>()[k] = .25f + .5f * float(k);
        }
        return pixels;
    }
    static std::string rawFloats(const cv::Mat& pixels, bool swap, bool upsideDown) {
        std::string bytes;
        for (int j = 0; j < pixels.rows; ++j) {
            const cv::Mat row = pixels.row(upsideDown ? pixels.rows - 1 - j : j);
            for (int k = 0; k < row.cols * row.channels(); ++k) {
                char b[4];
                std::memcpy(b, row.ptr<float>() + k, 4);
                if (swap) std::reverse(b, b + 4);
                bytes.append(b, 4);
            }
        }
        return bytes;
    }
    static std::string npy(const std::string& type, const std::string& shape, const std::string& data) {
        std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + shape + "), }";
        header.resize(118, ' ');
        return std::string("\x93NUMPY\x01\x00", 8) + std::string("\x76\x00", 2) + header + data;
    }
};

TEST_F(Reading, IntegersOfEveryFormatAreFractions) {
    for (const char* name : {"a.png", "a.tif"})
        for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3, CV_16UC4}) {
            const cv::Mat pixels = ramp(type);
            writeThroughOiio(name, pixels);
            const cv::Mat read = readImage(file(name));
            cv::Mat wanted;
            pixels.convertTo(wanted, CV_32F, pixels.depth() == CV_8U ? 1 / 255. : 1 / 65535.);
            EXPECT_EQ(bitsThatDiffer(read, wanted), 0) << name << " " << type;
        }
}

TEST_F(Reading, IntegerColourIsDecodedAndFloatColourIsNot) {
    writeThroughOiio("a.png", cv::Mat(2, 2, CV_8UC3, cv::Scalar(188, 188, 188)));
    EXPECT_NEAR(readColor(file("a.png")).at<cv::Vec4f>(0, 0)[0], srgbDecode(188 / 255.), 1e-6);
    writeThroughOiio("a.jpg", cv::Mat(16, 16, CV_8UC3, cv::Scalar(188, 188, 188)));
    EXPECT_NEAR(readColor(file("a.jpg")).at<cv::Vec4f>(0, 0)[0], srgbDecode(188 / 255.), .01);
    writeThroughOiio("a.hdr", cv::Mat(16, 16, CV_32FC3, cv::Scalar(7.5, .5, .25)));
    EXPECT_NEAR(readColor(file("a.hdr")).at<cv::Vec4f>(0, 0)[0], 7.5, .05);
    writeThroughOiio("a.tif", ramp(CV_32FC3));
    EXPECT_EQ(readColor(file("a.tif")).at<cv::Vec4f>(0, 0)[0], .25f);
}

TEST_F(Reading, TheContentDecidesNotTheEnding) {
    writeThroughOiio("a.png", ramp(CV_8UC3));
    std::filesystem::rename(file("a.png"), file("a.jpg"));
    EXPECT_EQ(readImage(file("a.jpg")).channels(), 3);
}

TEST_F(Reading, PfmScaleIsByteOrderAndNothingElse) {
    const cv::Mat pixels = ramp(CV_32FC1);
    struct Case {
        const char* header;
        bool big;
    };
    for (const Case& c :
         {Case{"Pf\n6 4\n-1.0\n", false}, Case{"Pf\n6 4\n1.0\n", true}, Case{"Pf\n6 4\n-0.00392\n", false},
          Case{"Pf 6 4 255 ", true}, Case{"Pf\r\n6 4\r\n-1\r\n", false},
          Case{"Pf\n# made by hand\n6\n4\n-1\n", false}}) {
        writeText("a.pfm", c.header + rawFloats(pixels, c.big, true));
        EXPECT_EQ(bitsThatDiffer(readImage(file("a.pfm")), pixels), 0) << c.header;
    }
    const cv::Mat color = ramp(CV_32FC3);
    writeText("a.pfm", "PF\n6 4\n-1\n" + rawFloats(color, false, true));
    EXPECT_EQ(bitsThatDiffer(readImage(file("a.pfm")), color), 0);
    for (const char* bad : {"Pf\n6 x\n-1\n", "Pf\n6 4\n0\n", "Pf\n-6 4\n-1\n", "Pf\n6 -1e31\n-1\n",
                            "Pf\n6.5 4\n-1\n", "Pf\n", "Pf\n6 4\nnan\n"}) {
        writeText("a.pfm", bad + rawFloats(pixels, false, true));
        sentenceOf(ErrorKind::Io, [&] { readImage(file("a.pfm")); });
    }
}

TEST_F(Reading, NpyOfEveryNumberType) {
    const cv::Mat pixels = ramp(CV_32FC1);
    writeText("a.npy", npy("<f4", "4, 6", rawFloats(pixels, false, false)));
    EXPECT_EQ(bitsThatDiffer(readImage(file("a.npy")), pixels), 0);
    writeText("a.npy", npy(">f4", "4, 6", rawFloats(pixels, true, false)));
    EXPECT_EQ(bitsThatDiffer(readImage(file("a.npy")), pixels), 0);
    writeText("a.npy", npy("<f4", "1, 4, 6, 1", rawFloats(pixels, false, false)));
    EXPECT_EQ(bitsThatDiffer(readImage(file("a.npy")), pixels), 0);
    writeText("a.npy", npy("<f4", "1, 4, 6", rawFloats(pixels, false, false)));
    EXPECT_EQ(bitsThatDiffer(readImage(file("a.npy")), pixels), 0);
    writeText("a.npy", npy("<f4", "1, 8, 3", rawFloats(pixels, false, false)));
    EXPECT_EQ(readImage(file("a.npy")).size(),
              cv::Size(8, 1));  // a row of colours, no tall image of three columns
    std::string doubles, halves, shorts;
    for (int k = 0; k < 24; ++k) {
        const double d = pixels.ptr<float>()[k];
        doubles.append(reinterpret_cast<const char*>(&d), 8);
        const cv::float16_t h(static_cast<float>(d));
        halves.append(reinterpret_cast<const char*>(&h), 2);
        const ushort s = ushort(k * 2000);
        shorts.append(reinterpret_cast<const char*>(&s), 2);
    }
    writeText("a.npy", npy("<f8", "4, 6", doubles));
    EXPECT_EQ(bitsThatDiffer(readImage(file("a.npy")), pixels), 0);
    writeText("a.npy", npy("<f2", "4, 6", halves));
    EXPECT_EQ(bitsThatDiffer(readImage(file("a.npy")), pixels), 0) << "all are halves";
    writeText("a.npy", npy("<u2", "4, 6", shorts));
    EXPECT_FLOAT_EQ(readImage(file("a.npy")).at<float>(3, 5), 23 * 2000 / 65535.f);
    for (const auto& [type, shape] :
         {std::pair("<c8", "4, 6"), std::pair("<f4", "24,"), std::pair("<f4", "4, 6, 5"),
          std::pair("<f4", "4, 600"), std::pair("|O", "4, 6")}) {
        writeText("a.npy", npy(type, shape, rawFloats(pixels, false, false)));
        sentenceOf(ErrorKind::Io, [&] { readImage(file("a.npy")); });
    }
}

TEST_F(Reading, SintelDpt) {
    const cv::Mat pixels = ramp(CV_32FC1);
    writeText("a.dpt", std::string("PIEH\x06\0\0\0\x04\0\0\0", 12) + rawFloats(pixels, false, false));
    EXPECT_EQ(bitsThatDiffer(readImage(file("a.dpt")), pixels), 0);
}

TEST_F(Reading, EveryEncodingConvertsThereAndBack) {
    // To the one-file form and back: depth to the bit, whatever it was stored as; colour to the bit too.
    cv::Mat z(6, 8, CV_32F);
    for (int k = 0; k < 48; ++k) z.ptr<float>()[k] = .8f + 1.7f * float(k);
    writeThroughOiio("a.png", ramp(CV_8UC3));
    cv::Mat picture(6, 8, CV_8UC3);
    cv::randu(picture, 0, 255);
    writeThroughOiio("a.png", picture);
    for (const char* encoding :
         {"tum", "kitti", "realsense", "linear:scale_to_metres=.01", "sintel", "blender", "inverse:scale=.5",
          "middlebury:focal_baseline=300,offset=20", "opengl:near=.1,far=200",
          "direct3d:near=.1,far=200,reversed=true", "vulkan:near=.1,far=infinite,reversed=true",
          "reshade:near=.1,far=200", "opengl:near=.1,far=200,range=-1,range=1", "linear:along_ray=true"}) {
        const DepthEncoding e = parseDepthEncoding(encoding);
        cv::Mat stored(z.size(), CV_32F);
        for (int k = 0; k < 48; ++k) stored.ptr<float>()[k] = float(encodeDepth(z.ptr<float>()[k], e));
        stored.at<float>(0, 0) = float(encodeDepth(DepthEncoding::infinity, e));
        stored.at<float>(0, 1) = NAN;
        WriteOptions data;
        data.isData = true;
        writeImage(file("a.depth.npy"), stored, data);
        ReadOptions options;
        options.encoding = e;
        const FramePair frame = readFrame(file("a.png"), options);
        WriteOptions whole;
        whole.halfColor = false;
        writeFrame(file("one.exr"), frame, whole);
        const FramePair back = readFrame(file("one.exr"));
        EXPECT_EQ(readCapture(file("one.exr")).stated.value_or(parseDepthEncoding("tum")).scaleToMetres, 1)
            << "said, so that inspect need not rank what it could be";
        EXPECT_EQ(bitsThatDiffer(back.color, frame.color), 0) << encoding;
        EXPECT_EQ(bitsThatDiffer(back.depth, frame.depth), 0) << encoding;
        EXPECT_EQ(back.camera.fx, frame.camera.fx);
        EXPECT_EQ(frame.depth.at<float>(0, 0), INFINITY) << encoding;
        EXPECT_TRUE(std::isnan(frame.depth.at<float>(0, 1))) << encoding;
        std::filesystem::remove(file("one.exr"));
    }
}

TEST_F(Reading, SidecarSaysWhatFilesCannot) {
    writeThroughOiio("a.png", cv::Mat(4, 6, CV_8UC3, cv::Scalar(128, 128, 128)));
    std::filesystem::create_directory(file("d"));
    writeThroughOiio("d/z.png", cv::Mat(4, 6, CV_16UC1, cv::Scalar(2500)));
    writeText("a.json", R"({"depth": {"file": "d/z.png", "encoding": "tum"}, "color": {"encoding": "linear"},
        "camera": {"fx": 7, "fy": 8, "cx": 2.5, "cy": 1.5, "pixel_centres": "whole", "height": 2, "pitch_degrees": 90},
        "time": 1.25, "lights": [1]})");
    const FramePair frame = readFrame(file("a.png"));
    EXPECT_FLOAT_EQ(frame.depth.at<float>(1, 1), .5f);
    EXPECT_FLOAT_EQ(frame.color.at<cv::Vec4f>(0, 0)[0], 128 / 255.f);
    EXPECT_EQ(frame.camera.fy, 8);
    EXPECT_EQ(frame.camera.cx, 3) << "whole numbers are pixel centres there";
    EXPECT_EQ(frame.camera.cy, 2) << "in both directions";
    EXPECT_NEAR(frame.camera.worldFromCamera(1, 2), -1, 1e-12) << "looks straight up";
    EXPECT_EQ(frame.time, 1.25);
    EXPECT_EQ((*frame.extras)["lights"][0], 1);

    // One focal length serves both ways.
    for (const char* one : {"fx", "fy"}) {
        writeText("a.json", std::string(R"({"depth": {"file": "d/z.png", "encoding": "tum"}, "camera": {")") +
                                one + "\": 7}}");
        EXPECT_EQ(readFrame(file("a.png")).camera.fx, 7) << one;
        EXPECT_EQ(readFrame(file("a.png")).camera.fy, 7) << one;
    }

    const auto refusal = [&](const std::string& json) {
        writeText("a.json", json);
        return sentenceOf(ErrorKind::Io, [&] { readFrame(file("a.png")); });
    };
    EXPECT_NE(refusal("{\"depth\": {\"fil\": 1}}").find("fil"), std::string::npos);
    EXPECT_NE(refusal("{\"camera\": {\"fx\": -1}}").find("focal"), std::string::npos);
    EXPECT_NE(refusal("{\"camera\": {\"fov\": 1}}").find("fov"), std::string::npos);
    EXPECT_NE(refusal("{\"color\": {\"encoding\": \"rec2020\"}}").find("rec2020"), std::string::npos);
    EXPECT_NE(refusal("{").find("a.json"), std::string::npos);
    EXPECT_NE(refusal("[]").find("object"), std::string::npos);
}

TEST_F(Reading, OneFileFormKeepsWhatTheSidecarKnewBesides) {
    std::filesystem::create_directory(file("out"));
    test::writeExrParts(file("a.exr"), {{{{"R", flat(1)}, {"G", flat(1)}, {"B", flat(1)}, {"Z", flat(2)}}}});
    test::writeExrParts(file("sun.exr"), {{{{"Y", flat(.5f)}}}});
    writeText("a.json",
              R"({"lights": [{"shadow_map": "sun.exr"}], "camera": {"horizontal_view_degrees": 80}})");
    const FramePair frame = readFrame(file("a.exr"));
    writeFrame(file("out/b.exr"), frame);
    const FramePair back = readFrame(file("out/b.exr"));
    ASSERT_TRUE(back.extras);
    EXPECT_EQ((*back.extras)["lights"], (*frame.extras)["lights"]);
    const std::filesystem::path map =
        std::filesystem::path((*back.extras)["sidecar_folder"].get<std::string>()) / "sun.exr";
    EXPECT_EQ(std::filesystem::weakly_canonical(map), std::filesystem::weakly_canonical(file("sun.exr")))
        << "names in it still lead to the same place";
}

TEST_F(Reading, DepthOfAnotherSizeFollowsColourEdges) {
    // Red left of column 100, blue right of it; depth a tenth of the size.
    cv::Mat color(120, 200, CV_8UC3, cv::Scalar(200, 30, 30)), depth(12, 20, CV_16UC1, cv::Scalar(1000));
    color(cv::Rect(104, 0, 96, 120)).setTo(cv::Scalar(30, 30, 200));
    depth(cv::Rect(10, 0, 10, 12)).setTo(8000);  // its own edge lies 4 px off
    depth(cv::Rect(1, 1, 4, 4)).setTo(0);
    writeThroughOiio("a.png", color);
    writeThroughOiio("a.depth.png", depth);
    ReadOptions options;
    options.encoding = parseDepthEncoding("millimetres");
    const FramePair frame = readFrame(file("a.png"), options);
    ASSERT_EQ(frame.depth.size(), frame.color.size());
    // Measured: 0. Nothing crosses an edge of that contrast, and within it all are alike.
    for (const int i : {0, 60, 97}) EXPECT_NEAR(frame.depth.at<float>(60, i), 1, 1e-6) << i;
    for (const int i : {107, 150, 199}) EXPECT_NEAR(frame.depth.at<float>(60, i), 8, 1e-5) << i;
    EXPECT_TRUE(std::isnan(frame.depth.at<float>(25, 25)))
        << "unknown stays unknown, but for islands of a sample or two";
    writeThroughOiio("a.depth.png", cv::Mat(20, 20, CV_16UC1, cv::Scalar(1000)));
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { readFrame(file("a.png"), options); }).find("another shape"),
              std::string::npos);
}

TEST_F(Reading, DepthThatCannotBeDepthIsRefused) {
    writeThroughOiio("a.png", cv::Mat(4, 6, CV_8UC3, cv::Scalar(9, 9, 9)));
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { readFrame(file("a.png")); }).find("--depth"),
              std::string::npos);
    writeThroughOiio("a.depth.png", ramp(CV_16UC3));
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { readFrame(file("a.png")); }).find("differ"), std::string::npos);
    writeThroughOiio("a.depth.png", ramp(CV_16UC1));
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { readFrame(file("a.png")); }).find("inspect"),
              std::string::npos);
    writeThroughOiio("a.depth.png", cv::Mat(4, 6, CV_16UC3, cv::Scalar(700, 700, 700)));
    ReadOptions tum;
    tum.encoding = parseDepthEncoding("tum");
    EXPECT_FLOAT_EQ(readFrame(file("a.png"), tum).depth.at<float>(0, 0), .14f)
        << "three equal channels are one";
    writeThroughOiio("a.depth.png", cv::Mat::zeros(4, 6, CV_16UC1));
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { readFrame(file("a.png"), tum); }).find("unknown everywhere"),
              std::string::npos);
}

TEST(SmoothDepth, EvensOutASurfaceAndStopsAtEdges) {
    cv::Mat color(60, 80, CV_32FC4, cv::Scalar(.8, .1, .1, 1)), depth(60, 80, CV_32F);
    color(cv::Rect(40, 0, 40, 60)).setTo(cv::Scalar(.1, .1, .8, 1));
    std::mt19937 generator(3);
    std::normal_distribution<float> noise(0, .05f);
    for (int j = 0; j < 60; ++j)
        for (int i = 0; i < 80; ++i) depth.at<float>(j, i) = (i < 40 ? 2 : 10) * (1 + noise(generator));
    depth.at<float>(0, 0) = INFINITY;
    const cv::Mat before = depth.clone();
    smoothDepth(color, depth, 8);
    cv::Scalar mean, roughBefore, roughAfter;
    cv::meanStdDev(before(cv::Rect(2, 2, 37, 56)), mean, roughBefore);
    cv::meanStdDev(depth(cv::Rect(2, 2, 37, 56)), mean, roughAfter);
    EXPECT_LT(roughAfter[0], .3 * roughBefore[0]);
    EXPECT_NEAR(mean[0], 2, .02);
    EXPECT_NEAR(depth.at<float>(30, 41), 10, .5);
    EXPECT_EQ(depth.at<float>(0, 0), INFINITY);
}

TEST(Airlight, OfAPathTracedFogIsItsColour) {
    const std::filesystem::path captures = BRUME_CAPTURES;
    if (captures.empty()) GTEST_SKIP() << "BRUME_CAPTURES is not set";
    FramePair frame = readFrame((captures / "blender/flat_fog.exr").string());
    const cv::Vec3d truth(.60, .65, .70);
    // Measured: 2.39e-4, which is how far the halves nearest to it lie.
    EXPECT_LT(cv::norm(pickAirlight(frame).color - truth), .001);
    EXPECT_EQ(pickAirlight(frame).how, "median of the sky");
    frame.depth.setTo(300, frame.depth == INFINITY);
    EXPECT_LT(cv::norm(pickAirlight(frame).color - truth), .001);
    EXPECT_EQ(pickAirlight(frame).how, "dark channel");
    // Below the horizon nothing is fogged fully: the dark channel comes near, from below.
    FramePair street = frame;
    const cv::Rect lower(0, 210, 640, 150);
    street.color = frame.color(lower).clone();
    street.depth = frame.depth(lower).clone();
    EXPECT_LT(cv::norm(pickAirlight(street).color - truth), .35);
}

// White before, grey behind, and a few pixels of blue sky: a sky of 1 % is taken for one, .99 % is not.
TEST(Airlight, IsTheSkysFromOnePercentOnElseTheFartherHalfs) {
    FramePair frame;
    frame.color = cv::Mat(100, 100, CV_32FC4, cv::Scalar(1, 1, 1, 1));
    frame.depth = cv::Mat(100, 100, CV_32F, cv::Scalar(5));
    frame.color.rowRange(0, 60).setTo(cv::Scalar(.4, .5, .6, 1));
    frame.depth.rowRange(0, 60).setTo(50);
    for (int pixels : {99, 100}) {
        frame.color.row(0).colRange(0, pixels).setTo(cv::Scalar(.1, .2, .9, 1));
        frame.depth.row(0).colRange(0, pixels).setTo(INFINITY);
        const Airlight airlight = pickAirlight(frame);
        EXPECT_EQ(airlight.how, pixels < 100 ? "dark channel" : "median of the sky");
        const cv::Vec3d wanted = pixels < 100 ? cv::Vec3d(.4, .5, .6) : cv::Vec3d(.1, .2, .9);
        EXPECT_LT(cv::norm(airlight.color - wanted), 1e-6) << airlight.color;
    }
}

}  // namespace
}  // namespace brume
