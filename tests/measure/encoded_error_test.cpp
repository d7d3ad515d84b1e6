// Known answers for the error's statistics, and a planted error found again.
#include "measure/encoded_error.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "cpu/cpu_runner.hpp"
#include "effect/runner.hpp"
#include "frame/color_encoding.hpp"
#include "measure/bench.hpp"
#include "measure/reference.hpp"

namespace brume {
namespace {

TEST(Error, PercentileIsTheSmallestValueThatThatShareDoesNotExceed) {
    std::vector<double> values(1000);
    for (int k = 0; k < 1000; k++) values[k] = (k * 7 + 3) % 1000 + 1;  // 1..1000 in some order
    EXPECT_EQ(percentileOf(values, .999), 999);
    EXPECT_EQ(percentileOf(values, 1), 1000);
    EXPECT_EQ(percentileOf(values, .5), 500);
    EXPECT_EQ(percentileOf(values, .0001), 1);
    EXPECT_EQ(percentileOf({4}, .999), 4);
    EXPECT_EQ(percentileOf({1, 2}, .999), 2);
    EXPECT_TRUE(std::isnan(percentileOf({}, .5)));
}

TEST(Error, StatisticsHaveKnownAnswers) {
    std::vector<double> errors(2001, 0);
    std::vector<cv::Point> pixels;
    for (int k = 0; k < 2001; k++) pixels.emplace_back(k, 2 * k);
    errors[5] = 3, errors[1234] = 4, errors[7] = std::nan("");
    auto s = errorStatistics(errors, pixels);
    EXPECT_EQ(s.worst, 4);
    EXPECT_EQ(s.place, cv::Point(1234, 2468));
    EXPECT_DOUBLE_EQ(s.rms, 5 / std::sqrt(2000.));
    EXPECT_EQ(s.percentile, 0);  // 2 of 2000 are above it: a thousandth
    EXPECT_EQ(s.compared, 2000u);
    EXPECT_EQ(s.leftOut, 1u);
    EXPECT_EQ(errorStatistics({}, {}).place, cv::Point(-1, -1));
}

TEST(Error, CountsEncodedStepsOfTheWorstChannelAfterClipping) {
    EXPECT_EQ(encodedDifference({0, 0, 0, 0}, {0, 0, 0, 1}), 0);  // alpha does not count
    EXPECT_EQ(encodedDifference({2, 9, 1, 0}, {1, HUGE_VAL, 3, 0}), 0);
    EXPECT_EQ(encodedDifference({-5, 0, 0, 0}, {0, 0, 0, 0}), 0);
    EXPECT_NEAR(encodedDifference({srgbDecode(100 / 255.), .2, srgbDecode(7 / 255.), 0},
                                  {srgbDecode(103.5 / 255.), .2, srgbDecode(6 / 255.), 0}),
                3.5, 1e-9);
    EXPECT_NEAR(encodedDifference({1e-3, 0, 0, 0}, {0, 0, 0, 0}), 255 * 12.92e-3, 1e-9);
    EXPECT_EQ(encodedDifference({NAN, 0, 0, 0}, {0, 0, 0, 0}), HUGE_VAL);
    EXPECT_EQ(encodedDifference({0, 0, 0, 0}, {NAN, 0, 0, 0}), HUGE_VAL);
    EXPECT_EQ(encodedDifference({NAN, .1, 0, 0}, {NAN, .1, 0, 0}), 0);
}

TEST(Error, TheGridHasOnePixelInEachCellAndIsTheSameEachTime) {
    const cv::Size image(641, 359);
    auto grid = sampleGrid(image, 900, 3);
    EXPECT_LE(grid.pixels.size(), 900u);
    EXPECT_GT(grid.pixels.size(), 800u);
    ASSERT_EQ(grid.pixels.size(), size_t(grid.cells.area()));
    for (int j = 0; j < grid.cells.height; j++)
        for (int i = 0; i < grid.cells.width; i++) {
            cv::Point p = grid.pixels[j * grid.cells.width + i];
            EXPECT_LE(i * image.width / grid.cells.width, p.x);
            EXPECT_LT(p.x, (i + 1) * image.width / grid.cells.width);
            EXPECT_LE(j * image.height / grid.cells.height, p.y);
            EXPECT_LT(p.y, (j + 1) * image.height / grid.cells.height);
        }
    EXPECT_EQ(sampleGrid(image, 900, 3).pixels, grid.pixels);
    EXPECT_NE(sampleGrid(image, 900, 4).pixels, grid.pixels);
    auto whole = sampleGrid({7, 5}, 900, 1);
    EXPECT_EQ(whole.pixels.size(), 35u);
    EXPECT_EQ(whole.pixels[8], cv::Point(1, 1));
    EXPECT_EQ(sampleGrid({1, 4000}, 100, 1).cells.width, 1);
}

// out = C·gain, whose CPU half is wrong by `planted` at one pixel; and a shift by one column, which is not
// pointwise.
struct Gain {
    float gain = 1, planted = 0;
};
const cv::Point plantedAt(37, 11);

void gainRows(const Gain& p, const CpuContext& c, cv::Range rows) {
    cv::Mat out = c.output;
    for (int j = rows.start; j < rows.end; j++)
        for (int i = 0; i < out.cols; i++) {
            cv::Vec4f v = c.input.at<cv::Vec4f>(j, i) * p.gain;
            if (cv::Point(i, j) == plantedAt) v[1] += p.planted;
            out.at<cv::Vec4f>(j, i) = v;
        }
}
ReferencePixel gainTruth(const Gain& p, const ReferenceContext& c, cv::Point at) {
    ReferencePixel truth;
    truth.color = cv::Vec4d(c.input.at<cv::Vec4f>(at)) * double(p.gain);
    truth.transmittance = cv::Vec4d::all(.5);
    return truth;
}
struct None {};
void shiftRun(const None&, const CpuContext& c) {
    cv::Mat out = c.output;
    for (int j = 0; j < out.rows; j++)
        for (int i = 0; i < out.cols; i++)
            out.at<cv::Vec4f>(j, i) = c.input.at<cv::Vec4f>(j, (i + 1) % out.cols);
}
ReferencePixel shiftTruth(const None&, const ReferenceContext& c, cv::Point at) {
    ReferencePixel truth;
    truth.color = c.input.at<cv::Vec4f>(at.y, (at.x + 1) % c.input.cols);
    return truth;
}

Step gainStep(double gain, double planted = 0) {
    auto effect = std::make_shared<Effect>();
    effect->header =
        parseHeader("gain.fs", R"(/*{"SPACE": "linear", "POINTWISE": true, "WRITES": ["transmittance"],
        "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}, {"NAME": "gain", "TYPE": "float", "DEFAULT": 1},
                   {"NAME": "planted", "TYPE": "float", "DEFAULT": 0}]}*/)");
    effect->plugin = std::make_shared<EffectOf<Gain>>(EffectOf<Gain>()
                                                          .bind("gain", &Gain::gain)
                                                          .bind("planted", &Gain::planted)
                                                          .rows(gainRows)
                                                          .reference(gainTruth));
    Step step;
    step.effect = effect;
    step.id = "gain";
    step.values = defaultValues(effect->header.parameters);
    step.values["gain"].numbers[0] = gain;
    step.values["planted"].numbers[0] = planted;
    return step;
}
Step shiftStep() {
    auto effect = std::make_shared<Effect>();
    effect->header = parseHeader(
        "shift.fs", R"(/*{"SPACE": "linear", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}]}*/)");
    effect->plugin = std::make_shared<EffectOf<None>>(EffectOf<None>().run(shiftRun).reference(shiftTruth));
    Step step;
    step.effect = effect;
    step.id = "shift";
    step.values = defaultValues(effect->header.parameters);
    return step;
}

FramePair smallFrame() {
    FramePair frame = benchFrames({64, 36})[2];
    frame.color = cv::min(frame.color, .9);
    return frame;
}

TEST(Error, FindsAPlantedErrorInAChain) {
    FramePair frame = smallFrame();
    Chain chain;
    chain.steps = {gainStep(.5, .01), shiftStep(), gainStep(.75)};
    auto grid = sampleGrid(frame.size(), 1e9);
    auto truth = referenceOfChain(chain, frame, grid.pixels);
    auto image = makeCpuRunner()->run(chain, frame, {}).images["color"];
    auto s = errorStatistics(encodedErrors(image, grid.pixels, truth), grid.pixels);
    EXPECT_EQ(s.place, plantedAt - cv::Point(1, 0));  // the shift moved it
    double right = frame.color.at<cv::Vec4f>(plantedAt)[1] * .375;
    EXPECT_NEAR(s.worst, 255 * (srgbEncode(right + .0075) - srgbEncode(right)), 1e-3);
    // Everywhere else only fp32's rounding is left: of values below .9, encoded with a slope under 12.92.
    chain.steps[0].values["planted"].numbers[0] = 0;
    image = makeCpuRunner()->run(chain, frame, {}).images["color"];
    EXPECT_LT(errorStatistics(encodedErrors(image, grid.pixels, truth), grid.pixels).worst,
              255 * 12.92 * 1.2e-7);
}

TEST(Error, TheReferenceOfAChainIsTheSameAskedSparselyAndWhole) {
    FramePair frame = smallFrame();
    Chain chain;
    chain.steps = {shiftStep(), gainStep(.5), gainStep(.25)};
    auto grid = sampleGrid(frame.size(), 50);
    auto sparse = referenceOfChain(chain, frame, grid.pixels);
    // A last step that is not pointwise asks for every pixel of those before; two shifts less one are one.
    Chain whole;
    whole.steps = {gainStep(.5), gainStep(.25), shiftStep()};
    auto full = referenceOfChain(whole, frame, grid.pixels);
    for (size_t k = 0; k < grid.pixels.size(); k++) {
        EXPECT_LT(cv::norm(sparse[k].color - full[k].color), 1e-7);
        EXPECT_EQ(sparse[k].transmittance, cv::Vec4d::all(.25));
    }
}

TEST(Error, NamedImagesAndSizesOfAChain) {
    FramePair frame = smallFrame();
    Chain chain;
    chain.steps = {gainStep(.5), shiftStep()};
    chain.steps[0].output = "dim";
    chain.steps[1].input = "dim";
    auto truth = referenceOfChain(chain, frame, std::vector<cv::Point>{{3, 4}});
    EXPECT_LT(cv::norm(truth[0].color - cv::Vec4d(frame.color.at<cv::Vec4f>(4, 4)) * .5), 1e-7);
    EXPECT_EQ(outputSizeOfChain(chain, frame), frame.size());
    chain.steps[1].input = "none";
    EXPECT_THROW(referenceOfChain(chain, frame, std::vector<cv::Point>{{3, 4}}), std::exception);
}

}  // namespace
}  // namespace brume
