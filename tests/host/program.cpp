#include "host/program.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "frame/write.hpp"

namespace brume::test {

namespace fs = std::filesystem;

std::string bytesOf(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    std::ostringstream bytes;
    bytes << in.rdbuf();
    return bytes.str();
}

Ran run(const std::string& folder, const std::string& command) {
    std::string line = command;
    for (size_t at = 0; (at = line.find("BRUME ", at)) != std::string::npos; at++)
        line.replace(at, 6, "'" BRUME_PROGRAM "' ");
    line = "cd '" + folder + "' && { " + line + " ; } >'" + folder + ".out' 2>'" + folder + ".err'";
    int status = std::system(line.c_str());
    Ran ran{WIFEXITED(status) ? WEXITSTATUS(status) : -1, bytesOf(folder + ".out"), bytesOf(folder + ".err")};
    fs::remove(folder + ".out");
    fs::remove(folder + ".err");
    return ran;
}

FramePair sampleFrame(cv::Size size, int variation) {
    FramePair frame;
    frame.camera = Camera::withHorizontalView(size, 75);
    frame.color.create(size, CV_32FC4);
    frame.depth.create(size, CV_32F);
    for (int j = 0; j < size.height; j++)
        for (int i = 0; i < size.width; i++) {
            float u = float(i) / float(size.width), v = float(j) / float(size.height);
            frame.color.at<cv::Vec4f>(j, i) = {u, v, .25f + .01f * float(variation), 1};
            double down = -frame.camera.ray(i, j)[1];
            frame.depth.at<float>(j, i) =
                down > .02 ? float(1.6 / down) : std::numeric_limits<float>::infinity();
        }
    return frame;
}

void Program::SetUp() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = testing::TempDir() + "brume-" + std::to_string(getpid()) + "-" + test->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
}

void Program::TearDown() { fs::remove_all(folder_); }

std::set<std::string> Program::files() const {
    std::set<std::string> names;
    std::error_code none;  // a link to itself is a file, too
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
        if (!entry.is_directory(none)) names.insert(entry.path().lexically_relative(folder_).string());
    return names;
}

void Program::expectError(const std::string& arguments, int status, const std::string& part) {
    SCOPED_TRACE("brume " + arguments);
    auto before = files();
    Ran ran = brume(arguments);
    EXPECT_EQ(ran.status, status) << ran.err;
    EXPECT_THAT(ran.err, testing::StartsWith("brume: "));
    EXPECT_THAT(ran.err, testing::HasSubstr(part));
    EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
    EXPECT_EQ(ran.out, "");
    EXPECT_EQ(files(), before);
}

void Program::addFrame(const std::string& name, cv::Size size, int variation) {
    fs::create_directories(fs::path(path(name)).parent_path());
    writeFrame(path(name), sampleFrame(size, variation));
}

void Program::addText(const std::string& name, const std::string& text) {
    fs::create_directories(fs::path(path(name)).parent_path());
    std::ofstream(path(name), std::ios::binary) << text;
}

}  // namespace brume::test
