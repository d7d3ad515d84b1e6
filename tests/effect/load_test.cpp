#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "cpu/cpu_runner.hpp"
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

// What a plugin's CPU half makes of a grey of 1.
static float brightened(const std::shared_ptr<const Effect>& effect) {
    FramePair frame;
    frame.color = cv::Mat(1, 1, CV_32FC4, cv::Scalar::all(1));
    frame.depth = cv::Mat(1, 1, CV_32F, cv::Scalar(1));
    frame.camera = Camera::withHorizontalView({1, 1}, 60);
    Chain chain;
    chain.steps.resize(1);
    chain.steps[0].effect = effect;
    return makeCpuRunner()->run(chain, frame, {}).images["color"].at<cv::Vec4f>(0, 0)[0];
}

TEST(Load, ARebuiltPluginRunsItsNewCode) {
    namespace fs = std::filesystem;
    const fs::path folder = testing::TempDir() + "brume-rebuilt";
    fs::create_directories(folder);
    auto build = [&](const char* variant) {
        const fs::path from = fs::path(BRUME_BINARY_DIR "/tests/effects") / variant / variant;
        for (const char* ending : {".fs", ".so"})
            fs::copy_file(from.string() + ending, folder / (std::string("rebuilt") + ending),
                          fs::copy_options::overwrite_existing);
    };
    build("variant_a");
    auto before = fixtures().find(folder.string() + "/rebuilt.fs");
    EXPECT_EQ(brightened(before), 2);
    build("variant_b");
    auto after = fixtures().find(folder.string());
    EXPECT_EQ(brightened(after), 3);
    EXPECT_EQ(brightened(before), 2) << "who holds the old one still runs it";
    fs::remove_all(folder);
}

TEST(Load, AFolderMeansItsEffect) {
    namespace fs = std::filesystem;
    const fs::path folder = testing::TempDir() + "brume-folder";
    fs::create_directories(folder);
    auto refusalOf = [&] { return refusal(folder.string()); };
    EXPECT_TRUE(has(refusalOf(), "holds no .fs file"));
    std::ofstream(folder / "one.fs") << "/*{}*/ void main() {}";
    EXPECT_EQ(fixtures().find(folder.string())->name(), "one");
    std::ofstream(folder / "other.fs") << "/*{}*/ void main() {}";
    EXPECT_TRUE(has(refusalOf(), "holds 2 .fs files; name one, such as " + folder.string() + "/one.fs"));
    std::ofstream(folder / "brume-folder.fs") << "/*{}*/ void main() {}";
    EXPECT_EQ(fixtures().find(folder.string() + "/")->name(), "brume-folder");
    EXPECT_TRUE(has(refusal("./nowhere/x.fs"), "no such effect file or folder"));
    fs::remove_all(folder);
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
