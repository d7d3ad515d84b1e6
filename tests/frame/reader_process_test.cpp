// Images decoded in a process apart: the same pixels, and what becomes of a process that dies.
#include <signal.h>
#include <sys/resource.h>

#include <future>
#include <nlohmann/json.hpp>
#include <thread>

#include "frame/decode.hpp"
#include "frame/read.hpp"
#include "frame/reader_line.hpp"
#include "frame/write.hpp"
#include "frame_fixture.hpp"

namespace brume {
namespace {

namespace fs = std::filesystem;
using test::sentenceOf;

constexpr size_t manyPixels = size_t(1) << 20;

/// This process's readers.
std::vector<pid_t> readers() {
    std::vector<pid_t> found;
    for (const auto& entry : fs::directory_iterator("/proc")) {
        std::ifstream in(entry.path() / "stat");
        std::string line;
        if (!std::getline(in, line) || line.find("(brume_reader)") == std::string::npos) continue;
        int parent = 0;
        char state = 0;
        std::istringstream(line.substr(line.rfind(')') + 1)) >> state >> parent;
        std::error_code none;
        const fs::directory_iterator tasks(entry.path() / "task", none);
        const bool hasThreads = !none && std::distance(tasks, fs::directory_iterator()) > 1;
        if (parent == getpid() && (state != 'Z' || hasThreads))
            found.push_back(std::stoi(entry.path().filename()));
    }
    return found;
}

int mappedBuffers() {
    std::ifstream in("/proc/self/maps");
    int count = 0;
    for (std::string line; std::getline(in, line);)
        count += line.find("memfd:brume-image") != std::string::npos;
    return count;
}

class ReaderProcess : public test::FrameTest {
  protected:
    /// No reader that another test has used.
    ReaderProcess() {
        for (const pid_t reader : readers()) kill(reader, SIGKILL);
        while (!readers().empty()) std::this_thread::yield();
    }
    std::string addImage(const std::string& name, cv::Size size, uint32_t seed) {
        writeImage(file(name), test::randomColor(size, 0, 1, seed));
        return file(name);
    }
};

TEST_F(ReaderProcess, GivesTheSamePixels) {
    for (const char* name : {"a.exr", "a.jpg", "a.tif"})
        for (const cv::Size size : {cv::Size(1, 1), cv::Size(7, 3), cv::Size(640, 480)}) {
            const std::string path = addImage(name, size, 1);
            const DecodeRequest request{Decode::Image, path, manyPixels};
            const Decoded apart = decode(request), here = decodeHere(request);
            ASSERT_EQ(apart.images.size(), 1u);
            EXPECT_EQ(apart.facts, here.facts);
            EXPECT_EQ(apart.images[0].size(), size);
            ASSERT_EQ(apart.images[0].type(), here.images[0].type());
            EXPECT_EQ(cv::norm(apart.images[0], here.images[0], cv::NORM_INF), 0) << name << size;
        }
}

TEST_F(ReaderProcess, MemoryGoesRoundAndNoImageChangesUnderItsOwner) {
    std::vector<std::string> paths;
    for (uint32_t k = 0; k < 3; ++k) paths.push_back(addImage(std::to_string(k) + ".exr", {320, 200}, k));
    const auto read = [&](int k) { return decode({Decode::Image, paths[k % 3], manyPixels}).images.at(0); };
    const cv::Mat kept = read(0), copy = kept.clone();
    for (int k = 0; k < 30; ++k) {
        const cv::Mat image = read(k);
        EXPECT_EQ(cv::norm(image, copy, cv::NORM_INF) == 0, k % 3 == 0);
    }
    EXPECT_EQ(cv::norm(kept, copy, cv::NORM_INF), 0);
    EXPECT_LE(mappedBuffers(), 4);
}

TEST_F(ReaderProcess, MemoryOfASizeNoLongerReadIsGivenUp) {
    const std::string large = addImage("large.exr", {500, 400}, 1),
                      small = addImage("small.exr", {300, 200}, 2);
    for (int k = 0; k < 3; ++k) decode({Decode::Image, large, manyPixels});
    for (int k = 0; k < 20; ++k) decode({Decode::Image, small, manyPixels});
    EXPECT_LE(mappedBuffers(), 2);
}

TEST_F(ReaderProcess, ImagesOutliveTheirProcess) {
    const std::string path = addImage("a.exr", {320, 200}, 1);
    const cv::Mat image = decode({Decode::Image, path, manyPixels}).images.at(0), copy = image.clone();
    for (const pid_t reader : readers()) kill(reader, SIGKILL);
    while (!readers().empty()) std::this_thread::yield();
    EXPECT_EQ(cv::norm(decode({Decode::Image, path, manyPixels}).images.at(0), copy, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(image, copy, cv::NORM_INF), 0);
}

TEST_F(ReaderProcess, OneThatDiesAtWorkIsASentenceAndTheNextFileIsRead) {
    const std::string path = addImage("a.exr", {320, 200}, 1);
    const DecodeRequest request{Decode::Image, path, manyPixels};
    decode(request);
    std::string sentence;
    // Stopped at rest, killed once it has been given work; on a busy machine that may take several tries.
    for (int delay = 20; sentence.empty() && delay < 20000; delay *= 2) {
        const pid_t reader = readers().at(0);
        kill(reader, SIGSTOP);
        auto answer = std::async(std::launch::async, [&] {
            try {
                decode(request);
            } catch (const Error& e) {
                EXPECT_EQ(int(e.kind()), int(ErrorKind::Io));
                return std::string(e.what());
            }
            return std::string();
        });
        answer.wait_for(std::chrono::milliseconds(delay));
        kill(reader, SIGKILL);
        sentence = answer.get();
    }
    EXPECT_EQ(
        sentence,
        path + ": is damaged: decoding it crashed (Killed), in a process apart, so nothing else is lost");
    EXPECT_EQ(decode(request).images.at(0).size(), cv::Size(320, 200));
}

/// A progressive JPEG of 4096 × 4096 grey pixels in so many passes over all of them, 40 bytes each.
std::string jpegOfPasses(int count) {
    using namespace std::string_literals;
    const auto codeOf = [](char table, char symbol) {  // a table of one code, the bit 0
        return "\xff\xc4\0\x14"s + table + '\1' + std::string(15, '\0') + symbol;
    };
    std::string bytes = "\xff\xd8\xff\xdb\0\x43\0"s + std::string(64, '\1') +
                        "\xff\xc2\0\x0b\x08\x10\0\x10\0\1\1\x11\0"s + codeOf('\0', '\0') +
                        codeOf('\x10', '\xe0') + "\xff\xda\0\x08\1\1\0\0\0\0"s +
                        std::string(4096 * 4096 / 64 / 8, '\0');
    for (int k = 0; k < count; ++k)  // "the next 16384 blocks hold nothing", 16 times
        bytes += "\xff\xda\0\x08\1\1\0\1\x3f\0"s + std::string(30, '\0');
    return bytes + "\xff\xd9"s;
}

/// A TIFF of 64 × 64 floats in one deflated tile of that size, whose bytes are none.
std::string tiffOfTiles(uint32_t size) {
    std::string entries;
    int count = 0;
    const auto add = [&](uint32_t tag, uint32_t value) {  // one number of 32 bits
        for (const uint32_t word : {tag | 4 << 16, 1u, value})
            for (int k = 0; k < 32; k += 8) entries += char(word >> k);
        ++count;
    };
    const std::pair<uint32_t, uint32_t> values[] = {{256, 64},   {257, 64}, {258, 32},  {259, 8},
                                                    {262, 1},    {277, 1},  {284, 1},   {322, size},
                                                    {323, size}, {324, 8},  {325, 100}, {339, 3}};
    for (const auto& [tag, value] : values) add(tag, value);
    return std::string("II*\0\x08\0\0\0", 8) + char(count) + '\0' + entries + std::string(4, '\0');
}

/// Processor time.
double secondsOfEndedChildren() {
    struct rusage used {};
    getrusage(RUSAGE_CHILDREN, &used);
    return double(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
           1e-6 * double(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

TEST_F(ReaderProcess, OneThatComputesTooLongIsASentence) {
    writeText("few.jpg", jpegOfPasses(1));
    writeText("many.jpg", jpegOfPasses(20000));  // 800 kB, minutes
    DecodeRequest request{Decode::Image, file("few.jpg"), size_t(1) << 24};
    EXPECT_EQ(decode(request).images.at(0).size(), cv::Size(4096, 4096));
    request.path = file("many.jpg");
    request.seconds = 1;
    const double before = secondsOfEndedChildren();
    EXPECT_EQ(sentenceOf(ErrorKind::Io, [&] { decode(request); }),
              request.path +
                  ": is damaged: decoding it took too long, in a process apart, so nothing else is lost");
    // Its processor time ended it, 2 s and a start after those it had used, not the clock, which waits
    // for 20.
    EXPECT_LT(secondsOfEndedChildren() - before, 5);
}

TEST_F(ReaderProcess, OneThatHangsIsASentence) {
    DecodeRequest request{Decode::Image, addImage("a.exr", {320, 200}, 1), manyPixels};
    decode(request);
    request.seconds = .05;  // by the clock 20 times that
    kill(readers().at(0), SIGSTOP);
    EXPECT_EQ(sentenceOf(ErrorKind::Io, [&] { decode(request); }),
              request.path +
                  ": is damaged: decoding it took too long, in a process apart, so nothing else is lost");
    EXPECT_TRUE(readers().empty());
    request.seconds.reset();
    EXPECT_EQ(decode(request).images.at(0).size(), cv::Size(320, 200));
}

TEST_F(ReaderProcess, OneThatWantsTooMuchMemoryIsASentence) {
    if (isSanitized) GTEST_SKIP() << "a sanitizer's own memory knows no limit";
    // 32 MiB of coefficients in libjpeg, a tile of 64 MiB in OpenImageIO.
    writeText("a.jpg", jpegOfPasses(1));
    writeText("a.tif", tiffOfTiles(4096) + std::string(1000, '\0'));
    const std::map<std::string, std::string> sentences = {
        {".jpg", ": cannot be read: JPEG error: Insufficient memory"},
        {".tif", ": needs more memory than the limit for its number of pixels"}};
    for (const auto& [ending, sentence] : sentences) {
        DecodeRequest request{Decode::Image, addImage("small" + ending, {40, 20}, 1), size_t(1) << 24};
        decode(request);  // what it once loads and starts is not the file's
        request.path = file("a" + ending);
        request.memory = 1 << 20;
        const std::string said = sentenceOf(ErrorKind::Io, [&] { decode(request); });
        EXPECT_EQ(said.substr(0, said.find(" (")), request.path + sentence);
    }
}

TEST_F(ReaderProcess, ATileIsNoLargerThanAnImageMayBe) {
    DecodeRequest request{Decode::Image, file("a.tif"), size_t(1) << 24};
    writeText("a.tif", tiffOfTiles(8192) + std::string(10000, '\0'));
    EXPECT_EQ(
        sentenceOf(ErrorKind::Io, [&] { decode(request); }),
        request.path + ": each of its tiles declares 8192 × 8192 pixels, more than the limit of 16777216");
    writeText("a.tif", tiffOfTiles(4096));
    EXPECT_EQ(
        sentenceOf(ErrorKind::Io, [&] { decode(request); }),
        request.path + ": each of its tiles declares 4096 × 4096 pixels but the file holds only 158 bytes");
}

TEST_F(ReaderProcess, ThreadsHaveOneEach) {
    std::vector<std::string> paths;
    for (uint32_t k = 0; k < 4; ++k) paths.push_back(addImage(std::to_string(k) + ".exr", {200, 150}, k));
    std::vector<std::future<void>> work;
    for (int k = 0; k < 4; ++k)
        work.push_back(std::async(std::launch::async, [&, k] {
            const DecodeRequest request{Decode::Image, paths[k], manyPixels};
            const cv::Mat truth = decodeHere(request).images.at(0);
            for (int n = 0; n < 10; ++n)
                EXPECT_EQ(cv::norm(decode(request).images.at(0), truth, cv::NORM_INF), 0);
        }));
    for (auto& w : work) w.get();
    EXPECT_LE(readers().size(), 4u);
}

}  // namespace
}  // namespace brume
