// The papers' experiments and peers: known answers, and what is said when something is wrong.
#include "measure/papers.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>

#include "cpu/cpu_runner.hpp"
#include "error.hpp"
#include "frame/color_encoding.hpp"
#include "measure/bench.hpp"
#include "measure/peer.hpp"

namespace brume {
namespace {

namespace fs = std::filesystem;

class Papers : public testing::Test {
  protected:
    void SetUp() override {
        folder_ = (fs::temp_directory_path() / ("brume-papers-" + std::to_string(::getpid()))).string();
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }
    std::string write(const std::string& name, const std::string& text) {
        std::ofstream(folder_ + "/" + name) << text;
        fs::permissions(folder_ + "/" + name, fs::perms::owner_all);
        return folder_ + "/" + name;
    }
    template <class F>
    static std::string mistake(F f) {
        try {
            f();
        } catch (const Error& e) {
            return e.what();
        }
        return "no error";
    }
    std::string folder_;
};

TEST(PictureDifference, BandsSurviveTheMeanAndNoiseDoesNot) {
    cv::Mat a(64, 64, CV_32FC4, cv::Scalar(.25, .25, .25, 1)), band = a.clone(), noise = a.clone();
    const float up = float(srgbDecode(srgbEncode(.25) + 3 / 255.)),
                down = float(srgbDecode(srgbEncode(.25) - 3 / 255.));
    for (int j = 0; j < 64; j++)
        for (int i = 0; i < 64; i++) {
            band.at<cv::Vec4f>(j, i)[1] = j < 32 ? up : down;
            noise.at<cv::Vec4f>(j, i)[1] = (i + j) % 2 ? up : down;
        }
    const cv::Vec3d banded = pictureDifference(band, a), noisy = pictureDifference(noise, a);
    for (int k = 0; k < 3; k++) EXPECT_NEAR(banded[k], 3, 1e-4);
    EXPECT_NEAR(noisy[0], 3, 1e-4);
    EXPECT_NEAR(noisy[1], 3, 1e-4);
    EXPECT_NEAR(noisy[2], 0, 1e-4);
    EXPECT_EQ(pictureDifference(a, a), cv::Vec3d());
    // A frame's edge may cut a block.
    EXPECT_NEAR(pictureDifference(band({0, 0, 17, 17}), a({0, 0, 17, 17}))[2], 3, 1e-4);
}

TEST_F(Papers, ShippedExperimentsAreReadAndNameWhatExists) {
    const auto experiments = readPapers(shippedPapers(), EffectRegistry::standard());
    EXPECT_EQ(experiments.size(), 8u);
    for (const auto& e : experiments) {
        EXPECT_FALSE(e.paper.empty() || e.title.empty() || e.measured.empty());
        EXPECT_GE(e.rows.size(), 3u) << e.title;
    }
}

TEST_F(Papers, RowsAreComparedWithTheOneNamed) {
    const std::string path =
        write("p.json", R"({"experiments": [{"paper": "P", "title": "T", "measured": "M", "against": "thin",
        "rows": [{"name": "thick", "paper": "5 ms", "effects": [{"effect": "depth_fog", "visibility": 20}]},
                 {"name": "thin", "effects": [{"effect": "depth_fog", "visibility": 2000}]},
                 {"name": "same", "effects": [{"effect": "depth_fog", "visibility": 2000}]},
                 {"name": "small", "size": "8x4", "effects": [{"effect": "depth_fog"}]}]}]})");
    auto runner = makeCpuRunner();
    FramePair frame = benchFrames({32, 18})[0];
    frame.name = "street";
    size_t calls = 0;
    const auto results = runPapers(readPapers(path, EffectRegistry::standard()), {frame}, {runner.get()},
                                   [&](const PaperResult&) { calls++; });
    ASSERT_EQ(results.size(), 4u);
    EXPECT_EQ(calls, 4u);
    EXPECT_GT(results[0].worst, 10);
    EXPECT_TRUE(results[0].hasDifference);
    EXPECT_FALSE(results[1].hasDifference);
    EXPECT_EQ(results[2].worst, 0);
    EXPECT_TRUE(results[2].hasDifference);
    EXPECT_EQ(results[3].size, cv::Size(8, 4));
    EXPECT_FALSE(results[3].hasDifference) << "another size cannot be compared";
    for (const auto& r : results) {
        EXPECT_EQ(r.problem, "");
        EXPECT_GT(r.milliseconds, 0);
    }
    const std::string page = papersPage(results, folder_);
    for (const char* part : {"<h2>T</h2>", "5 ms", "compared with this", "street"})
        EXPECT_NE(page.find(part), std::string::npos) << part;
    EXPECT_NE(toCsv(results).find("\"thick\",\"5 ms\",\"thin\",\"cpu\""), std::string::npos);
}

// Lighter by 8 steps of 255 a second, or darker, or still.
struct Pulse {
    float steps = 0;
};
Chain pulse(float steps) {
    auto effect = std::make_shared<Effect>();
    effect->header =
        parseHeader("pulse.fs", R"(/*{"SPACE": "linear", "POINTWISE": true, "WRITES": ["transmittance"],
        "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}, {"NAME": "steps", "TYPE": "float", "DEFAULT": 0, "MIN": -100}],
        "DERIVED": [{"NAME": "value", "TYPE": "float", "FROM": ["time", "steps"]}]}*/)");
    effect->header.name = "pulse";
    effect->plugin = std::make_shared<EffectOf<Pulse>>(
        EffectOf<Pulse>()
            .bind("steps", &Pulse::steps)
            .derive("value",
                    [](const Pulse& p, const DeriveContext& c) {
                        return std::vector<double>{srgbDecode((100 + double(p.steps) * c.time) / 255)};
                    })
            .rows([](const Pulse&, const CpuContext& c, cv::Range rows) {
                const float value = c.derived("value")[0];
                cv::Mat out = c.output, through = c.transmittance;
                for (int j = rows.start; j < rows.end; j++)
                    for (int i = 0; i < out.cols; i++) {
                        out.at<cv::Vec4f>(j, i) = {value, value, value, 1};
                        if (!through.empty()) through.at<cv::Vec4f>(j, i) = cv::Vec4f(.25f, .25f, .25f, 1);
                    }
            }));
    Step step;
    step.effect = effect;
    step.id = std::to_string(steps);
    step.values = defaultValues(effect->header.parameters);
    step.values.at("steps").numbers = {double(steps)};
    Chain chain;
    chain.steps = {step};
    return chain;
}

TEST(PaperMotion, IsWhatChangesAndWhetherTogether) {
    auto runner = makeCpuRunner();
    FramePair frame = benchFrames({30, 20})[0];
    const auto motions = measureMotion({pulse(8), pulse(-4), pulse(0)}, 0, frame, *runner, 2, 5);
    ASSERT_EQ(motions.size(), 3u);
    EXPECT_NEAR(motions[0].change, 4, 1e-3);  // half a second apart
    EXPECT_NEAR(motions[1].change, 2, 1e-3);
    EXPECT_EQ(motions[2].change, 0);
    EXPECT_NEAR(motions[0].shared, 1, 1e-9);
    EXPECT_NEAR(motions[1].shared, -1, 1e-4);
    EXPECT_EQ(motions[2].shared, 0);
    for (const auto& m : motions) {
        ASSERT_EQ(m.strip.size(), cv::Size(4 * 300 + 3 * 6, 200));
        EXPECT_EQ(m.strip.at<uchar>(100, 150), 191) << "a transmittance of a quarter";
        EXPECT_EQ(m.strip.at<uchar>(100, 1150), 191);
        EXPECT_EQ(m.strip.at<uchar>(100, 303), 255) << "between the pictures";
    }
}

TEST_F(Papers, AnAnimationIsComparedAndShown) {
    const std::string path = write(
        "p.json",
        R"({"experiments": [{"paper": "P", "title": "T", "measured": "M", "against": "still", "seconds": 0.25,
        "rows": [{"name": "drifts", "effects": [{"effect": "noise_fog", "wind": [9, 0, 0]}]},
                 {"name": "still", "effects": [{"effect": "noise_fog"}]}]}]})");
    auto runner = makeCpuRunner();
    auto results =
        runPapers(readPapers(path, EffectRegistry::standard()), {benchFrames({32, 18})[0]}, {runner.get()});
    ASSERT_EQ(results.size(), 2u);
    EXPECT_TRUE(results[0].hasMotion);
    EXPECT_GT(results[0].change, 0);
    EXPECT_EQ(results[1].change, 0);
    writePictures(results, folder_);
    EXPECT_EQ(results[1].picture, "papers.2.png");
    EXPECT_GT(fs::file_size(folder_ + "/papers.2.png"), 100u);
    const std::string page = papersPage(results, folder_);
    for (const char* part : {"moves with", "data:image/png;base64,", "drifts, cpu"})
        EXPECT_NE(page.find(part), std::string::npos) << part;
}

TEST_F(Papers, MistakesNameThePlace) {
    auto of = [&](const std::string& text) {
        const std::string path = write("p.json", text);
        return mistake([&] { readPapers(path, EffectRegistry::standard()); });
    };
    EXPECT_NE(of(R"({"experiments": [{"titel": ""}]})")
                  .find("experiments[0]: unknown key 'titel' (did you mean 'title'?)"),
              std::string::npos);
    EXPECT_NE(
        of(R"({"experiments": [{"rows": [{"name": "a"}]}]})").find("rows[0]: needs a preset or effects"),
        std::string::npos);
    EXPECT_NE(of(R"({"experiments": [{"against": "b", "rows": [{"name": "a", "preset": "haze_5km"}]}]})")
                  .find("no row 'b'"),
              std::string::npos);
    EXPECT_NE(of(R"({"experiments": [{"seconds": 2}]})").find("seconds needs against"), std::string::npos);
    EXPECT_NE(of(R"({"experiments": [{"seconds": "2"}]})").find("seconds must be a number"),
              std::string::npos);
    EXPECT_NE(mistake([] { readPapers("missing.json", EffectRegistry::standard()); }).find("missing.json"),
              std::string::npos);
}

TEST_F(Papers, APeerIsGivenTheFrameAndReadBack) {
    auto effect = EffectRegistry::standard().find("depth_fog");
    const auto values = defaultValues(effect->header.parameters);
    FramePair frame = benchFrames({12, 7})[0];
    const std::string good = write("good", R"sh(#!/bin/sh
grep -q '"width": 12' "$1/job.json" && grep -q '"visibility": 200' "$1/job.json" && grep -q '"repetitions": 3' "$1/job.json" || exit 1
[ "$(wc -c < "$1/depth.f32")" -eq 336 ] || exit 1
cp "$1/color.f32" "$1/output.f32"
echo '{"device": "a shell", "milliseconds": [3, 1, 2]}' > "$1/result.json"
)sh");
    const PeerResult result = runPeer(good, effect->header, values, frame, 3);
    EXPECT_EQ(result.device, "a shell");
    EXPECT_EQ(result.timing.median(), 2);
    EXPECT_EQ(cv::norm(result.output, frame.color), 0);

    auto failing = [&](const std::string& script) {
        const std::string path = write("bad", "#!/bin/sh\n" + script);
        return mistake([&] { runPeer(path, effect->header, values, frame, 3); });
    };
    EXPECT_EQ(failing("echo first >&2; echo needs a thing >&2; exit 69"), "needs a thing");
    EXPECT_NE(failing("echo why >&2; exit 4").find("status 4: why"), std::string::npos);
    EXPECT_NE(failing("exit 0").find("result.json"), std::string::npos);
    EXPECT_NE(
        failing("echo '{\"device\": \"\", \"milliseconds\": [1]}' > $1/result.json; echo > $1/output.f32")
            .find("not 1344 bytes"),
        std::string::npos);
    EXPECT_NE(mistake([&] {
                  runPeer(folder_ + "/none", effect->header, values, frame, 3);
              }).find("cannot be started"),
              std::string::npos);
}

}  // namespace
}  // namespace brume
