// Every input that fuzzing kept or found goes through what it once broke: it is read, or refused by a
// sentence.
#include <functional>

#include "effect/header.hpp"
#include "effect/preset.hpp"
#include "effect/size_expression.hpp"
#include "frame/depth_encoding.hpp"
#include "frame/read.hpp"
#include "frame/sidecar.hpp"
#include "frame_fixture.hpp"

namespace brume {
namespace {

namespace fs = std::filesystem;

struct Case {
    const char* target;
    std::function<void(const std::string& path, const std::string& content)> read;
};

std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.target; }

class Corpus : public testing::TestWithParam<Case> {};

TEST_P(Corpus, IsReadOrRefused) {
    const fs::path folder = fs::path(BRUME_SOURCE_DIR) / "tests/fuzz/corpus" / GetParam().target;
    int seen = 0;
    for (const auto& entry : fs::directory_iterator(folder)) {
        std::ifstream in(entry.path(), std::ios::binary);
        const std::string content((std::istreambuf_iterator<char>(in)), {});
        SCOPED_TRACE(entry.path().filename());
        try {
            GetParam().read(entry.path(), content);
        } catch (const Error& e) {
            EXPECT_STRNE(e.what(), "");
        }
        ++seen;
    }
    EXPECT_GT(seen, 0) << folder;
}

const ReadOptions small = [] {
    ReadOptions options;
    options.maxPixels = 1 << 18;
    return options;
}();

INSTANTIATE_TEST_SUITE_P(
    All, Corpus,
    testing::Values(
        Case{"exr", [](const std::string& path, const std::string&) { readFrame(path, small); }},
        Case{"image",
             [](const std::string& path, const std::string&) {
                 ReadOptions options = small;
                 options.depth = path;
                 options.encoding = parseDepthEncoding("linear:scale_to_metres=.001,unknown=0");
                 readFrame(path, options);
             }},
        Case{"reader", [](const std::string& path, const std::string&) { readImage(path, 1 << 18); }},
        Case{"header",
             [](const std::string&, const std::string& content) {
                 const EffectHeader header = parseHeader("fuzz.fs", content);
                 expressionVariables(header, defaultValues(header.parameters));
             }},
        Case{"preset",
             [](const std::string&, const std::string& content) {
                 static const EffectRegistry registry({BRUME_SOURCE_DIR "/tests/fuzz/effects"});
                 parsePreset(content, "fuzz.json", registry);
             }},
        Case{"sidecar",
             [](const std::string& path, const std::string& content) {
                 const std::string stem = testing::TempDir() + "brume-corpus-" + std::to_string(getpid());
                 fs::copy_file(path, stem + ".json", fs::copy_options::overwrite_existing);
                 try {
                     readSidecar(stem + ".png").camera({640, 480});
                 } catch (const Error&) {
                 }
                 fs::remove(stem + ".json");
                 parseDepthEncoding(content);
             }},
        Case{"expression",
             [](const std::string&, const std::string& content) {
                 const SizeExpression expression(content);
                 if (!expression.empty())
                     expression.evaluate({{"WIDTH", 640}, {"HEIGHT", 480}, {"radius", 2.5}, {"zero", 0}});
             }}),
    [](const auto& info) { return std::string(info.param.target); });

}  // namespace
}  // namespace brume
