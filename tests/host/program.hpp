// Runs the real program in a folder of its own, for the tests of the command line.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <set>
#include <string>

#include "frame/frame_pair.hpp"

namespace brume::test {

struct Ran {
    int status = -1;
    std::string out, err;
};

/// A shell command line; BRUME stands for the program.
Ran run(const std::string& folder, const std::string& command);

/// A small frame: a gradient, the ground below a sky.
FramePair sampleFrame(cv::Size size = {48, 32}, int variation = 0);

std::string bytesOf(const std::string& path);

/// A fresh folder for each test; `brume` runs there.
class Program : public testing::Test {
  protected:
    void SetUp() override;
    void TearDown() override;

    Ran brume(const std::string& arguments) { return run(folder_, "BRUME " + arguments); }
    /// That status, one sentence that begins with "brume: ", nothing on stdout, and no new file.
    void expectError(const std::string& arguments, int status, const std::string& part);
    std::set<std::string> files() const;
    std::string path(const std::string& name) const { return folder_ + "/" + name; }
    /// Colour and depth in one EXR.
    void addFrame(const std::string& name, cv::Size size = {48, 32}, int variation = 0);
    void addText(const std::string& name, const std::string& text);

    std::string folder_;
};

}  // namespace brume::test
