#include "measure/plot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <sstream>

#include "measure/plot_script.hpp"
#include "measure/plot_words.hpp"

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
        panel.marks = {{true, 2, "copy", ""}, {false, .5, "half", ""}, {true, 3, "3.1", "alpha"}};
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

TEST(PlotScript, ManyNamesGetALegendForEachRow) {
    auto legends = [](int names) {
        PlotPage page;
        for (int k = 0; k < 6; k++) {
            page.panels.emplace_back();
            for (int n = 0; n < names; n++)
                page.panels[k].series.push_back(
                    {"name" + std::to_string(n) + "_" + std::to_string(k / 2), PlotSeries::Kind::Line, {}});
        }
        const std::string script = plotScript(page, "svg", "x.svg");
        int count = 0;
        for (size_t at = 0; (at = script.find("set key at", at)) != std::string::npos; at++) count++;
        return count;
    };
    EXPECT_EQ(legends(2), 1);
    EXPECT_EQ(legends(8), 3);
}

PlotPanel panelOf(const std::vector<PlotPoint>& points) {
    PlotPanel panel;
    panel.xRange = {1, 1000}, panel.yRange = {1e-3, 100};
    panel.series = {{"s", PlotSeries::Kind::Line, points}};
    return panel;
}

TEST(PlotWords, AMarksWordKeepsClearOfData) {
    auto halfStepOf = [](double y) {
        PlotPanel panel = panelOf({{2, 90}, {50, y}, {900, y}});
        panel.marks = {{false, .5, "half an 8-bit step", ""}};
        return placeWords(panel).at(0);
    };
    EXPECT_GT(halfStepOf(20).right, .9) << "at the end, where nothing is in the way";
    EXPECT_GT(halfStepOf(20).bottom, plotAxis(panelOf({}), false).share(.5)) << "above its line";
    const PlotWord away = halfStepOf(.7);
    EXPECT_TRUE(away.right < .5 || away.top < plotAxis(panelOf({}), false).share(.5));
}

TEST(PlotWords, PointsWordsDoNotTouch) {
    PlotPanel panel = panelOf(
        {{10, 1, 0, 0, "first"}, {10.5, 1, 0, 0, "second"}, {11, 1, 0, 0, "third"}, {990, 1, 0, 0, "last"}});
    for (int k = 0; k < 6; k++) panel.series[0].points.push_back({10. + k / 10., 1, 0, 0, "more"});
    panel.marks = {{true, 100, "0.1", "s"}, {true, 101, "0.11", "s"}, {false, .5, "half", ""}};
    const auto words = placeWords(panel);
    ASSERT_GE(words.size(), 6u);
    EXPECT_LT(words.size(), 13u) << "ten words do not find room at one place";
    for (size_t a = 0; a < words.size(); a++) {
        EXPECT_GE(words[a].left, 0) << words[a].word;
        EXPECT_LE(words[a].right, 1.03) << words[a].word;
        for (size_t b = 0; b < a; b++)
            EXPECT_TRUE(words[a].left >= words[b].right || words[a].right <= words[b].left ||
                        words[a].bottom >= words[b].top || words[a].top <= words[b].bottom)
                << words[a].word << " lies on " << words[b].word;
    }
}

std::string namesOf(const PlotTicks& ticks) {
    std::string names;
    for (const auto& [at, word] : ticks)
        if (!word.empty()) names += word + " ";
    return names;
}

TEST(PlotWords, EveryLogarithmicAxisHasTicksToReadBy) {
    EXPECT_EQ(namesOf(logTicks({.9, 1100, true})), "1 10 100 1000 ");
    EXPECT_EQ(namesOf(logTicks({.4, 6, true})), "0.5 1 2 5 ");
    EXPECT_EQ(namesOf(logTicks({1.5, 3.2, true})), "2 3 ");
    EXPECT_EQ(namesOf(logTicks({5e-7, 2e7, true})), "1e-6 0.0001 0.01 1 100 10000 1e6 ");
    EXPECT_EQ(namesOf(logTicks({1e-5, 1, true})), "1e-5 0.0001 0.001 0.01 0.1 1 ");
    for (double least = 1e-7; least < 1; least *= 1.7)
        for (double span : {3., 10., 1e3, 1e9}) {
            const std::string names = namesOf(logTicks({least, least * span, true}));
            EXPECT_GE(std::count(names.begin(), names.end(), ' '), 2) << least << " " << span;
            EXPECT_LE(std::count(names.begin(), names.end(), ' '), 8) << least << " " << span;
        }
}

TEST(PlotWords, TicksThatWouldTouchLoseTheirWords) {
    PlotTicks ticks;
    for (int k = 0; k < 12; k++) ticks.emplace_back(k, k % 2 ? "1e-30" : "10000");
    EXPECT_EQ(namesOf(thinned(ticks, {-.5, 11.5, false})), "10000 10000 10000 10000 10000 10000 ");
    ticks.resize(4);
    EXPECT_EQ(namesOf(thinned(ticks, {-.5, 3.5, false})), "10000 1e-30 10000 1e-30 ");
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
