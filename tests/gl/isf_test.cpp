// Foreign ISF files: what their text says is what comes out.
#include <cmath>

#include "gl_fixture.hpp"

namespace brume {
namespace {

using IsfTest = OnBothPlatforms;
BOTH_PLATFORMS(IsfTest);

double encoded(double x) { return x <= .0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - .055; }
double decoded(double x) {
    x = std::max(x, 0.);
    return x <= .04045 ? x / 12.92 : std::pow((x + .055) / 1.055, 2.4);
}

// GLSL's pow may err by some 1e-6 relative; the same twice, and once more in the shader.
constexpr double closeness = 4e-6;

TEST_P(IsfTest, TheOriginIsAtTheBottomLeft) {
    const FramePair frame = probeFrame();
    const cv::Mat color =
        runner()->run(chainOf({stepOf(fixture("isf_origin.fs"))}), frame, {}).images.at("color");
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 6; i++) {
            const cv::Vec4f got = color.at<cv::Vec4f>(j, i);
            if (i < 3) {
                EXPECT_NEAR(got[0], decoded((i + .5) / 6), closeness);
                EXPECT_NEAR(got[1], decoded((4 - j - .5) / 4), closeness);
            } else {
                for (int c = 0; c < 4; c++)
                    EXPECT_NEAR(got[c], frame.color.at<cv::Vec4f>(j, 5 - i)[c], closeness) << i << ", " << j;
            }
        }
}

TEST_P(IsfTest, ColoursArriveEncodedAndLeaveDecoded) {
    FramePair frame = probeFrame(16, 8);
    frame.color = randomImage(16, 8);
    const cv::Mat color =
        runner()->run(chainOf({stepOf(fixture("isf_invert.fs"))}), frame, {}).images.at("color");
    for (int j = 0; j < 8; j++)
        for (int i = 0; i < 16; i++)
            for (int c = 0; c < 4; c++) {
                const double in = frame.color.at<cv::Vec4f>(j, i)[c];
                EXPECT_NEAR(color.at<cv::Vec4f>(j, i)[c], c == 3 ? in : decoded(1 - encoded(in)), closeness);
            }
}

TEST_P(IsfTest, BrightAndBlackPixelsPassUnchangedThroughAnIdentity) {
    FramePair frame = probeFrame(16, 8);
    frame.color = randomImage(16, 8, 1000);
    frame.color.at<cv::Vec4f>(0, 0) = {0, 0, 0, 0};
    Step step = stepOf(fixture("isf_invert.fs"));
    step.values["amount"].numbers = {0};
    const cv::Mat color = runner()->run(chainOf({step}), frame, {}).images.at("color");
    EXPECT_EQ(color.at<cv::Vec4f>(0, 0), cv::Vec4f(0, 0, 0, 0));
    EXPECT_LE(largestDifference(color / 1000, frame.color / 1000), closeness);
}

TEST_P(IsfTest, GlslOfTheOlderEraCompiles) {
    const FramePair frame = probeFrame();
    const cv::Mat color =
        runner()->run(chainOf({stepOf(fixture("isf_old_glsl.fs"))}), frame, {}).images.at("color");
    const double tint[] = {1, .5, .25};
    for (int c = 0; c < 3; c++)
        EXPECT_NEAR(color.at<cv::Vec4f>(1, 1)[c], decoded(encoded(.25) * tint[c] * .5), closeness);
    EXPECT_NEAR(color.at<cv::Vec4f>(3, 0)[2], decoded(.25 * .5), closeness);
}

TEST_P(IsfTest, TargetsHaveTheirSizeAndPrecision) {
    const cv::Mat color = runner()
                              ->run(chainOf({stepOf(fixture("isf_two_passes.fs"))}), probeFrame(10, 6), {})
                              .images.at("color");
    const cv::Vec4f fine = color.at<cv::Vec4f>(1, 1), coarse = color.at<cv::Vec4f>(1, 8);
    EXPECT_NEAR(fine[0], decoded(float(4.0001) - 4), closeness);
    EXPECT_NEAR(fine[1], decoded(.05), closeness);
    EXPECT_NEAR(fine[2], decoded(.03), closeness);
    EXPECT_NEAR(coarse[0], decoded(std::round(.31 * 255) / 255), closeness);
    EXPECT_NEAR(coarse[1], 1, closeness);
    EXPECT_EQ(coarse[2], 0);
}

TEST_P(IsfTest, PersistentBuffersOfVersionOneSurvive) {
    const Step step = stepOf(fixture("isf_persistent.fs"));
    auto gl = runner();
    double red = 0;
    for (int frame = 1; frame <= 3; frame++) {
        red = std::round((red + .1) * 255) / 255;
        const cv::Mat color = gl->run(chainOf({step}), probeFrame(), {}).images.at("color");
        EXPECT_NEAR(color.at<cv::Vec4f>(0, 0)[0], decoded(red), closeness) << "frame " << frame;
    }
}

TEST_P(IsfTest, MistakesNameTheFile) {
    auto said = [&](const std::string& keys, const std::string& glsl) -> std::string {
        auto effect = std::make_shared<Effect>();
        effect->header =
            parseHeader("some/file.fs",
                        R"(/*{"INPUTS": [{"NAME": "inputImage", "TYPE": "image"}])" + keys + "}*/\n" + glsl);
        try {
            runner()->run(chainOf({stepOf(effect)}), probeFrame(), {});
        } catch (const Error& error) {
            return error.what();
        }
        return "nothing";
    };
    const std::string draws = "void main() { gl_FragColor = IMG_THIS_PIXEL(inputImage); }";
    EXPECT_EQ(said("", draws), "nothing");
    EXPECT_EQ(said("", "void man() {}"), "some/file.fs: its GLSL has no function main");
    EXPECT_EQ(said(R"(, "PASSES": [{"TARGET": "a", "WIDTH": "$WIDTH*$much"}, {}])", draws)
                  .rfind("some/file.fs: ", 0),
              0u);
    const std::string missing = said(R"(, "IMPORTED": {"lut": {"PATH": "none.png"}})", draws);
    EXPECT_EQ(missing.rfind("some/file.fs: some/none.png", 0), 0u) << missing;
    EXPECT_NE(said("", "void main() {\n oops; }").find("some/file.fs:3: error"), std::string::npos);
}

// Each file of fixtures/idioms draws its input inverted, each in another idiom of published files.
TEST_P(IsfTest, IdiomsOfPublishedFilesDrawWhatTheySay) {
    FramePair frame = probeFrame(12, 8);
    frame.color = randomImage(12, 8);
    auto gl = runner();
    int count = 0;
    for (const auto& item : std::filesystem::directory_iterator(BRUME_TEST_DATA "/gl/fixtures/idioms")) {
        if (item.path().extension() != ".fs") continue;
        SCOPED_TRACE(item.path().filename().string());
        count++;
        cv::Mat color;
        try {
            const auto effect = loadEffect(item.path().string(), "", {item.path().parent_path().string()});
            color = gl->run(chainOf({stepOf(effect)}), frame, {}).images.at("color");
        } catch (const Error& error) {
            ADD_FAILURE() << error.what();
            continue;
        }
        double worst = 0;
        for (int j = 0; j < 8; j++)
            for (int i = 0; i < 12; i++)
                for (int c = 0; c < 4; c++) {
                    const double in = frame.color.at<cv::Vec4f>(j, i)[c];
                    const double wanted = c == 3 ? in : decoded(1 - encoded(in));
                    const double difference = std::abs(color.at<cv::Vec4f>(j, i)[c] - wanted);
                    worst = difference <= closeness  ? worst
                            : std::isnan(difference) ? 1e9
                                                     : std::max(worst, difference);
                }
        EXPECT_EQ(worst, 0);
    }
    EXPECT_GE(count, 16);
}

}  // namespace
}  // namespace brume
