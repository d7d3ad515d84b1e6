#include "frame/write.hpp"

#include <ImfDoubleAttribute.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <OpenImageIO/imageio.h>
#include <sys/resource.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "frame/color_encoding.hpp"
#include "frame/read.hpp"
#include "frame_fixture.hpp"

namespace brume {
namespace {

using test::bitsThatDiffer;
using test::randomColor;
using test::sentenceOf;

class Writing : public test::FrameTest {};

/// What another library sees, as stored.
cv::Mat openImageIoReads(const std::string& path) {
    const auto in = OIIO::ImageInput::open(path);
    if (!in) throw std::runtime_error(OIIO::geterror());
    cv::Mat pixels(in->spec().height, in->spec().width, CV_32FC(in->spec().nchannels));
    in->read_image(0, 0, 0, -1, OIIO::TypeFloat, pixels.data);
    return pixels;
}

TEST_F(Writing, ExrHoldsHalvesPremultiplied) {
    cv::Mat image = randomColor({33, 17}, 0, 4, 1);
    for (int j = 0; j < image.rows; ++j)
        for (int i = 0; i < image.cols; ++i) image.at<cv::Vec4f>(j, i)[3] = float(i % 5) / 4;
    writeImage(file("a.exr"), image);
    const cv::Mat stored = openImageIoReads(file("a.exr")), back = readColor(file("a.exr"));
    for (int j = 0; j < image.rows; ++j)
        for (int i = 0; i < image.cols; ++i) {
            const cv::Vec4f c = image.at<cv::Vec4f>(j, i), s = stored.at<cv::Vec4f>(j, i),
                            b = back.at<cv::Vec4f>(j, i);
            const float factor = c[3] > 0 ? c[3] : 1;
            for (int k = 0; k < 3; ++k) {
                EXPECT_NEAR(s[k], c[k] * factor, c[k] * factor * 0x1p-11f + 1e-7f);
                EXPECT_NEAR(b[k], c[k], c[k] * 0x1p-10f + 1e-6f);
            }
            EXPECT_EQ(b[3], c[3]);
        }
}

TEST_F(Writing, FloatFormatsKeepEveryBit) {
    cv::Mat image = randomColor({20, 11}, -3, 70000, 2);
    image.at<cv::Vec4f>(1, 1) = {INFINITY, -INFINITY, 1e-40f, 1};
    WriteOptions data;
    data.isData = true;
    for (const char* name : {"a.exr", "a.tif", "a.npy"}) {
        writeImage(file(name), image, data);
        EXPECT_EQ(bitsThatDiffer(readColor(file(name)), image), 0) << name;
    }
    cv::Mat depth(9, 14, CV_32F, cv::Scalar(3.1f));
    depth.at<float>(2, 2) = INFINITY;
    for (const char* name : {"d.exr", "d.tif", "d.npy"}) {
        writeImage(file(name), depth, data);
        EXPECT_EQ(bitsThatDiffer(readImage(file(name)), depth), 0) << name;
    }
}

TEST_F(Writing, HalvesStayFiniteAndInfinitiesStayInfinite) {
    cv::Mat image(1, 2, CV_32FC4, cv::Scalar(1e6, -1e6, INFINITY, 1));
    writeImage(file("a.exr"), image);
    EXPECT_EQ(readColor(file("a.exr")).at<cv::Vec4f>(0, 0), cv::Vec4f(65504, -65504, INFINITY, 1));
}

TEST_F(Writing, PngIsWhatAnotherLibraryReads) {
    // Sizes around the bands that are compressed apart, with and without alpha.
    for (const cv::Size size :
         {cv::Size(1, 1), cv::Size(7, 3), cv::Size(640, 480), cv::Size(1, 900), cv::Size(3000, 200)})
        for (const bool alpha : {false, true}) {
            cv::Mat image = randomColor(size, -.1f, 1.1f, 3);
            if (alpha) image.at<cv::Vec4f>(0, 0)[3] = .25f;
            WriteOptions options;
            options.frameIndex = 4;
            options.attributes = {{"Title", "fog, thick – 100 m"}};
            writeImage(file("a.png"), image, options);
            const auto in = OIIO::ImageInput::open(file("a.png"));
            ASSERT_TRUE(in) << OIIO::geterror();
            const cv::Mat wanted = toSrgb8(image, alpha, 4, 0);
            ASSERT_EQ(in->spec().nchannels, alpha ? 4 : 3);
            EXPECT_EQ(
                in->spec().get_string_attribute("DocumentName", in->spec().get_string_attribute("Title")),
                "fog, thick – 100 m");
            OIIO::ImageSpec asStored;
            asStored["oiio:UnassociatedAlpha"] = 1;
            const auto raw = OIIO::ImageInput::open(file("a.png"), &asStored);
            cv::Mat stored(size, CV_8UC(alpha ? 4 : 3));
            ASSERT_TRUE(raw->read_image(0, 0, 0, -1, OIIO::TypeUInt8, stored.data)) << raw->geterror();
            EXPECT_EQ(cv::norm(stored, wanted, cv::NORM_INF), 0) << size;
        }
}

TEST_F(Writing, JpegIsCloseAndHasNoAlpha) {
    cv::Mat image(64, 64, CV_32FC4);
    for (int j = 0; j < 64; ++j)
        for (int i = 0; i < 64; ++i)
            image.at<cv::Vec4f>(j, i) = {float(srgbDecode(i / 63.)), float(srgbDecode(j / 63.)), .2f, .5f};
    writeImage(file("a.jpg"), image);
    const cv::Mat stored = openImageIoReads(file("a.jpg"));
    ASSERT_EQ(stored.channels(), 3);
    double worst = 0;
    for (int j = 0; j < 64; ++j)
        for (int i = 0; i < 64; ++i)
            worst = std::max(worst, std::abs(stored.at<cv::Vec3f>(j, i)[0] - i / 63.));
    EXPECT_LT(worst, 8 / 255.);
}

TEST_F(Writing, TheOneFileFormComesBackWhole) {
    FramePair frame;
    frame.color = randomColor({25, 14}, 0, 1, 7);
    frame.depth = cv::Mat(14, 25, CV_32F, cv::Scalar(7.7f));
    frame.depth.at<float>(0, 0) = INFINITY;
    frame.depth.at<float>(0, 1) = NAN;
    frame.camera = Camera::withHorizontalView({25, 14}, 73);
    frame.camera.cx += .123;
    frame.camera.worldFromCamera = Camera::standing(1.42, -7);
    frame.time = 1 / 3.;
    WriteOptions options;
    options.halfColor = false;
    writeFrame(file("a.exr"), frame, options);
    const FramePair back = readFrame(file("a.exr"));
    EXPECT_EQ(bitsThatDiffer(back.color, frame.color), 0);
    EXPECT_EQ(bitsThatDiffer(back.depth, frame.depth), 0);
    EXPECT_EQ(back.camera.fx, frame.camera.fx);
    EXPECT_EQ(back.camera.cx, frame.camera.cx);
    EXPECT_EQ(back.camera.worldFromCamera, frame.camera.worldFromCamera);
    EXPECT_EQ(back.time, frame.time);
}

TEST_F(Writing, NothingIsLeftOfAFailedFile) {
    const cv::Mat image = randomColor({300, 200}, 0, 1, 1);
    for (const char* name : {"a.exr", "a.png", "a.jpg", "a.tif", "a.npy"}) {
        const std::string missing = file(std::string("no/such/") + name);
        EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { writeImage(missing, image); }).find(missing),
                  std::string::npos);
        std::filesystem::create_directory(file(name));
        EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { writeImage(file(name), image); }).find(file(name)),
                  std::string::npos);
        std::filesystem::remove(file(name));
    }
    EXPECT_EQ(fileCount(), 0);
    for (const char* name : {"a.bmp", "a", "a.png.bak"})
        EXPECT_NE(sentenceOf(ErrorKind::Usage, [&] { writeImage(file(name), image); }).find(".exr"),
                  std::string::npos);
}

TEST_F(Writing, AFullDiskLeavesTheOldFileAlone) {
    // A limit on file sizes stands for a full disk: writing fails midway.
    const cv::Mat small = randomColor({4, 4}, 0, 1, 1), large = randomColor({400, 300}, 0, 1, 1);
    struct rlimit before {};
    getrlimit(RLIMIT_FSIZE, &before);
    const auto signalBefore = std::signal(SIGXFSZ, SIG_IGN);
    for (const char* name : {"a.exr", "a.png", "a.tif", "a.npy", "a.jpg"}) {
        writeImage(file(name), small);
        const auto sizeBefore = std::filesystem::file_size(file(name));
        struct rlimit tight = before;
        tight.rlim_cur = 4096;
        setrlimit(RLIMIT_FSIZE, &tight);
        const std::string sentence = sentenceOf(ErrorKind::Io, [&] { writeImage(file(name), large); });
        setrlimit(RLIMIT_FSIZE, &before);
        EXPECT_NE(sentence.find(file(name)), std::string::npos) << sentence;
        EXPECT_EQ(std::filesystem::file_size(file(name)), sizeBefore) << name;
    }
    std::signal(SIGXFSZ, signalBefore);
    EXPECT_EQ(fileCount(), 5) << "no temporary files";
}

// As FRAMES.md names them, for programs that are not brume.
TEST_F(Writing, AnExrStatesItsCameraUnderItsNames) {
    FramePair frame;
    frame.color = cv::Mat(4, 6, CV_32FC4, cv::Scalar(.5, .5, .5, 1));
    frame.depth = cv::Mat(4, 6, CV_32F, cv::Scalar(3));
    frame.camera = {.fx = 7, .fy = 8, .cx = 2.5, .cy = 1.25};
    frame.time = 1.5;
    writeFrame(file("stated.exr"), frame);
    const Imf::InputFile in(file("stated.exr").c_str());
    for (const auto& [name, value] : {std::pair{"brumeFx", 7.},
                                      {"brumeFy", 8.},
                                      {"brumeCx", 2.5},
                                      {"brumeCy", 1.25},
                                      {"brumeTime", 1.5}}) {
        const auto* stated = in.header().findTypedAttribute<Imf::DoubleAttribute>(name);
        ASSERT_NE(stated, nullptr) << name;
        EXPECT_EQ(stated->value(), value) << name;
    }
}

}  // namespace
}  // namespace brume
