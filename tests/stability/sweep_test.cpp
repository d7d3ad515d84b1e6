// The sweep must pass what is right and be able to fail: the planted effect holds one sound method and one
// broken on purpose.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "cpu/cpu_runner.hpp"
#include "error.hpp"
#include "gl/gl_runner.hpp"
#include "measure/stability.hpp"

using namespace brume;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

namespace {

// Fog whose density falls with height as e^-y, seen along rays that hardly climb: T = exp(-L·(G(dy) -
// G(0))/dy), G' = e^-y. `naive` computes it so, and 0/0 where the way is level; `careful` is e^-dy/2 there.
struct LevelFog {
    int method = 0;
    float rise = 0;
};

const std::string source = R"(/*{
    "ISFVSN": "2", "SPACE": "linear",
    "INPUTS": [
        {"NAME": "inputImage", "TYPE": "image"},
        {"NAME": "method", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["careful", "naive"], "AUTO": true, "DEFAULT": "auto"},
        {"NAME": "rise", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 10}
    ],
    "STABILITY": [STABILITY_HERE]
}*/
#include "kit/image.glsl"
void main() {
    vec4 c = fetch(inputImage, pixel());
    float mean = method == method_naive ? (1.0 - exp(-rise)) / rise : rise < 0.01 ? 1.0 - 0.5 * rise : (1.0 - exp(-rise)) / rise;
    store(vec4(c.rgb * exp(-mean), c.a));
}
)";

template <class Real>
Real meanDensity(Real rise, bool isCareful) {
    return isCareful && rise < Real(.01) ? 1 - rise / 2 : (1 - std::exp(-rise)) / rise;
}

void run(const LevelFog& p, const CpuContext& c) {
    const float left = std::exp(-meanDensity(p.rise, p.method == 0));
    cv::Mat output = c.output;
    for (int j = 0; j < output.rows; j++)
        for (int i = 0; i < output.cols; i++) {
            const cv::Vec4f in = c.input.at<cv::Vec4f>(j, i);
            output.at<cv::Vec4f>(j, i) = {in[0] * left, in[1] * left, in[2] * left, in[3]};
        }
}

ReferencePixel reference(const LevelFog& p, const ReferenceContext& c, cv::Point at) {
    const double rise = p.rise, left = std::exp(rise == 0 ? -1 : std::expm1(-rise) / rise);
    ReferencePixel truth;
    const cv::Vec4f in = c.input.at<cv::Vec4f>(at);
    truth.color = {in[0] * left, in[1] * left, in[2] * left, double(in[3])};
    return truth;
}

Plan planCareful(const LevelFog&, const PlanInput&) {
    Plan plan;
    plan.chosen["method"] = 0;
    return plan;
}
Plan planNaive(const LevelFog&, const PlanInput&) {
    Plan plan;
    plan.chosen["method"] = 1;
    return plan;
}

struct Planted {
    std::shared_ptr<Effect> effect = std::make_shared<Effect>();
    Regime regime;

    explicit Planted(const std::string& stability,
                     Plan (*plan)(const LevelFog&, const PlanInput&) = planCareful) {
        std::string text = source;
        text.replace(text.find("STABILITY_HERE"), 14, stability);
        effect->header = parseHeader("level_fog.fs", text);
        effect->includePath = {BRUME_SOURCE_DIR "/src/effect"};
        effect->plugin = std::make_shared<EffectOf<LevelFog>>(EffectOf<LevelFog>()
                                                                  .bind("method", &LevelFog::method)
                                                                  .bind("rise", &LevelFog::rise)
                                                                  .run(run)
                                                                  .reference(reference)
                                                                  .plan(plan));
        regime = regimesOf(effect->header, true).at(0);
    }
    std::vector<StabilityLine> sweep() const {
        static const std::unique_ptr<Runner> cpu = makeCpuRunner(true), gl = makeGlRunner(GlPlatform::Osmesa);
        return sweepRegime(effect, regime, {cpu.get(), gl.get()});
    }
    std::vector<std::string> contradictions() const { return brume::contradictions(regime, sweep()); }
};

const std::string level =
    R"({"NAME": "level ways", "STRESS": {"NAME": "rise", "UNIT": "m", "RANGE": [1e-9, 1], "PER_DECADE": 1, "VALUES": [0]},
        "SET": {"rise": "$stress"})";

std::string holds(const std::string& map) { return level + ", \"HOLDS\": " + map + "}"; }

TEST(Sweep, PassesATrueMap) {
    EXPECT_THAT(Planted(holds(R"({"naive": [1e-5, 1]})")).contradictions(), IsEmpty());
}

TEST(Sweep, FindsABrokenMethodThatMustHold) {
    Planted planted(level + "}");
    auto sentences = planted.contradictions();
    ASSERT_FALSE(sentences.empty());
    EXPECT_THAT(sentences[0], HasSubstr("'level ways': at rise 0 m, naive must hold, but is off by inf"));
    EXPECT_THAT(sentences[0], HasSubstr("nan where 0"));
    for (const std::string& sentence : sentences) EXPECT_THAT(sentence, HasSubstr("naive"));
}

TEST(Sweep, FindsAMapThatPromisesTooLittle) {
    auto sentences = Planted(holds(R"({"naive": [1e-5, 1], "careful": [1e-5, 1]})")).contradictions();
    ASSERT_FALSE(sentences.empty());
    EXPECT_THAT(sentences[0], HasSubstr("careful is said to fail, but holds everywhere"));
}

TEST(Sweep, FindsAPlanThatWalksIntoTheTrap) {
    auto sentences = Planted(holds(R"({"naive": [1e-5, 1]})"), planNaive).contradictions();
    ASSERT_FALSE(sentences.empty());
    EXPECT_THAT(sentences, testing::Contains(HasSubstr("auto must hold")));
    EXPECT_THAT(sentences, testing::Contains(HasSubstr("naive fails, where auto does not hold either")));
    EXPECT_THAT(Planted(holds(R"({"naive": [1e-5, 1], "auto": [1e-5, 1]})"), planNaive).contradictions(),
                testing::Contains(HasSubstr("auto fails, where careful holds (naive was chosen)")));
    EXPECT_THAT(sentences[1], HasSubstr("(naive)")) << "says what auto chose";
}

TEST(Sweep, LetsAFailureBeDocumentedWhereNoMethodHolds) {
    const std::string map = R"({"naive": [1e-5, 1], "auto": [1e-5, 1]}, "BREAKS": "level ways are 0/0"})";
    const std::string alone = level + R"(, "METHODS": ["naive"], "HOLDS": )" + map;
    EXPECT_THAT(Planted(alone, planNaive).contradictions(), IsEmpty());
    // With a method beside it that holds, auto has no excuse.
    auto sentences = Planted(level + ", \"HOLDS\": " + map, planNaive).contradictions();
    EXPECT_THAT(sentences, testing::Contains(HasSubstr("auto fails, where careful holds")));
}

TEST(Sweep, WantsWhatMustBeRefusedToBeRefused) {
    const std::string stress =
        R"({"NAME": "range", "STRESS": {"NAME": "rise", "VALUES": [1], "REFUSED": [-1, 11]},
        "SET": {"rise": "$stress"}})";
    EXPECT_THAT(Planted(stress).contradictions(), IsEmpty());
    const std::string allowed =
        R"({"NAME": "range", "STRESS": {"NAME": "rise", "VALUES": [-1], "REFUSED": [10]},
        "SET": {"rise": "$stress"}})";
    auto sentences = Planted(allowed).contradictions();
    EXPECT_THAT(sentences, testing::Contains(HasSubstr("must run, but is refused: ")));
    EXPECT_THAT(sentences, testing::Contains(HasSubstr("must be refused by MIN or MAX, but runs")));
}

TEST(Sweep, MarksWhereTheToleranceIsPassed) {
    StabilityLine line;
    for (auto [stress, error] : {std::pair(1., .05), std::pair(100., 5.), std::pair(1e4, .05)}) {
        line.points.emplace_back();
        line.points.back().stress = stress;
        line.points.back().error = error;
    }
    ASSERT_EQ(line.crossings().size(), 2u);
    EXPECT_NEAR(line.crossings()[0].near, 10, 1e-9);
    EXPECT_NEAR(line.crossings()[1].near, 1000, 1e-6);
    EXPECT_EQ(line.crossings()[1].after, 1u);
    line.points[1].error = HUGE_VAL;  // no place can be told, only between which values
    ASSERT_EQ(line.crossings().size(), 2u);
    EXPECT_EQ(line.crossings()[0].near, 0);
}

TEST(Regimes, AreReadWithTheirDefaults) {
    Planted planted(holds(R"({"naive": [[0, 0], [1e-4, 1]]})"));
    const Regime& regime = planted.regime;
    EXPECT_THAT(regime.values, ElementsAre(0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, .1, 1));
    ASSERT_EQ(regime.lines.size(), 3u);
    EXPECT_EQ(regime.lines[0].name, "careful");
    EXPECT_TRUE(regime.lines[2].isAuto);
    EXPECT_EQ(holdsText(regime, regime.lines[0]), "everywhere");
    EXPECT_EQ(holdsText(regime, regime.lines[1]), "0, 0.0001 to 1 m");
    EXPECT_TRUE(regime.lines[1].holdsAt(1e-3));
    EXPECT_FALSE(regime.lines[1].holdsAt(1e-5));
}

TEST(Regimes, SpeakOfTheirStressInShort) {
    EXPECT_EQ(stressText(.1), "0.1");
    EXPECT_EQ(stressText(65504), "65504");
    EXPECT_EQ(stressText(1e7), "1e7");
    EXPECT_EQ(stressText(-1e-9), "-1e-9");
    EXPECT_EQ(stressText(1e30), "1e30");
    EXPECT_EQ(stressText(std::nan("")), "NaN");
    const std::string stress = R"({"NAME": "x", "STRESS": {"NAME": "rise", "UNIT": "m", "VALUES": )";
    EXPECT_EQ(rangeText(Planted(stress + R"([1, "inf", "NaN"], "REFUSED": [1e6]}})").regime),
              "rise from 1 to inf m, and NaN; refused: 1e6");
}

TEST(Regimes, RefuseMistakesWithASentence) {
    auto mistake = [](const std::string& stability) -> std::string {
        try {
            Planted planted(stability);
            planted.sweep();
        } catch (const Error& e) {
            EXPECT_EQ(e.kind(), ErrorKind::Usage);
            return e.what();
        }
        return "no error";
    };
    EXPECT_THAT(mistake(level + R"(, "HOLD": {}})"), HasSubstr("unknown key 'HOLD' (did you mean 'HOLDS'?)"));
    EXPECT_THAT(mistake(holds(R"({"navie": []})")), HasSubstr("no method 'navie' (did you mean 'naive'?)"));
    EXPECT_THAT(mistake(R"({"NAME": "x", "STRESS": {"NAME": "rise"}})"), HasSubstr("nothing to sweep"));
    EXPECT_THAT(mistake(level + R"(, "FRAME": {"SCENE": "groud"}})"),
                HasSubstr("no SCENE 'groud' (did you mean 'ground'?)"));
    EXPECT_THAT(mistake(level + R"(, "FRAME": {"DEPTH": "$stres"}})"), HasSubstr("stres"));
    EXPECT_THAT(mistake(R"({"NAME": "x", "STRESS": {"NAME": "rise", "VALUES": [1]}, "SET": {"rize": 1}})"),
                HasSubstr("no parameter 'rize' (did you mean 'rise'?)"));
}

TEST(ProbeFrame, StoresDepthAsADepthBufferWould) {
    using json = nlohmann::json;
    const json wall = {{"SCENE", "slope"}, {"DEPTH", 100}};
    auto worst = [&](int bits, bool reversed) {
        json d = wall;
        d["STORED"] = {{"BITS", bits}, {"NEAR", .1}, {"FAR", 1000}, {"REVERSED", reversed}};
        ProbeFrame probe = probeFrame(d, "test");
        double most = 0;
        for (int i = 0; i < probe.truth.cols; i++)
            most = std::max(
                most, std::abs(double(probe.frame.depth.at<float>(0, i)) - probe.truth.at<float>(0, i)));
        return most;
    };
    // Half a step of Z²(f-n)/(f·n)·2^-N at 150 m: MODELS.md §0.
    const double step = 150. * 150 * (1000 - .1) / (1000 * .1);
    EXPECT_LT(worst(16, false), .51 * step / 65535);
    EXPECT_GT(worst(16, false), .2 * step / 65535);
    EXPECT_LT(worst(24, false), .51 * step / 16777215 + 1e-4);
    EXPECT_LT(worst(32, true), 2e-5) << "reversed floats keep all of it";
}

}  // namespace
