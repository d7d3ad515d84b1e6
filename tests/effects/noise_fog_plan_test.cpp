// What noise_fog's plan foretells, and by what.
#include <gtest/gtest.h>

#include <random>

#include "common/noise_volume.hpp"
#include "fog_fixture.hpp"
#include "frame/color_encoding.hpp"
#include "noise_fog/plan.hpp"

namespace brume {
using namespace noise_fog;
namespace {

constexpr uint32_t seed = 5;

// One row of places: their noise where it is baked, exact, and where it is baked but no volume is there.
struct Row {
    NoiseFog p;
    std::vector<float> volume;
    Texels computed;
    Constants k{};
    Tile t;

    explicit Row(const NoiseFog& params) : p(params), computed(p.edge()) {
        const std::vector<double> texels =
            bakeNoise(NoiseKind(p.noise), p.octaves, p.tile, p.edge(), p.smoothingRow(), seed);
        volume.assign(texels.begin(), texels.end());
        k.lattice = {3, 1, 2, uint32_t(p.tile) - 1, seed};
        k.edge = p.edge();
    }
    BRUME_VECTORISE void noise(int method, bool hasVolume, const float (*place)[trialWidth], float* result) {
        p.method = method;
        k.volume = hasVolume ? volume.data() : nullptr;
        k.texels = hasVolume ? nullptr : &computed;
        for (int a = 0; a < 3; a++) std::copy(place[a], place[a] + trialWidth, t.p[a]);
        noiseTile(p, k, trialWidth, t);
        std::copy(t.noise, t.noise + trialWidth, result);
    }
};

// 8 m of noise over a surface on which a pixel is .99 m wide: cells of 8, 4 and 2 m span two pixels.
TEST(NoiseFogPlan, OctavesSpanTwoPixelsOnTheNearestSurface) {
    NoiseFog p;
    p.size = 8;
    FrameStatistics frame;
    frame.radiansPerPixel = .001;
    for (const auto& [distance, octaves] :
         {std::pair{990., 3}, {1010., 2}, {2010., 1}, {1e6, 1}, {240., 5}, {.1, 5}}) {
        frame.minDistance = distance;
        EXPECT_EQ(octavesSeen(p, frame), octaves) << distance;
    }
}

// Texels computed where a plan looks are those of the volume, smoothed or not; and the largest error of
// interpolation is foretold by what rows of places show.
TEST(NoiseFogPlan, TriesTheVolumeWithoutBakingItAndForetellsItsError) {
    std::mt19937 random(4);
    for (int kind : {0, 1})
        for (int tile : {4, 16})
            for (int octaves : {1, 3})
                for (int smoothing : {0, 2}) {
                    NoiseFog p;
                    p.noise = kind, p.tile = tile, p.resolution = 32, p.octaves = octaves,
                    p.smoothing = smoothing;
                    Row row(p);
                    std::uniform_real_distribution<float> anywhere(0, float(tile));
                    double worst = 0, apart = 0, foretold = 0;
                    const int rows = smoothing ? 10 : 100;
                    for (int n = 0; n < rows; n++) {
                        float place[3][trialWidth], looked[trialWidth], computed[trialWidth],
                            exact[trialWidth];
                        for (auto& axis : place)
                            for (float& x : axis) x = anywhere(random);
                        row.noise(baked, true, place, looked);
                        row.noise(baked, false, place, computed);
                        row.noise(procedural, false, place, exact);
                        double squares = 0;
                        for (int x = 0; x < trialWidth; x++) {
                            apart = std::max(apart, double(std::abs(looked[x] - computed[x])));
                            const double off = std::abs(looked[x] - exact[x]);
                            worst = std::max(worst, off);
                            squares += off * off;
                        }
                        foretold += RayTrial::deviations * std::sqrt(squares / trialWidth) / rows;
                    }
                    const std::string what =
                        text("kind ", kind, ", tile ", tile, ", octaves ", octaves, ", smoothing ", smoothing,
                             ": ", worst / foretold, " of what is foretold");
                    EXPECT_LT(apart, 2e-6) << what;
                    EXPECT_LE(worst, foretold) << what;
                    EXPECT_GE(worst, .4 * foretold) << what;
                }
}

// Steps do on every pixel, and half as many do not: fears on top of errors cost frames.
TEST(NoiseFogPlan, TakesHardlyMoreStepsThanItNeeds) {
    FramePair frame = fogFrame({192, 108});
    frame.color.setTo(cv::Scalar(.05, .05, .05, 1));
    cv::Mat small(4, 6, CV_32F);
    cv::RNG random(8);
    random.fill(small, cv::RNG::UNIFORM, 5, 120);
    for (int j = 0; j < frame.size().height; j++)
        for (int i = 0; i < frame.size().width; i++)
            frame.depth.at<float>(j, i) = small.at<float>(j * 4 / 108, i * 6 / 192) + .05f * float(i + j);
    const auto cpu = makeCpuRunner();
    for (const char* noise :
         {R"("size": 4, "octaves": 3, "density": 0.02)", R"("size": 25, "octaves": 1, "density": 0.05)",
          R"("size": 9, "octaves": 2, "mode": "additive", "model": "power")"}) {
        auto chainOf = [&](const std::string& steps) {
            return parsePreset(text(R"({"effects": [{"effect": "noise_fog", "where": "along the ray",
                                    "method": "procedural", )",
                                    noise, R"(, "steps": )", steps, "}]}"),
                               "test", EffectRegistry::standard());
        };
        auto picture = [&](const Chain& chain) {
            return cpu->run(chain, frame, {}).images.at("color").clone();
        };
        const Chain planned = planChain(chainOf("\"auto\""), frame, Backend::Cpu, {});
        const int steps = int(planned.steps.at(0).values.at("steps").numbers.at(0));
        const cv::Mat truth = picture(chainOf("512"));
        auto shows = [&](int of) {
            const cv::Mat image = picture(chainOf(std::to_string(of)));
            double worst = 0;
            for (int j = 0; j < image.rows; j++)
                for (int i = 0; i < image.cols; i++)
                    for (int n = 0; n < 3; n++)
                        worst = std::max(worst, std::abs(srgbEncode(image.at<cv::Vec4f>(j, i)[n]) -
                                                         srgbEncode(truth.at<cv::Vec4f>(j, i)[n])));
            return 510 * worst;
        };
        EXPECT_GT(steps, 3) << "the case says nothing: " << noise;
        EXPECT_LE(shows(steps), 1) << noise << ": " << steps;
        EXPECT_GT(shows(steps / 2), 1) << noise << ": " << steps;
    }
}

}  // namespace
}  // namespace brume
