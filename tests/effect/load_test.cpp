#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "effect/effect.hpp"
#include "error.hpp"

using namespace brume;

static const EffectRegistry& fixtures() {
    static const EffectRegistry registry({BRUME_BINARY_DIR "/tests/effects"});
    return registry;
}

static std::string refusal(const std::string& name) {
    try {
        fixtures().find(name);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::Usage);
        return error.what();
    }
    return "loaded";
}
static bool has(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

TEST(Load, RefusesABrokenPluginWithASentence) {
    EXPECT_TRUE(has(refusal("binds_too_few"), "does not bind 'gain'"));
    EXPECT_TRUE(has(refusal("binds_too_many"), "binds 'gian', which")) << refusal("binds_too_many");
    EXPECT_TRUE(has(refusal("binds_too_many"), "did you mean 'gain'"));
    EXPECT_TRUE(has(refusal("binds_wrong_type"), "needs float"));
    EXPECT_TRUE(has(refusal("derives_nothing"), "no derive function for 'twice'"));
    EXPECT_TRUE(has(refusal("no_rows"), "must offer rows"));
    EXPECT_TRUE(has(refusal("wrong_interface"), "interface 999"));
    EXPECT_TRUE(has(refusal("no_symbol"), "exports no brume_plugin"));
    EXPECT_TRUE(has(refusal("contrakt"), "did you mean 'contract'"));
    EXPECT_EQ(fixtures().refused().size(), 7u);
}

TEST(Load, ARefusedPluginIsRefusedAgain) { EXPECT_EQ(refusal("no_rows"), refusal("no_rows")); }

TEST(Load, BindsEveryPartOfTheContract) {
    auto effect = fixtures().find("contract");
    EXPECT_TRUE(effect->plugin->hasRun() && effect->plugin->hasReference() && !effect->plugin->hasPlan());
    EXPECT_EQ(effect->header.parameters.size(), 9u);
    EXPECT_EQ(fixtures().find("contract"), effect) << "loaded once";
}

TEST(Load, APathLoadsAFreshCopy) {
    auto path = fixtures().find("contract")->header.path;
    auto again = fixtures().find(path);
    EXPECT_NE(again, fixtures().find("contract"));
    EXPECT_EQ(again->name(), "contract");
}

TEST(Load, ExpandsIncludesWithLines) {
    auto source = expandIncludes(*fixtures().find("halve"));
    EXPECT_EQ(source.files.size(), 2u);
    EXPECT_TRUE(has(source.files[0], "halve.fs") && has(source.files[1], "kit/image.glsl"));
    EXPECT_TRUE(has(source.text, "#line 6 0\n"));
    EXPECT_TRUE(has(source.text, "#line 1 1\n"));
    EXPECT_TRUE(has(source.text, "#line 8 0\n\nvoid main()")) << source.text;
    EXPECT_FALSE(has(source.text, "#include"));
}

TEST(Load, ShippedEffectsAllLoad) {
    for (const auto& [name, reason] : EffectRegistry::standard().refused())
        ADD_FAILURE() << name << ": " << reason;
    EXPECT_GE(EffectRegistry::standard().names().size(), 3u);
}
