// The check must pass what is right and be able to fail: each broken effect here breaks one promise.
#include "measure/check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>

#include "cpu/cpu_runner.hpp"
#include "gl/gl_runner.hpp"
#include "measure/check_mirror.hpp"

using namespace brume;
using testing::HasSubstr;

namespace {

// out = gain·C, T = exp(-gain·Z).
struct Gain {
    float gain = 1;
    int style = 0;
};

const std::string gainSource = R"(/*{
    "ISFVSN": "2", "SPACE": "linear", "POINTWISE": true, "WRITES": ["transmittance"],
    "INPUTS": [
        {"NAME": "inputImage", "TYPE": "image"},
        {"NAME": "gain", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 4},
        {"NAME": "style", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["plain", "fancy"], "DEFAULT": 0}
    ]
}*/
#include "kit/image.glsl"
void main() {
    vec4 c = fetch(inputImage, pixel());
    storeTransmittance(vec3(0.5));
    store(vec4(c.rgb * gain, c.a));
}
)";

void gainRow(const Gain& p, const CpuContext& c, int j) {
    cv::Mat out = c.output, transmittance = c.transmittance;
    for (int i = 0; i < out.cols; i++) {
        cv::Vec4f in = c.input.at<cv::Vec4f>(j, i);
        out.at<cv::Vec4f>(j, i) = {in[0] * p.gain, in[1] * p.gain, in[2] * p.gain, in[3]};
        for (int k = 0; k < 3 && !transmittance.empty(); k++) transmittance.at<cv::Vec4f>(j, i)[k] *= .5f;
    }
}

cv::Mat outputOf(const CpuContext& c) { return c.output; }

void gainRows(const Gain& p, const CpuContext& c, cv::Range rows) {
    for (int j = rows.start; j < rows.end; j++) gainRow(p, c, j);
}

ReferencePixel gainReference(const Gain& p, const ReferenceContext& c, cv::Point at) {
    cv::Vec4f in = c.input.at<cv::Vec4f>(at);
    ReferencePixel truth;
    for (int k = 0; k < 3; k++) truth.color[k] = double(in[k]) * p.gain;
    truth.color[3] = in[3];
    truth.transmittance = {.5, .5, .5, 1};
    for (int k = 0; k < 3; k++)
        if (std::isfinite(in[k])) truth.scale = std::max(truth.scale, std::abs(truth.color[k]));
    return truth;
}

EffectOf<Gain> gainPlugin() {
    return EffectOf<Gain>()
        .bind("gain", &Gain::gain)
        .bind("style", &Gain::style)
        .rows(gainRows)
        .reference(gainReference);
}

template <class P>
std::shared_ptr<const Effect> effectOf(const std::string& source, const EffectOf<P>& plugin) {
    auto effect = std::make_shared<Effect>();
    effect->header = parseHeader("fixture.fs", source);
    effect->plugin = std::make_shared<EffectOf<P>>(plugin);
    effect->includePath = {std::string(BRUME_BINARY_DIR) + "/lib/brume/glsl"};
    return effect;
}

std::shared_ptr<const Effect> glslOnly(const std::string& source) {
    auto effect = std::make_shared<Effect>();
    effect->header = parseHeader("fixture.fs", source);
    effect->includePath = {std::string(BRUME_BINARY_DIR) + "/lib/brume/glsl"};
    return effect;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

class Check : public testing::Test {
  protected:
    static Runner& gl() {
        static auto runner = makeGlRunner(GlPlatform::Osmesa);
        return *runner;
    }
    static std::vector<CheckCase> check(const std::shared_ptr<const Effect>& effect,
                                        CheckOptions options = {}) {
        options.randomSets = std::min(options.randomSets, 1);
        auto cpu = makeCpuRunner(true);
        return checkEffect(effect, *cpu, gl(), options);
    }
    static size_t failures(const std::vector<CheckCase>& cases) {
        return size_t(std::count_if(cases.begin(), cases.end(), [](auto& c) { return !c.passed(); }));
    }
    // The first problem among the cases.
    static std::string problem(const std::vector<CheckCase>& cases) {
        for (const CheckCase& c : cases)
            if (!c.problem.empty()) return c.problem;
        return "";
    }
};

TEST_F(Check, aSoundEffectPassesAndWasReallyCompared) {
    auto cases = check(effectOf(gainSource, gainPlugin()));
    size_t frames = checkFrames().size();
    EXPECT_EQ(failures(cases), 0u) << problem(cases);
    EXPECT_GE(cases.size(), 6 * frames);
    for (const CheckCase& c : cases) {
        EXPECT_GT(c.parity.compared, 0u);
        EXPECT_GT(c.reference.compared, 0u);
        ASSERT_TRUE(c.parityWorst.gl && c.parityWorst.cpu && c.parityWorst.reference);
    }
}

TEST_F(Check, aCpuHalfThatDiffersFails) {
    auto wrong = gainPlugin().rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
        gainRows({p.gain * 1.0001f, p.style}, c, rows);
    });
    auto cases = check(effectOf(gainSource, wrong));
    EXPECT_GT(failures(cases), 0u);
    bool parityFailed = false, referenceFailed = false;
    for (const CheckCase& c : cases) parityFailed |= !c.parity.passed, referenceFailed |= !c.reference.passed;
    EXPECT_TRUE(parityFailed && referenceFailed);
}

TEST_F(Check, oneWrongPixelInACornerFails) {
    auto wrong = gainPlugin().rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
        gainRows(p, c, rows);
        if (rows.end == c.output.rows)
            outputOf(c).at<cv::Vec4f>(c.output.rows - 1, c.output.cols - 1)[2] += 1e-3f;
    });
    EXPECT_GT(failures(check(effectOf(gainSource, wrong))), 0u);
}

TEST_F(Check, halvesThatAgreeOnAMistakeFailAgainstTheReference) {
    auto wrong = gainPlugin().rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
        gainRows({p.gain + 1e-3f, p.style}, c, rows);
    });
    auto cases = check(effectOf(replaced(gainSource, "c.rgb * gain", "c.rgb * (gain + 0.001)"), wrong));
    EXPECT_GT(failures(cases), 0u);
    for (const CheckCase& c : cases) EXPECT_TRUE(c.parity.passed) << c.parity.describe();
}

TEST_F(Check, onlyOneChoiceWrongFailsOnlyThere) {
    auto wrong = gainPlugin().rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
        gainRows({p.gain * (p.style ? 1.01f : 1.0f), p.style}, c, rows);
    });
    CheckOptions options;
    options.randomSets = 0;
    auto cases = check(effectOf(gainSource, wrong), options);
    for (const CheckCase& c : cases) {
        if (!c.passed()) {
            EXPECT_THAT(c.parameters, HasSubstr("style=fancy"));
        }
    }
    EXPECT_GT(failures(cases), 0u);
}

TEST_F(Check, wrongTransmittanceFails) {
    auto cases = check(effectOf(replaced(gainSource, "vec3(0.5)", "vec3(0.501)"), gainPlugin()));
    EXPECT_GT(failures(cases), 0u);
    EXPECT_EQ(cases[0].parityWorst.image, "transmittance");
}

TEST_F(Check, nanFromFiniteInputFailsEvenWhereBothHalvesAgree) {
    auto wrong = gainPlugin().rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
        gainRows(p, c, rows);
        for (int j = rows.start; j < rows.end; j++) {
            float& red = outputOf(c).at<cv::Vec4f>(j, 0)[0];
            if (c.depth.at<float>(j, 0) > 1e30f) red = std::nanf("");
        }
    });
    auto glsl = replaced(
        gainSource, "store(vec4(c.rgb * gain, c.a))",
        "vec4 o = vec4(c.rgb * gain, c.a);\n"
        "if (pixel().x == 0 && fetch(depthImage, pixel()).r > 1e30) o.r = uintBitsToFloat(0x7fc00000u);\n"
        "store(o)");
    EXPECT_THAT(problem(check(effectOf(glsl, wrong))), HasSubstr("NaN in color"));
}

TEST_F(Check, writingOutsideTheOutputFails) {
    for (bool above : {true, false}) {
        auto wrong = above ? gainPlugin().rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
            gainRows(p, c, rows);
            if (rows.start == 0) *(outputOf(c).ptr<float>(0) - 1) = 1;
        })
                           : gainPlugin().rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
                                 gainRows(p, c, rows);
                                 cv::Mat out = c.output;
                                 if (rows.end == out.rows) *(out.ptr<float>(out.rows - 1) + out.cols * 4) = 1;
                             });
        EXPECT_THAT(problem(check(effectOf(gainSource, wrong))), HasSubstr("wrote outside its output"));
    }
}

TEST_F(Check, replacingTheOutputFails) {
    auto wrong = gainPlugin().rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
        if (rows.start == 0) const_cast<CpuContext&>(c).output = c.output.clone();
        gainRows(p, c, rows);
    });
    EXPECT_THAT(problem(check(effectOf(gainSource, wrong))), HasSubstr("replaced its output"));
}

TEST_F(Check, leavingPixelsUnwrittenFails) {
    auto wrong = gainPlugin().rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
        for (int j = rows.start; j < rows.end; j++)
            if (j != 5) gainRow(p, c, j);
    });
    EXPECT_GT(failures(check(effectOf(gainSource, wrong))), 0u);
}

TEST_F(Check, changingTheInputFails) {
    auto wrong = gainPlugin().rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
        gainRows(p, c, rows);
        cv::Mat input = c.input;
        if (rows.start == 0) input.at<cv::Vec4f>(0, 0)[0] += 1;
    });
    EXPECT_THAT(problem(check(effectOf(gainSource, wrong))), HasSubstr("changed its input"));
}

TEST_F(Check, twoRunsThatDifferFail) {
    static std::atomic<int> calls = 0;
    auto wrong = gainPlugin().rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
        gainRows(p, c, rows);
        if (rows.start == 0) outputOf(c).at<cv::Vec4f>(0, 0)[1] = float(++calls);
    });
    EXPECT_THAT(problem(check(effectOf(gainSource, wrong))), HasSubstr("two runs gave different color"));
}

TEST_F(Check, aShaderThatDoesNotCompileIsAProblemOfItsCases) {
    auto cases = check(effectOf(replaced(gainSource, "c.rgb * gain", "c.rgb * gian"), gainPlugin()));
    EXPECT_EQ(failures(cases), cases.size());
    EXPECT_THAT(problem(cases), HasSubstr("gian"));
}

TEST_F(Check, aPluginThatThrowsIsAProblemOfItsCases) {
    auto wrong = gainPlugin().rows(
        [](const Gain&, const CpuContext&, cv::Range) { throw std::runtime_error("oh no"); });
    EXPECT_THAT(problem(check(effectOf(gainSource, wrong))), HasSubstr("oh no"));
}

TEST_F(Check, allowanceExcusesWhatTheReferenceCannotKnowAndNoMore) {
    for (double allowance : {2., .5}) {  // in units of the halves' difference
        static double allowed;
        allowed = 1e-3 * allowance;
        auto loose = gainPlugin()
                         .rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
                             gainRows(p, c, rows);
                             for (int j = rows.start; j < rows.end; j++)
                                 outputOf(c).at<cv::Vec4f>(j, 0)[3] += 1e-3f;
                         })
                         .reference([](const Gain& p, const ReferenceContext& c, cv::Point at) {
                             ReferencePixel truth = gainReference(p, c, at);
                             truth.allowance = allowed;
                             return truth;
                         });
        EXPECT_EQ(failures(check(effectOf(gainSource, loose))) == 0, allowance > 1);
    }
}

TEST_F(Check, ambiguousPixelsAreLeftOutButNotManyOfThem) {
    static int every;
    auto jumpy = gainPlugin()
                     .rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
                         gainRows(p, c, rows);
                         for (int j = rows.start; j < rows.end; j++)
                             for (int i = 0; i < c.output.cols; i++)
                                 if ((j * 64 + i) % every == every - 1)
                                     outputOf(c).at<cv::Vec4f>(j, i)[3] += 1;
                     })
                     .reference([](const Gain& p, const ReferenceContext& c, cv::Point at) {
                         ReferencePixel truth = gainReference(p, c, at);
                         truth.ambiguous = (at.y * 64 + at.x) % every == every - 1;
                         return truth;
                     });
    every = 3000;  // one pixel, of the largest frames
    auto few = check(effectOf(gainSource, jumpy));
    EXPECT_EQ(failures(few), 0u) << problem(few);
    size_t leftOut = 0;
    for (const CheckCase& c : few) leftOut += c.parity.leftOut;
    EXPECT_GT(leftOut, 0u);
    every = 100;
    auto many = check(effectOf(gainSource, jumpy));
    EXPECT_EQ(failures(many), 1u);
    EXPECT_THAT(many.back().problem, HasSubstr("left out as ambiguous"));
}

TEST_F(Check, manyAmbiguousPixelsAreTooManyEvenWhereTheHalvesAgree) {
    static int every;
    auto unsure = gainPlugin().reference([](const Gain& p, const ReferenceContext& c, cv::Point at) {
        ReferencePixel truth = gainReference(p, c, at);
        truth.ambiguous = (at.y * 64 + at.x) % every == every - 1;
        return truth;
    });
    every = 200;  // .5 % of those asked about, .04 % of all
    auto many = check(effectOf(gainSource, unsure));
    EXPECT_EQ(failures(many), 1u);
    EXPECT_THAT(many.back().problem, HasSubstr("left out as ambiguous"));
}

// What is allowed of an HDR colour says nothing about transmittance.
TEST_F(Check, transmittanceHasBoundsOfItsOwn) {
    static double allowed;
    auto off = gainPlugin()
                   .rows([](const Gain& p, const CpuContext& c, cv::Range rows) {
                       gainRows(p, c, rows);
                       cv::Mat transmittance = c.transmittance;
                       for (int j = rows.start; j < rows.end && !transmittance.empty(); j++)
                           for (int i = 0; i < transmittance.cols; i++)
                               transmittance.at<cv::Vec4f>(j, i)[0] += 1e-3f;
                   })
                   .reference([](const Gain& p, const ReferenceContext& c, cv::Point at) {
                       ReferencePixel truth = gainReference(p, c, at);
                       truth.scale = 1e6, truth.allowance = truth.methodError = 1;
                       truth.transmittanceAllowance = allowed;
                       return truth;
                   });
    for (double allowance : {.5e-3, 2e-3}) {
        allowed = allowance;
        EXPECT_EQ(failures(check(effectOf(gainSource, off))) == 0, allowance > 1e-3);
    }
}

TEST_F(Check, aFailureLeavesItsImages) {
    namespace fs = std::filesystem;
    CheckOptions options;
    options.artefacts = testing::TempDir() + "/brume-check-test";
    fs::remove_all(options.artefacts);
    auto cases =
        check(effectOf(replaced(gainSource, "c.rgb * gain", "c.rgb * gain * 1.01"), gainPlugin()), options);
    auto failed = std::find_if(cases.begin(), cases.end(), [](auto& c) { return !c.artefacts.empty(); });
    ASSERT_NE(failed, cases.end());
    for (const char* name : {"cpu.exr", "gl.exr", "difference.exr", "reference.exr", "preset.json"})
        EXPECT_TRUE(fs::exists(fs::path(failed->artefacts) / name)) << name;
    fs::remove_all(options.artefacts);
    check(effectOf(gainSource, gainPlugin()), options);
    EXPECT_FALSE(fs::exists(options.artefacts)) << "a passing check writes nothing";
}

TEST_F(Check, aSecondImageIsAnother) {
    struct Two {};
    const std::string source = R"(/*{
        "ISFVSN": "2", "SPACE": "linear",
        "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}, {"NAME": "second", "TYPE": "image"}]
    }*/
    #include "kit/image.glsl"
    void main() { store(fetch(inputImage, pixel()) - fetch(second, pixel())); })";
    auto subtract = [](const Two&, const CpuContext& c) {
        cv::Mat out = c.output;
        for (int j = 0; j < out.rows; j++)
            for (int i = 0; i < out.cols; i++)
                out.at<cv::Vec4f>(j, i) = c.input.at<cv::Vec4f>(j, i) - c.image("second").at<cv::Vec4f>(j, i);
    };
    auto cases = check(effectOf(source, EffectOf<Two>().run(subtract)));
    EXPECT_EQ(failures(cases), 0u) << problem(cases);
    // If both images were the same, all would be 0 and nothing tested.
    auto ignoring = [](const Two&, const CpuContext& c) { outputOf(c).setTo(0); };
    EXPECT_GT(failures(check(effectOf(source, EffectOf<Two>().run(ignoring)))), 0u);
}

TEST_F(Check, mirrorIsExactOnBothBackends) {
    auto cases = check(mirrorEffect());
    EXPECT_EQ(failures(cases), 0u);
    for (const CheckCase& c : cases) EXPECT_EQ(c.parity.worst, 0) << c.frame << ": " << c.parity.describe();
}

TEST_F(Check, aRunThatFailedDoesNotSpoilTheNext) {
    Step step;
    step.effect = mirrorEffect();
    step.id = "mirror";
    Chain broken, sound;
    broken.steps = {step};  // no values at all
    step.values = defaultValues(step.effect->header.parameters);
    sound.steps = {step};
    FramePair frame = checkFrames()[0].frame;
    cv::Mat expected = mirrored(frame.color);
    for (int k = 0; k < 3; k++) {
        EXPECT_ANY_THROW(gl().run(broken, frame, {}));
        EXPECT_TRUE(compareImages(gl().run(sound, frame, {}).images["color"], expected, 0, 0).passed);
    }
}

TEST_F(Check, glslOnlyIsCheckedForNanAndResolution) {
    const std::string head = R"(/*{"ISFVSN": "2", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}]}*/
    void main() {)";
    auto scene = check(glslOnly(head + "gl_FragColor = IMG_THIS_NORM_PIXEL(inputImage) * 0.5; }"));
    EXPECT_EQ(failures(scene), 0u) << problem(scene);
    auto grid = check(
        glslOnly(head + "gl_FragColor = vec4(vec3(mod(gl_FragCoord.x, 16.0) < 8.0 ? 1.0 : 0.0), 1.0); }"));
    EXPECT_THAT(problem(grid), HasSubstr("twice the resolution"));
    auto transition = check(glslOnly(R"(/*{"ISFVSN": "2", "INPUTS": [{"NAME": "startImage", "TYPE": "image"},
            {"NAME": "endImage", "TYPE": "image"}, {"NAME": "progress", "TYPE": "float"}]}*/
    void main() { gl_FragColor = mix(IMG_THIS_PIXEL(startImage), IMG_THIS_PIXEL(endImage), progress); })"));
    EXPECT_EQ(failures(transition), 0u) << problem(transition);
    auto nan =
        check(glslOnly(head + "gl_FragColor = vec4(sqrt(-1.0 - IMG_THIS_NORM_PIXEL(inputImage).a)); }"));
    EXPECT_THAT(problem(nan), HasSubstr("NaN"));
}

}  // namespace
