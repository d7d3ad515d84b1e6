// Every damaged or hostile file of the captures has its one outcome: a sentence, or a known image.
#include <sys/resource.h>

#include <map>
#include <optional>

#include "frame/read.hpp"
#include "frame/write.hpp"
#include "frame_fixture.hpp"

namespace brume {
namespace {

using test::sentenceOf;

struct Outcome {
    std::string sentence;  ///< what the refusal must say, after the file's name; empty: it is read
    cv::Size size = {};    ///< of what is read
    int channels = 0;
};

const std::map<std::string, Outcome>& outcomes() {
    static const std::map<std::string, Outcome> all = {
        {"LICENSE.pngsuite", {"not an image brume knows"}},
        {"exr_bomb.exr", {"declares 46340 × 46340 pixels, more than the limit"}},
        {"exr_comp_bad_bounds_piz.exr",
         {"its attribute channels claims 808464432 bytes, more than the file holds"}},
        {"exr_comp_early_eof_piz.exr", {"damaged EXR"}},
        {"exr_comp_invalid_unknown.exr", {"attribute displayWindow claims 32528 bytes"}},
        {"exr_heap_buffer_overflow.exr", {"blocks of pixels are not where its table says"}},
        {"exr_invalid_30bytes.exr", {"not an image brume knows"}},
        {"exr_invalid_integer_bounds.exr", {"unsupported version: 34"}},
        {"exr_memory_allocation_error_1.exr", {"blocks of pixels are not where its table says"}},
        {"exr_tiny_110bytes.exr", {"attribute dataWindow claims 12845072 bytes"}},
        {"exr_unfinished_multipart.exr", {"blocks of pixels are not where its table says"}},
        {"exr_zero-tilesize.exr", {"damaged EXR"}},
        {"jpg_corrupt-exif-1626.jpg", {"", {256, 256}, 3}},  // only its metadata is damaged
        {"odd_negative_data_window.exr", {"", {200, 150}, 3}},
        {"odd_rgbaz_small.exr", {"", {40, 40}, 4}},
        {"odd_tinydeep.exr", {"", {4, 4}, 1}},
        {"ok_oiio_test-1.pfm", {"", {64, 64}, 3}},
        {"ok_png_gray16.png", {"", {32, 32}, 1}},
        {"ok_png_gray16_interlaced.png", {"", {32, 32}, 1}},
        {"png_badcrc.png", {"CRC error"}},
        {"png_bomb.png", {"declares 46340 × 46340 pixels, more than the limit"}},
        {"png_suite_xc1n0g08.png", {"Invalid IHDR data"}},
        {"png_suite_xcsn0g01.png", {"CRC error"}},
        {"png_suite_xs1n0g01.png", {"not an image brume knows"}},
        {"pnm_bad-4552.pgm", {"not an image brume knows"}},
    };
    return all;
}

TEST(Malformed, EachFileHasItsOutcome) {
    const std::filesystem::path captures = BRUME_CAPTURES;
    if (captures.empty()) GTEST_SKIP() << "BRUME_CAPTURES is not set";
    int seen = 0;
    for (const auto& entry : std::filesystem::directory_iterator(captures / "malformed")) {
        const std::string path = entry.path().string(), name = entry.path().filename().string();
        const auto found = outcomes().find(name);
        ASSERT_NE(found, outcomes().end()) << name << " has no expected outcome";
        const Outcome& wanted = found->second;
        ++seen;
        if (wanted.sentence.empty()) {
            const cv::Mat image = readImage(path);
            EXPECT_EQ(image.size(), wanted.size) << name;
            EXPECT_EQ(image.channels(), wanted.channels) << name;
        } else {
            const std::string sentence = sentenceOf(ErrorKind::Io, [&] { readImage(path); });
            EXPECT_EQ(sentence.rfind(path + ": ", 0), 0u) << sentence;
            EXPECT_NE(sentence.find(wanted.sentence), std::string::npos) << sentence;
            EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
        }
        // No one of them is a frame, as none but odd_rgbaz_small has colour and depth.
        if (name != "odd_rgbaz_small.exr") sentenceOf(ErrorKind::Io, [&] { readFrame(path); });
    }
    EXPECT_EQ(seen, int(outcomes().size()));
    EXPECT_EQ(readFrame((captures / "malformed/odd_rgbaz_small.exr").string()).size(), cv::Size(40, 40));
}

class Hostile : public test::FrameTest {
  protected:
    /// Peak memory of this process, MiB.
    static long peak() {
        struct rusage usage {};
        getrusage(RUSAGE_SELF, &usage);
        return usage.ru_maxrss / 1024;
    }
};

TEST_F(Hostile, LimitsHoldBeforeMemoryIsTaken) {
    // Headers that ask for up to 60 GB of pixels the files do not hold.
    writeText("bomb.npy", std::string("\x93NUMPY\x01\x00", 8) + std::string("\x76\x00", 2) +
                              "{'descr': '<f8', 'fortran_order': False, 'shape': (16000, 16000), }" +
                              std::string(50, ' ') + "\n");
    writeText("bomb.pfm", "PF\n16000 16000\n-1\n");
    writeText("bomb.dpt",
              std::string("PIEH") + std::string("\x80\x3e\0\0", 4) + std::string("\x80\x3e\0\0", 4));
    writeText("huge.pfm", "PF\n2000000000 2000000000\n-1\n");
    writeText("huge.dpt",
              std::string("PIEH") + std::string("\xff\xff\xff\x7f", 4) + std::string("\xff\xff\xff\x7f", 4));
    writeText("negative.dpt",
              std::string("PIEH") + std::string("\xff\xff\xff\xff", 4) + std::string("\x10\0\0\0", 4));
    // A row of them alone would take 6 GB; the other's 800 MB.
    const auto writePng = [&](const char* name, const char* size, const char* checksum) {
        const std::string part = std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16);
        writeText(name, part + std::string(size, 8) + std::string("\x08\x02\0\0\0", 5) +
                            std::string(checksum, 4) +
                            std::string("\000\000\000\013\111\104\101\124\170\234\143\140\200\001\000\000\012"
                                        "\000\001\177\200\164\136",
                                        23));
    };
    writePng("huge.png", "\177\377\377\377\177\377\377\377", "\233\253\234\061");
    writePng("wide.png", "\020\000\000\000\000\000\000\001", "\313\262\236\072");
    const long before = peak();
    for (const char* name :
         {"bomb.npy", "bomb.pfm", "bomb.dpt", "huge.pfm", "huge.dpt", "negative.dpt", "huge.png", "wide.png"})
        EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { readImage(file(name)); }).find(name), std::string::npos);
    EXPECT_LT(peak() - before, 32) << "MiB";
}

/// One small sound file of each format, some of the captures and some made here.
std::vector<std::string> oneOfEach(const std::filesystem::path& captures,
                                   const std::filesystem::path& folder) {
    std::vector<std::string> all;
    for (const char* name : {"odd_rgbaz_small.exr", "ok_png_gray16_interlaced.png", "ok_oiio_test-1.pfm",
                             "jpg_corrupt-exif-1626.jpg", "odd_tinydeep.exr"})
        all.push_back((captures / "malformed" / name).string());
    for (const char* name : {"a.tif", "a.jpg", "a.png", "a.npy", "a.exr"}) {
        all.push_back((folder / name).string());
        writeImage(all.back(), test::randomColor({24, 18}, 0, 1, 1));
    }
    const auto add = [&](const char* name, const std::string& bytes) {
        all.push_back((folder / name).string());
        std::ofstream(all.back(), std::ios::binary) << bytes;
    };
    std::string pixels(24 * 18 * 4, '\0');
    for (size_t k = 0; k < pixels.size(); ++k) pixels[k] = char(k % 4 == 3 ? 128 : k * 37 % 251);
    add("a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 18 +X 24\n" + pixels);
    add("a.dpt", std::string("PIEH\x18\0\0\0\x12\0\0\0", 12) + pixels);
    return all;
}

TEST_F(Hostile, AnyCutOfAFileIsRefusedOrWhole) {
    // The first n bytes of each format, for many n: a sentence, never a crash, never a frame made up.
    const std::filesystem::path captures = BRUME_CAPTURES;
    if (captures.empty()) GTEST_SKIP() << "BRUME_CAPTURES is not set";
    for (const std::string& path : oneOfEach(captures, folder)) {
        std::ifstream in(path, std::ios::binary);
        const std::string whole((std::istreambuf_iterator<char>(in)), {});
        const cv::Mat image = readImage(path);
        const std::string ending = std::filesystem::path(path).extension().string();
        const size_t stride = std::max<size_t>(1, whole.size() / 100);
        for (size_t n = 0; n + 1 < whole.size(); n += stride) {
            writeText("cut" + ending, whole.substr(0, n));
            try {
                const cv::Mat cut = readImage(file("cut" + ending));
                // What is cut off may be no pixels: then all of them must be there.
                EXPECT_EQ(test::bitsThatDiffer(cut, image), 0) << path << " cut to " << n;
            } catch (const Error& e) {
                EXPECT_EQ(int(e.kind()), int(ErrorKind::Io)) << path << " cut to " << n;
            }
        }
    }
}

TEST_F(Hostile, AnyByteChangedNeverCrashes) {
    const std::filesystem::path captures = BRUME_CAPTURES;
    if (captures.empty()) GTEST_SKIP() << "BRUME_CAPTURES is not set";
    std::mt19937 generator(1);
    for (const std::string& path : oneOfEach(captures, folder)) {
        std::ifstream in(path, std::ios::binary);
        const std::string whole((std::istreambuf_iterator<char>(in)), {});
        const std::string changed = "changed" + std::filesystem::path(path).extension().string();
        for (int trial = 0; trial < 80; ++trial) {
            std::string bytes = whole;
            // Headers are where the danger is.
            const size_t reach = trial % 2 ? std::min<size_t>(bytes.size(), 400) : bytes.size();
            bytes[generator() % reach] = char(generator());
            writeText(changed, bytes);
            try {
                readImage(file(changed), size_t(1) << 24);
            } catch (const Error& e) {
                EXPECT_EQ(int(e.kind()), int(ErrorKind::Io)) << e.what();
            }
        }
    }
}

TEST_F(Hostile, MissingEmptyFolderForbidden) {
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { readFrame(file("none.png")); }).find("no such file"),
              std::string::npos);
    writeText("empty.png", "");
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { readFrame(file("empty.png")); }).find("empty"),
              std::string::npos);
    EXPECT_NE(sentenceOf(ErrorKind::Io, [&] { readFrame(folder.string()); }).find("folder"),
              std::string::npos);
}

}  // namespace
}  // namespace brume
