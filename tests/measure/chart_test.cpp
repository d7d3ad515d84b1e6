// Charts of a known effect: what they measure, how they are kept, what is drawn of them.
#include "measure/chart.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "cpu/cpu_runner.hpp"
#include "error.hpp"
#include "frame/color_encoding.hpp"
#include "measure/bench.hpp"
#include "measure/chart_csv.hpp"
#include "measure/chart_page.hpp"

namespace brume {
namespace {

// Adds 0.01 in one pixel, at method "wrong" only.
struct Offset {
    int method = 0;
    float amount = 0;
};
void offsetRows(const Offset& p, const CpuContext& c, cv::Range rows) {
    cv::Mat out = c.output;
    for (int j = rows.start; j < rows.end; j++)
        for (int i = 0; i < out.cols; i++) {
            cv::Vec4f v = c.input.at<cv::Vec4f>(j, i);
            if (p.method == 1 && i == 5 && j == 7) v[1] += p.amount;
            out.at<cv::Vec4f>(j, i) = v;
        }
}
ReferencePixel offsetTruth(const Offset&, const ReferenceContext& c, cv::Point at) {
    ReferencePixel truth;
    truth.color = cv::Vec4d(c.input.at<cv::Vec4f>(at));
    return truth;
}

std::shared_ptr<Effect> offsetEffect() {
    auto effect = std::make_shared<Effect>();
    effect->header = parseHeader("offset.fs", R"(/*{"SPACE": "linear", "POINTWISE": true,
        "INPUTS": [{"NAME": "inputImage", "TYPE": "image"},
                   {"NAME": "method", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["right", "wrong"], "DEFAULT": 0},
                   {"NAME": "amount", "TYPE": "float", "DEFAULT": 0}],
        "CHART": {"METHODS": [{"NAME": "right"},
                              {"NAME": "wrong", "SET": {"method": "wrong"}, "KNOB": "amount", "VALUES": [0.01, 0.02]},
                              {"NAME": "elsewhere", "BACKENDS": ["gl"]}]}}*/)");
    effect->header.name = "offset";
    effect->plugin = std::make_shared<EffectOf<Offset>>(EffectOf<Offset>()
                                                            .bind("method", &Offset::method)
                                                            .bind("amount", &Offset::amount)
                                                            .rows(offsetRows)
                                                            .reference(offsetTruth));
    return effect;
}

TEST(Chart, MeasuresEveryVariantAndFindsThePlantedError) {
    FramePair frame = benchFrames({24, 16})[1];
    frame.name = "small";
    frame.color = cv::Scalar(.2, .3, .4, 1);
    auto runner = makeCpuRunner();
    size_t calls = 0;
    ChartOptions options{3, .01, 1000};
    auto effect = offsetEffect();
    auto all = chartEffect(effect, frame, {runner.get()}, options, [&](const ChartRow&) { calls++; });
    ASSERT_EQ(all.size(), 3u);  // "elsewhere" is not for this backend
    EXPECT_EQ(calls, 3u);
    EXPECT_EQ(chartCount(*effect, {runner.get()}), 3u);
    EXPECT_EQ(all[0].row.error.worst, 0);
    EXPECT_TRUE(all[0].row.onFrontier);
    for (int k = 1; k < 3; k++) {
        const ChartRow& row = all[size_t(k)].row;
        EXPECT_EQ(row.label(), k == 1 ? "wrong, amount 0.01" : "wrong, amount 0.02");
        EXPECT_EQ(row.error.place, cv::Point(5, 7));
        const double amount = double(.01f) * k;
        EXPECT_NEAR(row.error.worst, 255 * (srgbEncode(double(.3f) + amount) - srgbEncode(double(.3f))),
                    1e-3);
        EXPECT_NEAR(row.error.rms, row.error.worst / std::sqrt(24. * 16), 1e-9);
        EXPECT_EQ(row.error.compared, 24u * 16);
        EXPECT_EQ(all[size_t(k)].errors[7 * 24 + 5], row.error.worst);
    }
    for (const auto& m : all) {
        EXPECT_TRUE(m.row.hasError);
        EXPECT_GT(m.row.milliseconds, 0);
        EXPECT_LE(m.row.low, m.row.milliseconds);
        EXPECT_GE(m.row.runs, 2);
        EXPECT_GE(m.row.high, m.row.milliseconds);
        EXPECT_GT(m.row.copy, 0);
        EXPECT_EQ(m.row.copy, all[0].row.copy);
        EXPECT_EQ(m.cells, cv::Size(24, 16));
    }
}

TEST(Chart, FindsAWorstPixelThatTheSamplesMiss) {
    FramePair frame = benchFrames({24, 16})[1];
    frame.color = cv::Scalar(.2, .3, .4, 1);
    auto runner = makeCpuRunner();
    auto all = chartEffect(offsetEffect(), frame, {runner.get()}, {3, .01, 12});
    ASSERT_EQ(all.size(), 3u);
    EXPECT_EQ(all[1].row.error.rms, 0) << "a sample at the planted pixel: this test shows nothing";
    for (int k = 1; k < 3; k++) {
        EXPECT_EQ(all[size_t(k)].row.error.place, cv::Point(5, 7));
        EXPECT_GT(all[size_t(k)].row.error.worst, 1);
    }
    EXPECT_EQ(all[0].row.error.worst, 0) << "the truth, not another method, is what a method is judged by";
}

TEST(Chart, WhatFailsIsARowWithItsReason) {
    FramePair frame = benchFrames({8, 8})[0];
    auto effect = offsetEffect();
    auto broken = std::make_shared<EffectOf<Offset>>(
        EffectOf<Offset>()
            .bind("method", &Offset::method)
            .bind("amount", &Offset::amount)
            .rows(offsetRows)
            .reference(+[](const Offset&, const ReferenceContext&, cv::Point) -> ReferencePixel {
                throw std::runtime_error("no truth today");
            }));
    effect->plugin = broken;
    auto runner = makeCpuRunner();
    auto all = chartEffect(effect, frame, {runner.get()}, {3, .01, 10});
    ASSERT_EQ(all.size(), 3u);
    EXPECT_NE(all[0].row.problem.find("no truth today"), std::string::npos) << all[0].row.problem;
    EXPECT_FALSE(all[0].row.onFrontier);
}

ChartRow row(const std::string& caseName, const std::string& method, const std::string& backend, double ms,
             double worst) {
    ChartRow r;
    r.effect = "made_up";
    r.caseName = caseName;
    r.method = method;
    r.backend = backend;
    r.device = backend == "gl" ? "OSMesa: Mesa/X.org, llvmpipe (LLVM 15, 256 bits), 4.5" : "CPU";
    r.frame = "street";
    r.size = {64, 36};
    r.milliseconds = ms;
    r.low = ms * .9;
    r.high = ms * 1.1;
    r.runs = 7;
    r.copy = .5;
    r.error.worst = worst;
    r.error.rms = worst / 7;
    r.error.percentile = worst / 3;
    r.error.compared = 1000;
    r.error.place = {3, 4};
    r.hasError = true;
    return r;
}

TEST(Chart, FrontiersAreEachCasesAndBackendsOwn) {
    std::vector<ChartRow> rows = {row("a", "x", "cpu", 1, 9),  row("a", "y", "cpu", 2, 3),
                                  row("a", "z", "cpu", 3, 4),  row("b", "z", "cpu", 3, 4),
                                  row("a", "z", "gl", 30, 40), row("a", "peer", "peer", .1, 0)};
    rows.push_back(row("a", "failed", "cpu", 0, 0));
    rows.back().problem = "failed";
    markFrontiers(rows);
    std::vector<bool> on;
    for (const auto& r : rows) on.push_back(r.onFrontier);
    EXPECT_EQ(on, (std::vector<bool>{true, true, false, true, true, false, false}));
    EXPECT_EQ(fastestUnseen(rows, "a", "cpu"), nullptr);
    rows[2].error.worst = .5;
    rows[1].error.worst = .2;
    EXPECT_EQ(fastestUnseen(rows, "a", "cpu"), &rows[1]);
    EXPECT_EQ(casesOf(rows), (std::vector<std::string>{"a", "b"}));
}

TEST(ChartCsv, IsReadBackUnchanged) {
    std::vector<ChartRow> rows = {row("case, \"quoted\"\nline", "x", "cpu", 1 / 3., 1e-17),
                                  row("", "y", "gl", 2e300, std::numeric_limits<double>::infinity())};
    rows[0].knob = "steps";
    rows[0].value = "8";
    rows[0].map = "a.png";
    rows[1].problem = "it's \"broken\", badly";
    rows[1].hasError = false;
    EXPECT_EQ(fromCsv(toCsv(rows), "t.csv"), rows);
    EXPECT_TRUE(fromCsv(toCsv({}), "t.csv").empty());
    EXPECT_EQ(toCsv(rows).substr(0, 35), "effect,case,method,knob,value,backe");
}

TEST(ChartCsv, SaysWhereAFileIsWrong) {
    auto mistake = [](const std::string& csv) {
        try {
            fromCsv(csv, "t.csv");
        } catch (const Error& e) {
            return std::string(e.what());
        }
        return std::string("none");
    };
    const std::string csv = toCsv({row("a", "x", "cpu", 1, 1)});
    EXPECT_NE(mistake("").find("t.csv: is empty"), std::string::npos);
    EXPECT_NE(mistake("a,b\n").find("line 1 has 2 fields"), std::string::npos);
    std::string wrong = csv;
    wrong.replace(wrong.find("milliseconds"), 12, "minutes");
    EXPECT_NE(mistake(wrong).find("'minutes' is no column here, which is milliseconds"), std::string::npos);
    wrong = csv;
    wrong.replace(wrong.rfind(",64,"), 4, ",wide,");
    EXPECT_NE(mistake(wrong).find("line 2: 'wide' is no width"), std::string::npos) << mistake(wrong);
}

TEST(ChartPage, NumbersHaveThreeDigitsThatCount) {
    EXPECT_EQ(shortNumber(0), "0");
    EXPECT_EQ(shortNumber(1234.5), "1234");
    EXPECT_EQ(shortNumber(12.345), "12.3");
    EXPECT_EQ(shortNumber(.012345), "0.0123");
    EXPECT_EQ(shortNumber(.0000123), "1.2e-5");
}

TEST(ChartPage, CasesOfOneMethodEachShareAPanel) {
    std::vector<ChartRow> rows = {row("a", "x", "cpu", 1, .1), row("b", "x", "cpu", 2, .2),
                                  row("a", "peer", "peer", 3, .3)};
    markFrontiers(rows);
    PlotPage page = chartPlot(rows);
    ASSERT_EQ(page.panels.size(), 1u);
    std::vector<std::string> names;
    for (const auto& s : page.panels[0].series) names.push_back(s.name);
    EXPECT_EQ(names, (std::vector<std::string>{"a", "b", "peer, a"}));
    rows.push_back(row("b", "y", "cpu", 4, .05));
    rows.back().knob = "table_size", rows.back().value = "8";
    markFrontiers(rows);
    page = chartPlot(rows);
    ASSERT_EQ(page.panels.size(), 2u);
    EXPECT_EQ(page.panels[1].series.back().name, "y (table size)") << "what the numbers at its ends are";
}

TEST(ChartPage, HoldsEveryChartOfAFolder) {
    const std::string folder =
        (std::filesystem::temp_directory_path() / ("brume-chart-page-" + std::to_string(::getpid())))
            .string();
    std::filesystem::create_directories(folder);
    std::vector<ChartRow> rows = {row("a<b", "x", "cpu", 1, .1), row("a<b", "y", "gl", 2, 3)};
    markFrontiers(rows);
    writeCsv(rows, folder + "/made_up.csv");
    for (auto& r : rows) r.effect = "other", r.hasError = false, r.onFrontier = false;
    writeCsv(rows, folder + "/other.csv");
    PlotPage page = chartPlot(readCsv(folder + "/made_up.csv"));
    ASSERT_EQ(page.panels.size(), 2u);
    EXPECT_EQ(page.panels[0].title, "a<b · CPU");
    EXPECT_EQ(page.panels[1].title, "a<b · OpenGL, llvmpipe");
    EXPECT_EQ(page.panels[0].marks.size(), 2u);
    writePlots(page, folder + "/made_up");
    writeChartPage(folder);
    std::ifstream in(folder + "/index.html");
    std::ostringstream html;
    html << in.rdbuf();
    for (const char* part : {"id=\"made_up\"", "id=\"other\"", "a&lt;b", "data:image/svg+xml;base64,",
                             "no reference", "none of those charted", "2.00"})
        EXPECT_NE(html.str().find(part), std::string::npos) << part;
    EXPECT_EQ(html.str().find("src=\"made_up"), std::string::npos) << "nothing outside is asked for";
    std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace brume
