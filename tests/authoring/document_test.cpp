// docs/AUTHORING.md does what it says: its commands are run and its changes made, in its order, as a newcomer
// would, in an empty home.
#include <filesystem>
#include <fstream>
#include <regex>

#include "host/program.hpp"

namespace fs = std::filesystem;

namespace brume::test {
namespace {

struct Block {
    std::string kind, text;
    int line = 0;
};

// The fenced blocks, in order; `kind` is what follows the opening fence.
std::vector<Block> blocksOf(const std::string& document) {
    std::vector<Block> blocks;
    std::stringstream lines(document);
    bool isInside = false;
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
        number++;
        if (line.rfind("```", 0) == 0) {
            isInside = !isInside;
            if (isInside) blocks.push_back({line.substr(3), "", number});
        } else if (isInside) {
            blocks.back().text += line + "\n";
        }
    }
    return blocks;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    return text;
}

// A line of the document, in which … stands for anything.
std::regex patternOf(const std::string& line) {
    static const std::regex special(R"([.^$|()\[\]{}*+?\\])");
    return std::regex("(^|\n)" + replaced(std::regex_replace(line, special, "\\$&"), "…", ".*") + "(\n|$)");
}

class Document : public Program {
  protected:
    // Each block's output goes to a file beside the folder, named by its line in the document.
    std::string outputOf(const Block& block) const { return folder_ + ".line" + std::to_string(block.line); }

    std::string scriptOf(const std::vector<Block>& blocks) const {
        std::string script = "set -e\nexport HOME='" + folder_ +
                             "' CMAKE_GENERATOR=Ninja CCACHE_NOHASHDIR=1 CCACHE_BASEDIR='" +
                             testing::TempDir() +
                             "'\nunset XDG_DATA_HOME BRUME_EFFECT_PATH CMAKE_PREFIX_PATH\n"
                             "! command -v ccache >/dev/null || export CMAKE_CXX_COMPILER_LAUNCHER=ccache\n";
        for (const Block& block : blocks) {
            const std::string into = "{\n" + block.text + "} >'" + outputOf(block) + "' 2>&1";
            script += "echo 'line " + std::to_string(block.line) + "' >&2\n";
            if (block.kind == "sh install")
                script += replaced(into, "build/release", "'" BRUME_BINARY_DIR "'") + "\n";
            else if (block.kind == "sh")
                script += into + "\n";
            else if (block.kind == "sh fails")
                script += "if " + into + "; then echo 'it should have failed' >&2; exit 1; fi\n";
            else if (block.kind == "diff")
                script += "patch -p1 <<'END OF CHANGES'\n" + block.text + "END OF CHANGES\n";
        }
        return script;
    }
};

TEST_F(Document, EveryStepOfAuthoringWorks) {
    const auto blocks = blocksOf(bytesOf(BRUME_SOURCE_DIR "/docs/AUTHORING.md"));
    ASSERT_GE(blocks.size(), 15u);
    for (const Block& block : blocks)
        EXPECT_THAT((std::set<std::string>{"sh", "sh install", "sh fails", "diff", "text"}),
                    testing::Contains(block.kind))
            << "line " << block.line << ": not run by this test";
    addFrame("frame.exr");
    addText("steps.sh", scriptOf(blocks));
    const Ran ran = run(folder_, "bash steps.sh");
    std::string last;
    const Block* command = nullptr;
    for (const Block& block : blocks) {
        if (block.kind.rfind("sh", 0) == 0) {
            command = &block;
            if (fs::exists(outputOf(block))) last = bytesOf(outputOf(block));
            fs::remove(outputOf(block));
        }
        if (ran.status != 0 || block.kind != "text") continue;
        ASSERT_NE(command, nullptr);
        std::stringstream lines(block.text);
        for (std::string line; std::getline(lines, line);)
            EXPECT_TRUE(std::regex_search(last, patternOf(line)))
                << "line " << command->line << " should print: " << line << "\nbut printed: " << last;
    }
    ASSERT_EQ(ran.status, 0) << ran.err << ran.out << last;
    for (const char* picture : {"mist.png", "fog.png"})
        EXPECT_TRUE(fs::exists(path(std::string("morning_mist/") + picture)));
    EXPECT_NE(bytesOf(path("morning_mist/mist.png")), bytesOf(path("morning_mist/fog.png")));
    for (const char* file : {"index.html", "morning_mist.csv", "morning_mist.svg"})
        EXPECT_TRUE(fs::exists(path(std::string("morning_mist/chart/") + file)));
}

}  // namespace
}  // namespace brume::test
