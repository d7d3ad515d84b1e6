// What files that a stranger sent must not reach: a shell, a program, a link's other end, a browser's
// scripts, a spreadsheet's formulas, all memory.
#include <sys/stat.h>

#include <filesystem>

#include "program.hpp"

namespace brume::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class Strangers : public Program {
  protected:
    /// An effect file whose every word is that of a stranger.
    void addEffect(const std::string& name, const std::string& word, const std::string& more) {
        addText(name, R"(/*{"SPACE": "linear", "DESCRIPTION": ")" + word + R"(", "INPUTS": [
            {"NAME": "inputImage", "TYPE": "image"},
            {"NAME": "amount", "LABEL": ")" +
                          word + R"(", "UNIT": ")" + word + R"(", "TYPE": "float",
             "DEFAULT": 0.5, "MIN": 0, "MAX": 1}])" +
                          more + R"(}*/
            #include "kit/image.glsl"
            void main() { store(fetch(inputImage, pixel()) * amount); })");
    }
    static std::string charted(const std::string& word, const std::string& more) {
        return R"(, "CHART": {"CASES": [{"NAME": ")" + word +
               R"(", "SET": {"amount": 0.5}}], "METHODS": [{"NAME": ")" + word +
               R"(", "KNOB": "amount", "VALUES": [0.2, 0.4]}])" + more + "}";
    }
};

TEST_F(Strangers, chartsRunNoCommands) {
    // gnuplot runs what stands between backquotes, in double quotes too.
    const std::string word = "`touch ran` $(touch ran) ';touch ran;'";
    addEffect("`touch ran`'x.fs", word, charted(word, ""));
    const Ran ran =
        brume("chart './`touch ran`'\\''x.fs' -o 'charts`touch ran`' --size 64x48 --backend osmesa");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_FALSE(fs::exists(path("ran")));
    EXPECT_THAT(files(), testing::Contains(HasSubstr(".svg")));
}

TEST_F(Strangers, chartsRunNoProgramOfAnEffectThatIsNoPlugin) {
    addEffect("own.fs", "",
              charted("fast",
                      R"(, "REFERENCE": {"amount": 1}, "PEERS": [{"NAME": "theirs", "RUN": "theirs.sh"}])"));
    addText("theirs.sh", "#!/bin/sh\ntouch " + path("ran") + "\n");
    fs::permissions(path("theirs.sh"), fs::perms::owner_all);
    const Ran ran = brume("chart own.fs -o charts --size 64x48 --backend osmesa");
    EXPECT_FALSE(fs::exists(path("ran")));
    EXPECT_EQ(ran.status, 0) << ran.err;
}

TEST_F(Strangers, aPlainNameIsNoFolderHere) {
    addFrame("a.exr");
    fs::create_directories(path("mist"));
    addEffect("mist/mist.fs", "", "");
    addText("ran.cpp", "#include <fstream>\n[[gnu::constructor]] void run() { std::ofstream(\"ran\"); }\n");
    ASSERT_EQ(run(folder_, "c++ -shared -fPIC ran.cpp -o mist/mist.so").status, 0);
    for (const char* command : {"apply mist a.exr -o b.exr", "bench mist --frame a.exr", "check mist",
                                "chart mist -o charts", "info mist"})
        expectError(command, 2, "no effect 'mist'; for the folder of that name here, say ./mist");
    addText("p.json", R"({"effects": [{"effect": "mist"}]})");
    expectError("apply p.json a.exr -o b.exr", 2, "no effect 'mist' is known");
    EXPECT_FALSE(fs::exists(path("ran")));
    brume("info ./mist");
    EXPECT_TRUE(fs::exists(path("ran")));  // what is said to be meant is meant
    fs::remove(path("ran"));
    run(path("mist"), "BRUME info .");
    EXPECT_TRUE(fs::exists(path("mist/ran")));
}

TEST_F(Strangers, aPlainNameIsNoFileHere) {
    addFrame("a.exr");
    addText("indoor_haze", "no preset");
    const Ran ran = brume("apply indoor_haze a.exr -o b.exr");
    EXPECT_EQ(ran.status, 0) << ran.err;
    addText("mine", R"({"effects": []})");
    expectError("apply mine a.exr -o c.exr", 2,
                "no preset or effect 'mine'; for the file of that name here, say ./mine");
    EXPECT_EQ(brume("apply ./mine a.exr -o c.exr").status, 0);
}

TEST_F(Strangers, pagesHoldNoScriptsAndTablesNoFormulas) {
    addEffect("=1+1<script>.fs", "<script>alert(1)</script>", charted("=HYPERLINK(1)<script>", ""));
    const Ran ran = brume("chart './=1+1<script>.fs' -o charts --size 64x48 --backend osmesa");
    EXPECT_EQ(ran.status, 0) << ran.err;
    int pages = 0, tables = 0;
    for (const auto& file : fs::recursive_directory_iterator(path("charts"))) {
        const std::string ending = file.path().extension().string(), bytes = bytesOf(file.path().string());
        pages += ending == ".html";
        tables += ending == ".csv";
        if (ending == ".html" || ending == ".svg") {
            EXPECT_THAT(bytes, Not(HasSubstr("<script"))) << file.path();
        }
        if (ending != ".csv") continue;
        EXPECT_THAT(bytes, HasSubstr("'=1+1<script>"));
        EXPECT_THAT("\n" + bytes, Not(testing::ContainsRegex("[\n,\"]=")));
    }
    EXPECT_GT(pages, 0);
    EXPECT_GT(tables, 0);
}

TEST_F(Strangers, noFileOfARunFollowsALink) {
    for (int k = 0; k < 20; ++k) addFrame("in/" + std::to_string(k) + ".exr", {8, 6});
    fs::create_directories(path("out"));
    addText("precious", "keep me");
    for (const char* name :
         {"out/contact_sheet.png", "out/report.json", "out/0.exr", "out/0.transmittance.exr"})
        fs::create_symlink("../precious", path(name));
    const Ran ran = brume("apply depth_fog in -o out --keep transmittance --report out/report.json");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(bytesOf(path("precious")), "keep me");
    for (const auto& file : fs::directory_iterator(path("out")))
        EXPECT_FALSE(file.is_symlink()) << file.path();
}

TEST_F(Strangers, noOutputOfOtherCommandsFollowsALink) {
    addFrame("a.exr", {64, 48});
    addEffect("own.fs", "", charted("fast", R"(, "REFERENCE": {"amount": 1})"));
    addText("p.ini", "Techniques=SpiritFog@SpiritFog.fx\n");
    addText("precious", "keep me");
    const std::vector<std::pair<std::string, std::vector<std::string>>> commands = {
        {"chart own.fs -o charts --size 64x48 --backend osmesa --seconds .01",
         {"charts/own.csv", "charts/own.svg", "charts/own.png", "charts/index.html"}},
        {"chart --stability debug_depth -o charts --backend cpu",
         {"charts/stability.debug_depth.csv", "charts/stability.debug_depth.svg"}},
        {"convert-preset p.ini -o p.json", {"p.json"}},
        {"convert a.exr -o b.exr", {"b.exr"}},
        {"inspect a.exr --picture c.png", {"c.png"}},
        {"check depth_fog --plan --sets 1 --frame a.exr --csv d.csv", {"d.csv"}}};
    fs::create_directories(path("charts"));
    for (const auto& [command, outputs] : commands) {
        for (const std::string& name : outputs) fs::create_symlink(path("precious"), path(name));
        const Ran ran = brume(command);
        EXPECT_EQ(ran.status, 0) << ran.err;
        EXPECT_EQ(bytesOf(path("precious")), "keep me") << command;
        for (const std::string& name : outputs) EXPECT_FALSE(fs::is_symlink(path(name))) << name;
    }
    ASSERT_EQ(mkfifo(path("fifo").c_str(), 0600), 0);  // nor does an output take a device's or pipe's place
    expectError("convert-preset p.ini -o fifo", 3, "fifo: is a device or a pipe");
    EXPECT_THAT(brume("apply depth_fog a.exr -o d.png --report fifo").err,
                HasSubstr("fifo: is a device or a pipe"));
    EXPECT_TRUE(fs::is_fifo(path("fifo")));
}

TEST_F(Strangers, namesInSidecarsAreImagesThatEnd) {
    addFrame("a.exr");
    ASSERT_EQ(mkfifo(path("fifo").c_str(), 0600), 0);
    for (const char* name : {"/dev/zero", "/dev/stdin", "fifo", ".", "/etc/passwd", "a.json"}) {
        addText("a.json",
                std::string(R"({"lights": [{"position": [0, 1, 0], "shadow_map": ")") + name + R"("}]})");
        const Ran ran = brume("apply volume_fog a.exr -o a.png");
        EXPECT_EQ(ran.status, 3) << name << ran.err;
        EXPECT_THAT(ran.err, Not(HasSubstr("root:"))) << "what a file holds is not told";
    }
    std::string lights, name = "a.exr";  // one file by many names
    for (int k = 0; k < 300; ++k) lights += R"({"shadow_map": ")" + (name = "./" + name) + "\"}, ";
    addText("a.json", R"({"lights": [)" + lights + "{}]}");
    expectError("apply depth_fog a.exr -o a.png", 3, "more than 256 light maps");
    expectError("apply depth_fog a.exr -o a.png --max-pixels 200000", 3, "more than the limit of");
    addText("a.json", "{}");
    for (const char* name : {"b.depth.png", "b.json"}) {
        fs::copy(path("a.exr"), path("b.exr"), fs::copy_options::overwrite_existing);
        fs::create_symlink("/dev/zero", path(name));
        EXPECT_EQ(brume("apply depth_fog b.exr -o b.png").status, name == std::string("b.json") ? 3 : 0);
        fs::remove(path(name));
    }
}

TEST_F(Strangers, includesAreFilesThatEnd) {
    addFrame("a.exr");
    ASSERT_EQ(mkfifo(path("fifo.glsl").c_str(), 0600), 0);
    fs::create_symlink("/dev/zero", path("zero.glsl"));
    for (const char* name : {"fifo.glsl", "zero.glsl", "/dev/zero"}) {
        addText("i.fs",
                std::string("/*{\"SPACE\": \"linear\", \"INPUTS\": [{\"NAME\": \"inputImage\", \"TYPE\": "
                            "\"image\"}]}*/\n#include \"") +
                    name + "\"\nvoid main() {}");
        const Ran ran = brume("apply i.fs a.exr -o a.png --backend osmesa");
        EXPECT_EQ(ran.status, 2) << ran.err;
        EXPECT_THAT(ran.err, HasSubstr("i.fs:2"));
    }
}

TEST_F(Strangers, whatMemoryCannotHoldIsRefusedBeforehand) {
    // Headers of images within the limits (here: raised ones) that no machine holds decoded.
    addText("huge.png", std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\x0f\0\0\0\x0f\0\0\x08\0\0\0\0", 29));
    fs::resize_file(path("huge.png"), size_t(1) << 31);  // a hole
    expectError("apply depth_fog huge.png -o a.png --max-pixels 1e12", 3, "more than this machine has");
    addFrame("a.exr");
    std::string passes;
    for (int k = 0; k < 250; ++k)
        passes +=
            "{\"TARGET\": \"t" + std::to_string(k) + "\", \"WIDTH\": \"16384\", \"HEIGHT\": \"16384\"}, ";
    addEffect("wide.fs", "", ", \"PASSES\": [" + passes + "{}]");
    expectError("apply wide.fs a.exr -o a.png --backend osmesa", 2, "more than this machine has");
}

}  // namespace
// The line that makes a picture again is there to be copied into a shell.
TEST_F(Strangers, aNameIsOneWordOfTheLineThatInspectOffers) {
    addFrame("street.exr");
    ASSERT_EQ(brume("apply depth_fog street.exr -o \"x'; echo obeyed; '.png\"").status, 0);
    const std::string said = brume("inspect \"x'; echo obeyed; '.png\"").out;
    const size_t from = said.find("brume apply --like "), to = said.find(" -o COPY", from);
    ASSERT_NE(to, std::string::npos) << said;
    const std::string word = said.substr(from + 19, to - from - 19);
    EXPECT_EQ(test::run(folder_, "printf %s " + word).out, "x'; echo obeyed; '.png");
}

}  // namespace brume::test
