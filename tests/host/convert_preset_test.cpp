// brume convert-preset: ReShade presets.
#include <cmath>
#include <nlohmann/json.hpp>

#include "cpu/cpu_runner.hpp"
#include "effect/preset.hpp"
#include "error.hpp"
#include "frame/color_encoding.hpp"
#include "host/program.hpp"

using testing::HasSubstr;
using ConvertPreset = brume::test::Program;

namespace brume {
namespace {

const char* foggy =
    "\xEF\xBB\xBF; made on a rainy day\r\n"
    "PreprocessorDefinitions=RESHADE_DEPTH_LINEARIZATION_FAR_PLANE=500.0,RESHADE_DEPTH_INPUT_IS_REVERSED="
    "1\r\n"
    "Techniques=SMAA,Bessel_Bloom@Bessel_Bloom.fx,AdaptiveFog\r\n"
    "TechniqueSorting=AdaptiveFog,Vignette,Bessel_Bloom@Bessel_Bloom.fx,SMAA\r\n"
    "\r\n"
    "[AdaptiveFog.fx]\r\n"
    "BloomPower=10.000000\r\n"
    "// what the fog looks like\r\n"
    "FogColor=0.500000,0.600000,0.700000\r\n"
    "FogCurve=4.000000\r\n"
    "FogStart = 0.002000\r\n"
    "MaxFogFactor=0.900000\r\n"
    "\r\n"
    "[Bessel_Bloom.fx]\r\n"
    "# half the radius\r\n"
    "Debug=0\r\n"
    "Performance=1\r\n"
    "K=96.000000\r\n"
    "SoftKnee=0.250000\r\n"
    "Threshold=0.800000\r\n"
    "Intensity=1.500000\r\n"
    "[Vignette.fx]\r\n"
    "Amount=1.0,,0\r\n"
    "Center=0.5,0.5\r\n";

nlohmann::json presetOf(const std::string& text) { return nlohmann::json::parse(text, nullptr, true, true); }

TEST_F(ConvertPreset, StepsComeInTheirOrderAndWhatIsLostIsListed) {
    addText("foggy.ini", foggy);
    auto ran = brume("convert-preset foggy.ini -o foggy.json");
    ASSERT_EQ(ran.status, 0) << ran.err;
    const auto preset = presetOf(test::bytesOf(path("foggy.json")));
    const auto& steps = preset["effects"];
    ASSERT_EQ(steps.size(), 4u) << preset.dump(1);
    EXPECT_EQ(steps[0]["effect"], "depth_fog");  // by TechniqueSorting, not by Techniques
    EXPECT_NEAR(steps[0]["start"].get<double>(), 1 + .002 * 499, 1e-5);
    EXPECT_NEAR(steps[0]["power_distance"].get<double>(), 499 / 4., 1e-3);
    EXPECT_NEAR(steps[0]["max_opacity"].get<double>(), .81, 1e-6);
    EXPECT_NEAR(steps[0]["color"][2].get<double>(), srgbDecode(.7), 1e-6);
    EXPECT_EQ(steps[1]["effect"], "light_detect");
    EXPECT_NEAR(steps[1]["knee"].get<double>(), .2, 1e-6);
    EXPECT_EQ(steps[1]["intensity"], 1.5);
    EXPECT_EQ(steps[1]["saturation"], 1);  // the effect's own default
    EXPECT_NEAR(steps[2]["radius"].get<double>(), std::sqrt(2. / 3) * 96 / 2 / 2, 1e-4);
    EXPECT_EQ(steps[3]["effect"], "blend");
    for (const char* lost : {"the technique SMAA", "[AdaptiveFog.fx] BloomPower=10.000000",
                             "[Bessel_Bloom.fx] Debug=0", "[Vignette.fx], of no technique that is on: 2 keys",
                             "RESHADE_DEPTH_INPUT_IS_REVERSED=1", "bloom of the picture"})
        EXPECT_THAT(ran.out, HasSubstr(std::string(lost))) << ran.out;
    EXPECT_THAT(test::bytesOf(path("foggy.json")), HasSubstr("// Not carried: [Bessel_Bloom.fx] Debug=0"));
    EXPECT_THAT(ran.out, HasSubstr("for the preset's far plane at 500, taken for metres"));
    for (const char* carried : {"FogStart", "K=", "Performance", "FAR_PLANE", "rainy"})
        EXPECT_THAT(ran.out, testing::Not(HasSubstr(carried)));
    // Without -o the preset alone is printed, fit for a file.
    EXPECT_EQ(brume("convert-preset foggy.ini").out, test::bytesOf(path("foggy.json")));
    addFrame("a.exr");
    EXPECT_EQ(brume("apply foggy.json a.exr -o a.png").status, 0);
}

TEST_F(ConvertPreset, SaysWhichFarPlaneItsDistancesAreFor) {
    addText("plain.ini", "Techniques=SpiritFog\n[SpiritFog.fx]\nFogStart=0.1\n");
    auto ran = brume("convert-preset plain.ini -o plain.json");
    ASSERT_EQ(ran.status, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("far plane at 1000 m, ReShade's default"));
    EXPECT_EQ(presetOf(test::bytesOf(path("plain.json")))["effects"][0]["far"], 1000);
    ran = brume("convert-preset plain.ini --far 250");
    EXPECT_THAT(ran.out, HasSubstr("// Its distances are for a far plane at 250 m"));
    EXPECT_EQ(presetOf(ran.out)["effects"][0]["far"], 250);
    addText("foggy.ini", foggy);
    ran = brume("convert-preset foggy.ini --far 250");  // over what the preset defines
    EXPECT_NEAR(presetOf(ran.out)["effects"][0]["power_distance"].get<double>(), 249 / 4., 1e-3);
    expectError("convert-preset plain.ini --far 0", 2, "--far");
}

// AdaptiveFog and Spirit Fog as their formulas say, in display values, on ReShade's linear depth.
TEST_F(ConvertPreset, FogIsWhatTheFormulaSays) {
    const FramePair frame = test::sampleFrame();
    for (bool isAdaptive : {true, false}) {
        const std::string name = isAdaptive ? "AdaptiveFog" : "Spirit-Fog";
        addText("fog.ini", "Techniques=" + name + "\n[" + name +
                               ".fx]\nFogStart=0.01\nFogCurve=30\nMaxFogFactor=0.7\nFogColor=0.9,0.8,0.7\n");
        ASSERT_EQ(brume("convert-preset fog.ini -o fog.json").status, 0);
        const Chain chain = readPreset(path("fog.json"), EffectRegistry::standard());
        const cv::Mat out = makeCpuRunner()->run(chain, frame, {}).images.at("color");
        const double fog[] = {.9, .8, .7};
        double worst = 0;
        for (int j = 0; j < out.rows; j++)
            for (int i = 0; i < out.cols; i++) {
                const double z = frame.depth.at<float>(j, i);
                const double depth = std::isinf(z) ? 1 : std::clamp((z - 1) / 999, 0., 1.);
                double f = std::min(std::clamp(depth - .01, 0., 1.) * 30, .7);
                if (isAdaptive) f *= f;  // lerp(scene, lerp(scene, fog, f), f)
                for (int c = 0; c < 3; c++) {
                    const double scene = srgbEncode(frame.color.at<cv::Vec4f>(j, i)[c]);
                    worst = std::max(worst, std::abs(srgbEncode(out.at<cv::Vec4f>(j, i)[c]) -
                                                     (scene * (1 - f) + fog[c] * f)));
                }
            }
        EXPECT_LT(worst, 2e-6) << name;  // 2.7e-7 measured; the preset's six digits allow 1e-6
    }
}

// Whatever a stranger's preset holds, what is written is a preset.
TEST_F(ConvertPreset, NamesAndValuesStayWithinTheirComments) {
    const std::string ini = "Techniques=SpiritFog\n[SpiritFog.fx]\nFogStart=0.1\n";
    const std::string ends = "A=1\r{\"effects\": [{\"effect\": \"blend\"}]}\rB=\x1b[31m\n";
    for (const std::string name : {"plain.ini", "two\nlines.ini", "no\xffutf8.ini"}) {
        addText(name, ini + ends);
        const auto ran = brume("convert-preset '" + name + "' -o made.json");
        ASSERT_EQ(ran.status, 0) << ran.err;
        EXPECT_THAT(test::bytesOf(path("made.json")), HasSubstr("A=1\\x0d{\"effects\"")) << name;
        EXPECT_EQ(readPreset(path("made.json"), EffectRegistry::standard()).steps.size(), 1u) << name;
    }
}

TEST_F(ConvertPreset, ALongListOfWhatIsLostDoesNotMakeThePresetTooLong) {
    std::string keys, sections;
    for (int k = 0; k < 200'000; k++) {
        keys += text("key", k, "=1\n");
        sections += text("[", k, "]\na=1\n");
    }
    std::string control;
    for (int k = 0; k < 1000; k++) control += text("key", k, "=", std::string(3000, 1), "\n");
    for (const std::string& rest : {keys, sections, control, "key=" + std::string(4'000'000, 'x')}) {
        addText("long.ini", "Techniques=SpiritFog\n[SpiritFog.fx]\n" + rest);
        const auto ran = brume("convert-preset long.ini -o long.json");
        ASSERT_EQ(ran.status, 0) << ran.err;
        EXPECT_EQ(readPreset(path("long.json"), EffectRegistry::standard()).steps.size(), 1u);
    }
    addText("long.ini", "Techniques=SpiritFog\n[SpiritFog.fx]\n" + keys);
    EXPECT_THAT(brume("convert-preset long.ini").out, HasSubstr("// Not carried: 199000 more\n"));
}

TEST_F(ConvertPreset, MistakesAreNamed) {
    expectError("convert-preset none.ini", 3, "none.ini: there is no such file");
    addText("plain.ini", "[GENERAL]\nA=1\n");
    expectError("convert-preset plain.ini", 2, "no line 'Techniques='");
    addText("other.ini", "Techniques=SMAA,FilmGrain\n");
    expectError("convert-preset other.ini", 2, "it knows AdaptiveFog, SpiritFog, Bessel_Bloom");
    for (const char* value : {"much", "1,2", "", "nan", "0.5x"}) {
        addText("bad.ini",
                std::string("Techniques=AdaptiveFog\n[AdaptiveFog.fx]\n; none\nFogStart=") + value + "\n");
        expectError("convert-preset bad.ini", 2,
                    "bad.ini:4: FogStart=" + std::string(value) + " is not a number");
    }
    addText("bad.ini", "Techniques=AdaptiveFog\n[AdaptiveFog.fx]\nFogColor=1,2\n");
    expectError("convert-preset bad.ini", 2, "bad.ini:3: FogColor=1,2 is not 3 numbers");
    addText("bad.ini", "Techniques=SpiritFog\n[SpiritFog.fx]\nFogStart=7\n");
    expectError("convert-preset bad.ini", 2, "linear_start");
    addText("fog.ini", "Techniques=SpiritFog\n");
    expectError("convert-preset fog.ini -o fog.ini", 2, "would overwrite");
    expectError("convert-preset fog.ini -o none/fog.json", 3, "the folder none does not exist");
}

}  // namespace
}  // namespace brume
