#include "cpu/cpu_runner.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/core.hpp>

#include "effect/preset.hpp"
#include "error.hpp"
#include "frame/image_pool.hpp"

using namespace brume;

static FramePair frame(int width = 37, int height = 21) {
    FramePair pair;
    pair.name = "frame";
    pair.color.create(height, width, CV_32FC4);
    pair.depth.create(height, width, CV_32F);
    cv::RNG random(7);
    random.fill(pair.color, cv::RNG::UNIFORM, 0, 4);
    random.fill(pair.depth, cv::RNG::UNIFORM, 1, 300);
    pair.camera = Camera::withHorizontalView(pair.size(), 80);
    return pair;
}

static const EffectRegistry& all() {
    static const EffectRegistry registry(
        {BRUME_BINARY_DIR "/tests/effects", BRUME_BINARY_DIR "/lib/brume/effects"});
    return registry;
}
static Chain preset(const std::string& effects) {
    return parsePreset("{\"effects\": [" + effects + "]}", "test", all());
}

static bool sameBits(const cv::Mat& a, const cv::Mat& b) {
    if (a.size() != b.size() || a.type() != b.type()) return false;
    for (int j = 0; j < a.rows; j++)
        if (std::memcmp(a.ptr(j), b.ptr(j), a.cols * a.elemSize()) != 0) return false;
    return true;
}

static const char* fog = R"({"effect": "depth_fog", "visibility": 90})";
static const char* glow = R"({"effect": "blend", "mode": "add", "strength": 0.25})";

TEST(CpuRunner, FusedStepsGiveTheBitsOfSeparateOnes) {
    auto pair = frame(300, 200);
    auto runner = makeCpuRunner();
    auto fused = runner->run(preset(std::string(fog) + "," + glow + "," + fog), pair, {"transmittance"});
    ASSERT_EQ(fused.timings.size(), 1u) << "one pass over memory";
    EXPECT_EQ(fused.timings[0].name, "depth_fog+blend+depth_fog2");

    auto one = runner->run(preset(fog), pair, {"transmittance"});
    auto second = pair;
    second.color = one.images["color"].clone();
    cv::Mat sum = one.images["color"].clone();
    for (int k = 0; k < sum.rows * sum.cols; k++)
        for (int n = 0; n < 3; n++) sum.ptr<cv::Vec4f>()[k][n] += pair.color.ptr<cv::Vec4f>()[k][n] * .25f;
    second.color = sum;
    auto three = runner->run(preset(fog), second, {"transmittance"});
    EXPECT_TRUE(sameBits(fused.images["color"], three.images["color"]));
    cv::Mat product = one.images["transmittance"].mul(three.images["transmittance"]);
    EXPECT_TRUE(sameBits(fused.images["transmittance"], product));
}

TEST(CpuRunner, AnyNumberOfThreadsGivesTheSameBits) {
    auto pair = frame(301, 97);
    auto chain = preset(std::string(fog) + "," + glow);
    int threads = cv::getNumThreads();
    cv::setNumThreads(1);
    auto one = makeCpuRunner()->run(chain, pair, {});
    cv::setNumThreads(7);
    auto seven = makeCpuRunner()->run(chain, pair, {});
    cv::setNumThreads(threads);
    EXPECT_TRUE(sameBits(one.images["color"], seven.images["color"]));
}

TEST(CpuRunner, NeverChangesTheCapturedFrame) {
    auto pair = frame();
    cv::Mat before = pair.color.clone();
    auto runner = makeCpuRunner();
    auto result = runner->run(preset(std::string(fog) + "," + fog), pair, {"captured"});
    EXPECT_TRUE(sameBits(before, pair.color));
    EXPECT_TRUE(sameBits(before, result.images["captured"]));
    EXPECT_FALSE(sameBits(before, result.images["color"]));
}

TEST(CpuRunner, AResultSurvivesTheNextRun) {
    auto pair = frame();
    auto runner = makeCpuRunner();
    auto first = runner->run(preset(fog), pair, {});
    cv::Mat copy = first.images["color"].clone();
    auto second = runner->run(preset(glow), pair, {});
    EXPECT_TRUE(sameBits(first.images["color"], copy));
    EXPECT_FALSE(sameBits(first.images["color"], second.images["color"]));
}

// A runner keeps derived constants; they must follow every parameter they come from, also one that is named
// as a property of the frame is (noise_fog's "size").
TEST(CpuRunner, AfterAnyParameterChangesAWarmRunnerGivesTheBitsOfAFreshOne) {
    const auto pair = frame(24, 16);
    auto warm = makeCpuRunner();
    size_t changed = 0;
    for (const std::string& name : EffectRegistry::standard().names()) {
        Chain chain = parsePreset("{\"effects\": [{\"effect\": \"" + name + "\"}]}", "test",
                                  EffectRegistry::standard());
        Step& step = chain.steps[0];
        if (!step.effect->plugin || step.effect->header.derived.empty()) continue;
        if (step.values.count("resolution")) step.values.at("resolution").numbers = {32};
        for (auto& [parameter, value] : step.values)
            if (value.automatic) value = ParameterValue{{1}};
        warm->run(chain, pair, {});
        for (const Parameter& parameter : step.effect->header.parameters) {
            auto& numbers = step.values.at(parameter.name).numbers;
            if (numbers.size() != 1 || parameter.type != ParameterType::Float) continue;
            const double low = parameter.min.empty() ? numbers[0] - 1 : parameter.min[0];
            numbers[0] = numbers[0] > low ? (numbers[0] + low) / 2 : low + 1;
            changed++;
            const cv::Mat kept = warm->run(chain, pair, {}).images.at("color"),
                          fresh = makeCpuRunner()->run(chain, pair, {}).images.at("color");
            EXPECT_TRUE(sameBits(kept, fresh)) << name << "." << parameter.name;
        }
    }
    EXPECT_GT(changed, 50u);
}

// Read at its own size, at another, as the input, and in place: the frame's own image stays what it was.
TEST(CpuRunner, AnImageOfOneChannelIsGreyAndOpaque) {
    auto pair = frame(37, 21);
    auto runner = makeCpuRunner();
    for (const cv::Size size : {pair.size(), cv::Size(9, 5)}) {
        pair.images["mask"] = cv::Mat(size, CV_32F, cv::Scalar(.25));
        const cv::Mat grey(size, CV_32FC4, cv::Scalar(.25, .25, .25, 1));
        Chain chain = preset(R"({"effect": "blend", "mode": "mix", "strength": 1})");
        chain.steps[0].values.at("second").text = "mask";
        auto result = runner->run(chain, pair, {"mask"});
        for (int n = 0; n < 3; n++) {
            cv::Mat channel;
            cv::extractChannel(result.images["color"], channel, n);
            EXPECT_LT(cv::norm(channel, cv::Mat(pair.size(), CV_32F, cv::Scalar(.25)), cv::NORM_INF), 1e-7);
        }
        EXPECT_TRUE(sameBits(result.images["mask"], grey));
        chain = preset(R"({"effect": "blend", "mode": "mix", "strength": 0})");
        chain.steps[0].values.at("second").text = "mask";
        chain.steps[0].input = chain.steps[0].output = "mask";
        result = runner->run(chain, pair, {"mask"});
        EXPECT_TRUE(sameBits(result.images["mask"], grey));
        EXPECT_TRUE(sameBits(pair.images["mask"], cv::Mat(size, CV_32F, cv::Scalar(.25))));
    }
}

TEST(CpuRunner, NamedImagesKeepTheirSizeAndReadersResample) {
    auto pair = frame(37, 21);
    auto runner = makeCpuRunner();
    auto result = runner->run(preset(R"({"effect": "halve", "output": "small"},
        {"effect": "blend", "second": "small", "mode": "mix", "strength": 1})"),
                              pair, {"small"});
    EXPECT_EQ(result.images["small"].size(), cv::Size(19, 11));
    EXPECT_EQ(result.images["color"].size(), cv::Size(37, 21));
    pair.color.setTo(cv::Scalar(.25, .5, .75, 1));
    result = runner->run(
        preset(R"({"effect": "halve", "output": "small"}, {"effect": "blend", "second": "small"})"), pair,
        {});
    EXPECT_LT(cv::norm(result.images["color"], pair.color, cv::NORM_INF), 2e-7)
        << "resampling keeps a constant";
}

TEST(CpuRunner, ResamplingIsBilinearByPixelCentres) {
    cv::RNG random(11);
    for (cv::Size from : {cv::Size(1, 1), cv::Size(5, 3), cv::Size(16, 9), cv::Size(33, 20)})
        for (cv::Size to :
             {cv::Size(1, 1), cv::Size(20, 12), cv::Size(64, 36), cv::Size(131, 7), cv::Size(7, 50)}) {
            cv::Mat image(from, CV_32FC4);
            random.fill(image, cv::RNG::UNIFORM, -1, 4);
            const cv::Mat result = resampleLinear(image, to);
            ASSERT_EQ(result.size(), to);
            auto at = [&](double x, double y) {
                const int i = int(std::floor(x)), j = int(std::floor(y));
                cv::Vec4d sum;
                for (int b = 0; b < 2; b++)
                    for (int a = 0; a < 2; a++)
                        sum += (a ? x - i : 1 - x + i) * (b ? y - j : 1 - y + j) *
                               cv::Vec4d(image.at<cv::Vec4f>(std::clamp(j + b, 0, from.height - 1),
                                                             std::clamp(i + a, 0, from.width - 1)));
                return sum;
            };
            double worst = 0;
            for (int j = 0; j < to.height; j++)
                for (int i = 0; i < to.width; i++)
                    worst = std::max(worst, cv::norm(cv::Vec4d(result.at<cv::Vec4f>(j, i)) -
                                                         at((i + .5) * from.width / to.width - .5,
                                                            (j + .5) * from.height / to.height - .5),
                                                     cv::NORM_INF));
            EXPECT_LT(worst, 1e-6) << from << " to " << to;  // of values up to 4; measured: 4e-7
        }
}

TEST(CpuRunner, StepsThatReadASmallerImageGiveTheBitsOfOnesThatReadItEnlarged) {
    auto pair = frame(300, 200);
    auto runner = makeCpuRunner();
    auto fused = runner->run(preset(R"({"effect": "light_detect", "reduction": "quarter", "output": "small"},
                  {"effect": "blend", "mode": "add", "second": "small"},)" +
                                    std::string(fog)),
                             pair, {"small"});
    const cv::Mat large = resampleLinear(fused.images["small"], pair.size());
    auto second = pair;
    second.color = pair.color.clone();
    for (int k = 0; k < large.rows * large.cols; k++)
        for (int n = 0; n < 3; n++) second.color.ptr<cv::Vec4f>()[k][n] += large.ptr<cv::Vec4f>()[k][n];
    EXPECT_TRUE(sameBits(fused.images["color"], runner->run(preset(fog), second, {}).images["color"]));
}

TEST(CpuRunner, ReadsTransmittanceWhereAStepAsksForIt) {
    auto pair = frame();
    auto runner = makeCpuRunner();
    auto result = runner->run(preset(std::string(fog) + R"(,{"effect": "blend", "second": "transmittance"})"),
                              pair, {"transmittance"});
    cv::Mat t = result.images["transmittance"], color = result.images["color"];
    for (int k = 0; k < t.rows * t.cols; k++)
        for (int n = 0; n < 3; n++) EXPECT_EQ(t.ptr<cv::Vec4f>()[k][n], color.ptr<cv::Vec4f>()[k][n]);
    EXPECT_EQ(runner->run(preset(glow), pair, {"transmittance"}).images["transmittance"].at<cv::Vec4f>(3, 3),
              cv::Vec4f(1, 1, 1, 1));
}

TEST(CpuRunner, EveryPartOfTheContractMatchesItsReference) {
    auto pair = frame(13, 11);
    auto runner = makeCpuRunner();
    for (const char* method : {"fragment", "compute"}) {
        auto chain = preset(
            std::string(
                R"({"effect": "contract", "lamps": [{"range": 2, "shift": [0.5, -0.5]}, {"enabled": false}], "method": ")") +
            method + "\"}");
        auto result = runner->run(chain, pair, {});
        const auto& step = chain.steps[0];
        auto params = step.effect->plugin->makeParams(step.values);
        ReferenceContext context;
        context.camera = pair.camera, context.frameSize = pair.size(), context.input = pair.color,
        context.depth = pair.depth;
        std::vector<cv::Point> pixels = {{0, 0}, {12, 10}, {5, 7}};
        std::vector<ReferencePixel> truth(3);
        step.effect->plugin->reference(params, context, pixels, truth);
        for (int k = 0; k < 3; k++)
            for (int n = 0; n < 4; n++)
                EXPECT_NEAR(result.images["color"].at<cv::Vec4f>(pixels[k])[n], truth[k].color[n],
                            2e-6 * truth[k].scale);
    }
}

TEST(CpuRunner, APluginsExceptionNamesIt) {
    auto pair = frame();
    try {
        makeCpuRunner()->run(preset(R"({"effect": "throws"})"), pair, {});
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_THAT(error.what(), testing::EndsWith("throws/throws.so: rows failed: out of fog"));
    }
}

TEST(CpuRunner, SaysWhichImageIsMissing) {
    EXPECT_THROW(makeCpuRunner()->run(preset(fog), frame(), {"lights"}), Error);
}

TEST(ImagePool, GivesMemoryBackOnlyWhenNobodyHoldsIt) {
    ImagePool pool;
    cv::Mat a = pool.take({8, 8}, CV_32FC4);
    const uchar* first = a.data;
    cv::Mat b = pool.take({8, 8}, CV_32FC4);
    EXPECT_NE(b.data, first);
    a.release();
    EXPECT_EQ(pool.take({8, 8}, CV_32FC4).data, first);
}
