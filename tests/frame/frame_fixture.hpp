// What the frame tests share: a folder of their own, small images, hand-made EXR files.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <random>
#include <string>

#include "error.hpp"
#include "frame/frame_pair.hpp"

namespace brume::test {

/// A folder that is gone with the test.
class FrameTest : public testing::Test {
  protected:
    FrameTest() {
        const auto* info = testing::UnitTest::GetInstance()->current_test_info();
        std::string name = std::string(info->test_suite_name()) + "-" + info->name();
        for (char& c : name)
            if (c == '/') c = '_';
        folder = std::filesystem::temp_directory_path() / ("brume-" + std::to_string(getpid()) + "-" + name);
        std::filesystem::create_directories(folder);
    }
    ~FrameTest() override { std::filesystem::remove_all(folder); }

    std::string file(const std::string& name) const { return (folder / name).string(); }
    void writeText(const std::string& name, const std::string& content) const {
        std::filesystem::create_directories((folder / name).parent_path());
        std::ofstream(folder / name, std::ios::binary) << content;
    }
    /// Everything in the folder, hidden files too.
    int fileCount() const {
        return int(std::distance(std::filesystem::directory_iterator(folder),
                                 std::filesystem::directory_iterator()));
    }

    std::filesystem::path folder;
};

/// Uniform in [from, to), alpha 1.
inline cv::Mat randomColor(cv::Size size, float from, float to, uint32_t seed) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<float> value(from, to);
    cv::Mat image(size, CV_32FC4);
    for (int j = 0; j < size.height; ++j)
        for (int i = 0; i < size.width; ++i)
            image.at<cv::Vec4f>(j, i) = {value(generator), value(generator), value(generator), 1};
    return image;
}

/// The number of values whose bits differ.
inline int bitsThatDiffer(const cv::Mat& a, const cv::Mat& b) {
    if (a.type() != b.type() || a.size() != b.size()) return -1;
    int count = 0;
    for (int j = 0; j < a.rows; ++j) {
        const uint32_t *x = a.ptr<uint32_t>(j), *y = b.ptr<uint32_t>(j);
        for (int k = 0; k < a.cols * a.channels(); ++k) count += x[k] != y[k];
    }
    return count;
}

/// The sentence of the Error that `action` throws, which must be of `kind`.
template <class Action>
std::string sentenceOf(ErrorKind kind, Action action) {
    try {
        action();
    } catch (const Error& e) {
        EXPECT_EQ(int(e.kind()), int(kind)) << e.what();
        return e.what();
    }
    ADD_FAILURE() << "no Error was thrown";
    return "";
}

}  // namespace brume::test
