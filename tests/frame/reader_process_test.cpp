// Images decoded in a process apart: the same pixels, and what becomes of a process that dies.
#include <signal.h>

#include <future>
#include <nlohmann/json.hpp>
#include <thread>

#include "frame/decode.hpp"
#include "frame/read.hpp"
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
