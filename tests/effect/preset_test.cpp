#include "effect/preset.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "error.hpp"

using namespace brume;

static const EffectRegistry& fixtures() {
    static const EffectRegistry registry({BRUME_BINARY_DIR "/tests/effects"});
    return registry;
}
static Chain parse(const std::string& text) { return parsePreset(text, "my.json", fixtures()); }
static std::string mistake(const std::string& text) {
    try {
        parse(text);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::Usage);
        return error.what();
    }
    return "accepted";
}
static bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

static const char* twoSteps = R"({ // comments
    "name": "Two", "description": "d", "sky": 500, "unknown": "keep",
    "effects": [
      {"effect": "halve", "output": "small"},
      {"effect": "contract", "input": "small", "output": "lit", "gain": 1.25, "lamps": [{"range": 3}]},
      {"effect": "contract", "enabled": false}
    ]})";

TEST(Preset, RoutesImagesAndNamesSteps) {
    Chain chain = parse(twoSteps);
    ASSERT_EQ(chain.steps.size(), 3u);
    EXPECT_EQ(chain.steps[0].output, "small");
    EXPECT_EQ(chain.steps[1].imageOf("inputImage"), "small");
    EXPECT_EQ(chain.steps[1].id, "contract");
    EXPECT_EQ(chain.steps[2].id, "contract2");
    EXPECT_FALSE(chain.steps[2].enabled);
    EXPECT_EQ(chain.policy.sky, SkyPolicy::AtDistance);
    EXPECT_EQ(chain.policy.skyDistance, 500);
    EXPECT_EQ(chain.policy.unknown, UnknownDepth::Keep);
    EXPECT_EQ(chain.steps[1].values.at("lamps").rows[0].at("range").numbers[0], 3);
    EXPECT_FALSE(chain.readsTransmittance({}));
    EXPECT_TRUE(chain.readsTransmittance({"transmittance"}));
}

TEST(Preset, WritesWhatItReads) {
    Chain chain = parse(twoSteps);
    std::string written = writePreset(chain);
    Chain again = parse(written);
    EXPECT_EQ(writePreset(again), written);
    ASSERT_EQ(again.steps.size(), chain.steps.size());
    for (size_t k = 0; k < chain.steps.size(); k++) {
        EXPECT_EQ(again.steps[k].values, chain.steps[k].values);
        EXPECT_EQ(again.steps[k].given, chain.steps[k].given);
        EXPECT_EQ(again.steps[k].input + again.steps[k].output, chain.steps[k].input + chain.steps[k].output);
    }
}

TEST(Preset, NamesWhatIsWrong) {
    auto step = [](const std::string& rest) { return R"({"effects": [{"effect": )" + rest + "}]}"; };
    EXPECT_TRUE(
        has(mistake(step(R"("halv")")), "my.json: effects[0]: no effect 'halv' (did you mean 'halve'?)"));
    EXPECT_TRUE(has(mistake(step(R"("contract", "gian": 1)")), "no parameter 'gian' (did you mean 'gain'?)"));
    EXPECT_TRUE(has(mistake(step(R"("contract", "gain": 3)")), "contract.gain: 3 is out of range"));
    EXPECT_TRUE(has(mistake(step(R"("halve", "input": "smal")")), "reads the image 'smal'"));
    EXPECT_TRUE(has(mistake(step(R"("halve", "output": "captured")")), "cannot write 'captured'"));
    EXPECT_TRUE(has(mistake(R"({"efects": []})"), "unknown key 'efects' (did you mean 'effects'?)"));
    EXPECT_TRUE(has(mistake(R"({"effects": [], "sky": -1})"), "positive number"));
    EXPECT_TRUE(has(mistake(R"({"effects": [], "unknown": "fil"})"), "did you mean 'fill'"));
    EXPECT_TRUE(has(mistake("{\n\n\"effects\": [}"), "my.json:3: not JSON"));
    EXPECT_TRUE(has(mistake("[]"), "a preset is an object"));
    EXPECT_TRUE(
        has(mistake(R"({"effects": [{"effect": "halve", "id": "a"}, {"effect": "halve", "id": "a"}]})"),
            "two effects have the id 'a'"));
}

TEST(Preset, SetChangesOneValue) {
    Chain chain = parse(twoSteps);
    setParameter(chain, "contract.gain", "0.75");
    setParameter(chain, "contract.lamps[0].color", "(1,2,3)");
    setParameter(chain, "contract2.method", "compute");
    EXPECT_EQ(chain.steps[1].values.at("gain").numbers[0], .75);
    EXPECT_EQ(chain.steps[1].values.at("lamps").rows[0].at("color").numbers, (std::vector<double>{1, 2, 3}));
    EXPECT_EQ(chain.steps[2].values.at("method").numbers[0], 1);
    auto mistakeOf = [&](const std::string& path, const std::string& value) -> std::string {
        try {
            setParameter(chain, path, value);
        } catch (const Error& error) {
            return error.what();
        }
        return "accepted";
    };
    EXPECT_TRUE(has(mistakeOf("contrct.gain", "1"), "did you mean 'contract'"));
    EXPECT_TRUE(has(mistakeOf("contract.gan", "1"), "did you mean 'gain'"));
    EXPECT_TRUE(has(mistakeOf("contract.lamps[1].range", "1"), "1 rows"));
    EXPECT_TRUE(has(mistakeOf("contract.lamps[99999999999999999999].range", "1"), "1 rows"));
    EXPECT_TRUE(has(mistakeOf("contract.gain[0].range", "1"), "is no list"));
    EXPECT_TRUE(has(mistakeOf("contract", "1"), "write effect.parameter=value"));
    EXPECT_TRUE(has(mistakeOf("gain", "1"), "did you mean 'contract.gain' or 'contract2.gain'?"));
    EXPECT_TRUE(has(mistakeOf("contract.gain", "7"), "out of range"));
}

TEST(Preset, ASidecarSuppliesWhatThePresetLeavesOut) {
    FramePair frame;
    frame.name = "shot";
    frame.extras = std::make_shared<nlohmann::json>(nlohmann::json::parse(
        R"({"lights": [{"type": "directional", "direction": [0, 1, 0]}, {"type": "point", "range": 7, "position": [1, 2, 3]}]})"));
    Chain bare = parse(R"({"effects": [{"effect": "contract"}]})");
    Chain lit = withSidecar(bare, frame);
    ASSERT_EQ(lit.steps[0].values.at("lamps").rows.size(), 1u);
    EXPECT_EQ(lit.steps[0].values.at("lamps").rows[0].at("range").numbers[0], 7);
    Chain own = parse(R"({"effects": [{"effect": "contract", "lamps": []}]})");
    EXPECT_TRUE(withSidecar(own, frame).steps[0].values.at("lamps").rows.empty());
}

TEST(Preset, ShippedPresetsAllParse) {
    EXPECT_GE(shippedPresets().size(), 10u);
    for (const auto& [name, path] : shippedPresets())
        EXPECT_NO_THROW(readPreset(name, EffectRegistry::standard())) << path;
}

TEST(Preset, AnEffectsNameIsAPreset) {
    Chain chain = readPreset("halve", fixtures());
    ASSERT_EQ(chain.steps.size(), 1u);
    EXPECT_THROW(readPreset("halv", fixtures()), Error);
    EXPECT_THROW(readPreset("no/such/preset.json", fixtures()), Error);
}
