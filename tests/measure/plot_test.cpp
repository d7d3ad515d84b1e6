#include "measure/plot.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <sstream>

namespace brume {
namespace {

std::string bytesOf(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

class Plot : public testing::Test {
  protected:
    void SetUp() override {
        folder_ = (std::filesystem::temp_directory_path() / ("brume-plot-test-" + std::to_string(::getpid())))
                      .string();
        std::filesystem::create_directories(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }
    std::string folder_;
};

TEST(Frontier, KeepsWhatNothingBeatsInBoth) {
    using Places = std::vector<size_t>;
    EXPECT_EQ(paretoFrontier({{1, 9}, {2, 3}, {2.5, 4}, {3, 1}, {4, 1}}), (Places{0, 1, 3}));
    EXPECT_EQ(paretoFrontier({{5, 1}, {1, 5}, {3, 3}}), (Places{1, 2, 0}));
    EXPECT_EQ(paretoFrontier({{1, 1}, {1, 1}, {1, 2}}), (Places{0}));  // of equals the first
    EXPECT_EQ(paretoFrontier({{2, 2}, {1, 1}}), (Places{1}));
    EXPECT_EQ(paretoFrontier({{NAN, 0}, {1, HUGE_VAL}, {2, 7}}), (Places{2}));
    EXPECT_TRUE(paretoFrontier({}).empty());
}

TEST_F(Plot, WritesBothFormsOfAPage) {
    PlotPage page;
    page.title = "A \"title\" with \\ and an é";
    page.note = "note";
    for (int k = 0; k < 3; k++) {
        PlotPanel panel;
        panel.title = "panel " + std::to_string(k);
        panel.xLabel = "ms", panel.yLabel = "steps";
        panel.series = {{"frontier", PlotSeries::Kind::Frontier, {{1, 2}, {4, .5}}},
                        {"alpha", PlotSeries::Kind::Line, {{1, 2, .9, 1.2, "8"}, {4, .5}, {NAN, 3}, {5, 0}}},
                        {"peer", PlotSeries::Kind::Points, {{3, 3}}}};
        panel.marks = {{true, 2, "copy"}, {false, .5, "half"}};
        page.panels.push_back(panel);
    }
    page.panels.push_back({});  // nothing to draw is no error
    writePlots(page, folder_ + "/it's a page");
    std::string svg = bytesOf(folder_ + "/it's a page.svg");
    EXPECT_EQ(svg.substr(0, 5), "<?xml");
    EXPECT_NE(svg.find("</svg>"), std::string::npos);
    for (const char* word : {"alpha", "frontier", "peer", "panel 2", "half", "copy"})
        EXPECT_NE(svg.find(word), std::string::npos) << word;
    EXPECT_EQ(bytesOf(folder_ + "/it's a page.png").substr(1, 3), "PNG");
}

TEST_F(Plot, WritesAMap) {
    cv::Mat values(9, 16, CV_64F);
    for (int k = 0; k < 144; k++) values.at<double>(k / 16, k % 16) = k == 5 ? NAN : std::pow(1.1, k) * 1e-3;
    writeMap(values, 1e-2, 1e2, "title", "8-bit steps", folder_ + "/map.png");
    EXPECT_EQ(bytesOf(folder_ + "/map.png").substr(1, 3), "PNG");
}

TEST_F(Plot, SaysWhatItCannotWrite) {
    try {
        writePlots({}, folder_ + "/missing/page");
        FAIL();
    } catch (const std::exception& e) {
        EXPECT_NE(std::string(e.what()).find("missing/page.svg"), std::string::npos) << e.what();
    }
}

}  // namespace
}  // namespace brume
