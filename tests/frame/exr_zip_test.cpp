// Our ZIP blocks against OpenEXR's own, both ways.
#include "frame/exr_zip.hpp"

#include <ImfInputFile.h>
#include <gmock/gmock.h>
#include <half.h>

#include <algorithm>
#include <fstream>

#include "exr_fixture.hpp"
#include "frame/exr_file.hpp"
#include "frame/image_writers.hpp"
#include "frame_fixture.hpp"

namespace brume {
namespace {

using test::bitsThatDiffer;
using test::randomColor;
using test::sentenceOf;

class ExrZip : public test::FrameTest {
  protected:
    static cv::Mat channel(const std::string& path, const std::string& name) {
        ExrFile in(path, 1 << 24);
        cv::Mat image(in.size(), CV_32F, cv::Scalar(-1));
        for (size_t k = 0; k < in.channels().size(); ++k)
            if (in.channels()[k].name == name) in.read({{int(k), &image, 0}});
        return image;
    }
};

/// Smooth and rough together, so that some blocks shrink and some do not.
cv::Mat plane(cv::Size size, int seed) {
    cv::Mat noise = randomColor(size, -9, 9, seed), one;
    cv::extractChannel(noise, one, 0);
    one.rowRange(0, size.height / 2).setTo(.25f * float(seed));
    return one;
}

TEST_F(ExrZip, ReadsWhatOpenExrPacked) {
    for (const Imf::Compression compression : {Imf::ZIP_COMPRESSION, Imf::ZIPS_COMPRESSION})
        for (const cv::Size size :
             {cv::Size(1, 1), cv::Size(7, 5), cv::Size(33, 16), cv::Size(64, 17), cv::Size(301, 70)}) {
            SCOPED_TRACE(testing::Message() << compression << " " << size);
            const cv::Mat depth = plane(size, 1), red = plane(size, 2);
            cv::Mat rounded(size, CV_32F), count(size, CV_32S), halves(size, CV_16S);
            for (int j = 0; j < size.height; ++j)
                for (int i = 0; i < size.width; ++i) {
                    const half h(red.at<float>(j, i));
                    rounded.at<float>(j, i) = h;
                    halves.at<uint16_t>(j, i) = h.bits();
                    count.at<int>(j, i) = i * 70001 + j;
                }
            Imf::Header header(size.width, size.height);
            header.compression() = compression;
            Imf::FrameBuffer buffer;
            const auto add = [&](const char* name, Imf::PixelType type, const cv::Mat& pixels) {
                header.channels().insert(name, Imf::Channel(type));
                buffer.insert(name, Imf::Slice(type, reinterpret_cast<char*>(pixels.data), pixels.elemSize(),
                                               pixels.step));
            };
            add("R", Imf::HALF, halves);
            add("Z", Imf::FLOAT, depth);
            add("id", Imf::UINT, count);
            {
                Imf::OutputFile out(file("theirs.exr").c_str(), header);
                out.setFrameBuffer(buffer);
                out.writePixels(size.height);
            }
            EXPECT_EQ(bitsThatDiffer(channel(file("theirs.exr"), "R"), rounded), 0);
            EXPECT_EQ(bitsThatDiffer(channel(file("theirs.exr"), "Z"), depth), 0);
            cv::Mat asFloat;
            count.convertTo(asFloat, CV_32F);
            EXPECT_EQ(bitsThatDiffer(channel(file("theirs.exr"), "id"), asFloat), 0);
        }
}

TEST_F(ExrZip, OpenExrReadsWhatWePacked) {
    for (const cv::Size size : {cv::Size(1, 1), cv::Size(7, 5), cv::Size(64, 17), cv::Size(301, 70)}) {
        SCOPED_TRACE(size);
        ExrContent content;
        content.color = randomColor(size, 0, 90000, 3);  // beyond the half range here and there
        content.color.at<cv::Vec4f>(0, 0) = {INFINITY, -INFINITY, -1e6f, 1};
        content.alpha = false;
        content.depth = plane(size, 4);
        content.depth.at<float>(0, 0) = NAN;
        content.attributes["a name of more than thirty-one characters"] = "kept";
        writeExr(file("ours.exr"), content);

        Imf::InputFile in(file("ours.exr").c_str());
        EXPECT_EQ(in.header().compression(), Imf::ZIP_COMPRESSION);
        EXPECT_NE(
            in.header().findTypedAttribute<Imf::StringAttribute>("a name of more than thirty-one characters"),
            nullptr);
        EXPECT_TRUE(in.isComplete());
        cv::Mat red(size, CV_32F), green(size, CV_32F), blue(size, CV_32F), depth(size, CV_32F);
        Imf::FrameBuffer buffer;
        for (const auto& [name, image] :
             std::map<std::string, cv::Mat>{{"R", red}, {"G", green}, {"B", blue}, {"Z", depth}})
            buffer.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(image.data), 4, image.step));
        in.setFrameBuffer(buffer);
        in.readPixels(0, size.height - 1);
        EXPECT_EQ(bitsThatDiffer(depth, content.depth), 0);
        const cv::Mat planes[] = {red, green, blue};
        for (int j = 0; j < size.height; ++j)
            for (int i = 0; i < size.width; ++i)
                for (int k = 0; k < 3; ++k) {
                    const float v = content.color.at<cv::Vec4f>(j, i)[k];
                    const float kept = std::isinf(v) ? v : std::clamp(v, -65504.f, 65504.f);
                    ASSERT_EQ(planes[k].at<float>(j, i), float(half(kept))) << j << " " << i << " " << k;
                }
    }
}

TEST_F(ExrZip, DamagedBlocksAreRefused) {
    ExrContent content;
    content.grey = plane({200, 40}, 5);
    content.halfColor = false;
    writeExr(file("whole.exr"), content);
    std::ifstream in(file("whole.exr"), std::ios::binary);
    const std::string whole((std::istreambuf_iterator<char>(in)), {});
    int refused = 0;
    for (size_t at = whole.size() - 9000; at < whole.size(); at += 37) {
        std::string damaged = whole;
        damaged[at] = char(damaged[at] ^ 0x5a);
        std::ofstream(file("damaged.exr"), std::ios::binary) << damaged;
        try {  // a stored block has no checksum: its floats may change, and nothing else
            const cv::Mat back = channel(file("damaged.exr"), "Y");
            EXPECT_LE(cv::countNonZero(back != content.grey), 16 * 200);
        } catch (const Error& e) {
            ++refused;
            EXPECT_THAT(e.what(), testing::HasSubstr("damaged"));
        }
    }
    EXPECT_GT(refused, 0);
    std::ofstream(file("short.exr"), std::ios::binary) << whole.substr(0, whole.size() - 100);
    EXPECT_THAT(sentenceOf(ErrorKind::Io, [&] { channel(file("short.exr"), "Y"); }),
                testing::HasSubstr("damaged"));
}

}  // namespace
}  // namespace brume
