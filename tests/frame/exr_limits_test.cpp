// EXR headers that ask for more than the file holds, or for what no picture needs.
#include "frame/exr_limits.hpp"

#include "frame/read.hpp"
#include "frame_fixture.hpp"

namespace brume {
namespace {

using test::sentenceOf;

std::string number(uint32_t n) {
    return {char(n & 255), char(n >> 8 & 255), char(n >> 16 & 255), char(n >> 24)};
}
std::string attribute(const std::string& name, const std::string& type, const std::string& value) {
    return name + '\0' + type + '\0' + number(uint32_t(value.size())) + value;
}
std::string channel(const std::string& name) {
    return name + '\0' + number(1) + number(0) + number(1) + number(1);
}
std::string box(int width, int height) {
    return number(0) + number(0) + number(width - 1) + number(height - 1);
}

const std::string start = "\x76\x2f\x31\x01" + number(2);

/// A whole header of scan lines, without pixels.
std::string headerWith(const std::string& channels, const std::string& more = "", int width = 8,
                       int height = 8) {
    return start + attribute("channels", "chlist", channels + '\0') +
           attribute("compression", "compression", "\3") +
           attribute("dataWindow", "box2i", box(width, height)) +
           attribute("displayWindow", "box2i", box(width, height)) +
           attribute("lineOrder", "lineOrder", std::string(1, '\0')) +
           attribute("pixelAspectRatio", "float", number(0x3f800000)) +
           attribute("screenWindowCenter", "v2f", std::string(8, '\0')) +
           attribute("screenWindowWidth", "float", number(0x3f800000)) + more + '\0';
}

class ExrLimits : public test::FrameTest {
  protected:
    std::string refusal(const std::string& bytes) {
        writeText("a.exr", bytes);
        const std::string sentence = sentenceOf(ErrorKind::Io, [&] { readImage(file("a.exr"), 1 << 20); });
        return sentence.substr(std::min(sentence.size(), file("a.exr: ").size()));
    }
};

TEST_F(ExrLimits, AttributesAreNoLongerThanTheFile) {
    EXPECT_EQ(refusal(start + "brume" + '\0' + "blob" + '\0' + number(1769108595) + "x"),
              "its attribute brume claims 1769108595 bytes, more than the file holds");
    EXPECT_EQ(refusal(headerWith(channel("Y"), attribute("big", "blob", std::string((16 << 20) + 1, 'x')))),
              "its attribute big claims 16777217 bytes, more than the limit of 16 MiB");
}

TEST_F(ExrLimits, AttributesAreOfTheSizeTheyState) {
    // OpenEXR reads a list of channels to its end, whatever its size: what follows hid an attribute from us.
    EXPECT_EQ(
        refusal(start + attribute("channels", "chlist",
                                  channel("Y") + '\0' + "a" + '\0' + "blob" + '\0' + number(1u << 31) + "x")),
        "is a damaged EXR: its attribute channels is not of the size it states");
    EXPECT_EQ(refusal(headerWith(channel("Y"), attribute("ratio", "float", "123"))),
              "is a damaged EXR: its attribute ratio is not of the size it states");
    EXPECT_EQ(
        refusal(headerWith(channel("Y"), attribute("preview", "preview", number(30000) + number(30000)))),
        "is a damaged EXR: its preview is not of the size it states");
    // As many pixels as would make 64 bits overflow.
    EXPECT_EQ(refusal(headerWith(channel("Y"),
                                 attribute("preview", "preview", number(0xbbbbbbbb) + number(0xbbbbbbbb)))),
              "is a damaged EXR: its preview is not of the size it states");
}

TEST_F(ExrLimits, AttributesAreThereOnce) {
    // Of two sizes OpenEXR's C core takes one, which was held to the limits, and its C++ reader the other.
    EXPECT_EQ(refusal(headerWith(channel("Y"), attribute("displayWindow", "box2i", box(14090246, 5)))),
              "is a damaged EXR: its attribute displayWindow is there twice");
}

TEST_F(ExrLimits, ChannelsPartsAndBlocksAreFew) {
    std::string many;
    for (int k = 0; k < 1025; ++k) many += channel("c" + std::to_string(1000 + k));
    EXPECT_EQ(refusal(headerWith(many)), "has more than 1024 channels");
    std::string parts = "\x76\x2f\x31\x01" + number(0x1002);
    for (int k = 0; k < 300; ++k) parts += attribute("name", "string", "a") + '\0';
    EXPECT_EQ(refusal(parts + '\0'), "has more than 256 parts");
    std::string some;
    for (int k = 0; k < 100; ++k) some += channel("c" + std::to_string(100 + k));
    EXPECT_EQ(
        refusal(headerWith(some, "", 1 << 20, 1)),
        "its blocks of 1048576 × 1 pixels in 100 channels take 200 MiB each, more than the limit of 33");
}

TEST_F(ExrLimits, BlocksOfMoreBytesThanSixtyFourBitsCountAreRefused) {
    std::string tiled = headerWith(channel("A") + channel("B") + channel("G") + channel("R"),
                                   attribute("tiles", "tiledesc", number(1 << 30) + number(1 << 30) + '\0'));
    tiled[5] = 2;  // the version's flag of tiles
    for (const char* kind : {"A", "B", "G", "R"})
        tiled[tiled.find(std::string(kind) + '\0') + 2] = 2;  // float: 16 bytes a pixel, 2^64 a tile
    EXPECT_NE(refusal(tiled), "");
    EXPECT_EQ(refusal(tiled).find("blocks of pixels are not where"), std::string::npos) << refusal(tiled);
}

TEST_F(ExrLimits, SoundHeadersPass) {
    writeText("a.exr", headerWith(channel("Y"), attribute("note", "string", "as long as it likes")));
    EXPECT_NO_THROW(requireModestHeaders(file("a.exr"), 1 << 20));
    EXPECT_NE(refusal(headerWith(channel("Y"))).find("blocks of pixels"), std::string::npos);  // it has none
}

}  // namespace
}  // namespace brume
