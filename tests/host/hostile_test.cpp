// What anybody may hand to the program: names, presets and effect files that try to get further than they
// should.
#include <filesystem>

#include "frame/reader_line.hpp"
#include "program.hpp"

namespace brume::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

class HostileInput : public Program {
  protected:
    static std::string repeated(const std::string& part, int times) {
        std::string all;
        for (int k = 0; k < times; ++k) all += part;
        return all;
    }
    void addEffect(const std::string& name, const std::string& passes, const std::string& body) {
        addText(name, R"(/*{"SPACE": "linear", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"}])" +
                          passes + "}*/\n#include \"kit/image.glsl\"\n" + body);
    }
};

TEST_F(HostileInput, aShaderThatNeverEndsIsGivenUpAndItsPassNamed) {
    addFrame("a.exr",
             {1024, 768});  // llvmpipe ends a loop after 65536 rounds, which for a few pixels is soon
    addEffect("spin.fs", R"(, "PASSES": [{"TARGET": "small"}, {"TARGET": "endless"}, {}])", R"(
        void main() {
            vec4 c = fetch(inputImage, pixel());
        #ifdef PASS_endless
            while (c.a > 0.0) {
                for (int i = 0; i < 1000000; i++)
                    for (int j = 0; j < 1000000; j++) c.r = fract(c.r * 1.7 + float(i ^ j));
                c.a = c.r + 2.0;
            }
            store(c + fetch(small, pixel()));
        #elif defined(PASS_output)
            store(fetch(endless, pixel()));
        #else
            store(c);
        #endif
        })");
    const std::string seconds = isSanitized ? "10" : "0.5";  // for the pass before it to end in time
    for (const char* backend : {"osmesa", "egl"})
        expectError("apply spin.fs a.exr -o a.png --pass-seconds " + seconds + " --backend " + backend, 2,
                    "spin.fs: the pass spin/endless: did not finish within " + seconds + " s");
}

TEST_F(HostileInput, everyCommandThatRunsShadersGivesUp) {
    addEffect("slow.fs", "", R"(
        void main() {
            vec4 c = fetch(inputImage, pixel());
            for (int i = 0; i < 60000; i++)
                for (int j = 0; j < 60000; j++)
                    for (int k = 0; k < 64; k++) c.r = fract(sin(c.r * 1.7 + float(i ^ j ^ k)));
            store(c);
        })");
    // check's frames are small and llvmpipe ends every loop after 65536 rounds: each round (unrolled) is
    // long.
    for (const char* command : {"check slow.fs --backend osmesa", "bench slow.fs --backend osmesa",
                                "chart slow.fs --backend osmesa -o charts"}) {
        const Ran ran = brume(std::string(command) + " --pass-seconds .1");
        EXPECT_NE(ran.status, 0) << command;
        EXPECT_THAT(ran.out + ran.err, HasSubstr("did not finish within 0.1 s")) << command;
    }
}

TEST_F(HostileInput, aPassThatRepeatsWithoutEndIsRefused) {
    addFrame("a.exr");
    addEffect("again.fs", R"(, "PASSES": [{"TARGET": "more", "REPEAT": "10^9"}, {}])",
              "void main() { store(fetch(inputImage, pixel())); }");
    expectError("apply again.fs a.exr -o a.png --backend osmesa", 2,
                "REPEAT '10^9' gives 1e+09; at most 65536");
}

TEST_F(HostileInput, shadersOfAbsurdSizeAreRefused) {
    addFrame("a.exr");
    addEffect("long.fs", "", repeated("float padding() { return 0.0; }\n", 150000));
    expectError("apply long.fs a.exr -o a.png", 2, "long.fs: an effect file of");
    addText("inner.glsl", repeated("// nothing, at some length\n", 400000));
    addEffect("wide.fs", "", "#include \"inner.glsl\"\nvoid main() { store(fetch(inputImage, pixel())); }");
    expectError("apply wide.fs a.exr -o a.png --backend osmesa", 2, "8 MiB");
}

TEST_F(HostileInput, includesNeitherCycleNorLeaveTheirPath) {
    addFrame("a.exr");
    const std::string body = "void main() { store(fetch(inputImage, pixel())); }";
    addText("one.glsl", "#include \"two.glsl\"\n");
    addText("two.glsl", "\n#include \"one.glsl\"\n");
    addEffect("cycle.fs", "", "#include \"one.glsl\"\n" + body);
    expectError("apply cycle.fs a.exr -o a.png --backend osmesa", 2,
                "two.glsl:2: #include \"one.glsl\" includes itself");
    addEffect("up.fs", "", "#include \"../up.glsl\"\n" + body);
    expectError("apply up.fs a.exr -o a.png --backend osmesa", 2, "leaves the include path");
    addEffect("root.fs", "", "#include \"/etc/passwd\"\n" + body);
    expectError("apply root.fs a.exr -o a.png --backend osmesa", 2, "leaves the include path");
    for (int k = 0; k < 100; k++)
        addText("c" + std::to_string(k) + ".glsl", "#include \"c" + std::to_string(k + 1) + ".glsl\"\n");
    addEffect("chain.fs", "", "#include \"c0.glsl\"\n" + body);
    expectError("apply chain.fs a.exr -o a.png --backend osmesa", 2,
                "c63.glsl:1: #include \"c64.glsl\" is nested deeper than 64 files");
}

// In place of brume_reader: what it says and does not say ends in a sentence, and so does that it does not
// end.
TEST_F(HostileInput, aReaderGoneMadIsGivenUp) {
    addFrame("a.exr");
    fs::create_directories(path("lib/brume"));
    fs::copy(BRUME_BINARY_DIR "/lib/libbrume.so", path("lib"));
    for (const char* part : {"effects", "glsl", "modules"})
        fs::create_symlink(std::string(BRUME_BINARY_DIR "/lib/brume/") + part, path("lib/brume/") + part);
    const auto sentenceOf = [&](const std::string& script) {
        addText("lib/brume/brume_reader", "#!/bin/sh\n" + script + "\n");
        fs::permissions(path("lib/brume/brume_reader"), fs::perms::owner_all);
        const Ran ran = run(folder_, "LD_LIBRARY_PATH=lib timeout 60 BRUME apply depth_fog a.exr -o a.png");
        EXPECT_EQ(ran.status, 3) << script;
        return ran.err;
    };
    EXPECT_THAT(sentenceOf("exit 7"), HasSubstr("a.exr: is damaged: decoding it ended with status 7"));
    EXPECT_THAT(sentenceOf(R"(printf '\1\0\0\0\0\0\0\0\366' >&3; sleep 2)"), HasSubstr("answers nonsense"));
    // It closes the line and stays.
    EXPECT_THAT(sentenceOf("trap '' HUP TERM; exec 3>&-; sleep 20"), HasSubstr("decoding it took too long"));
    fs::remove(path("lib/brume/brume_reader"));
    EXPECT_THAT(brume("apply depth_fog a.exr -o a.png").err, testing::Not(HasSubstr("brume: ")));
}

// Words of any length: std::regex took stack for every character.
TEST_F(HostileInput, longWordsAreRefusedLikeShortOnes) {
    addFrame("a.exr");
    const std::string isf = R"(/*{"INPUTS": [{"NAME": "inputImage", "TYPE": "image"}], )",
                      body = "}*/\nvoid main() { gl_FragColor = IMG_THIS_PIXEL(inputImage); }\n";
    addText("name.fs",
            isf + R"("PASSES": [{"TARGET": "t", "WIDTH": ")" + repeated("a", 300000) + "\"}, {}]" + body);
    expectError("apply name.fs a.exr -o a.png --backend osmesa", 2, "characters; at most 4096");
    addText("number.fs", isf + "\"OTHER\": -" + repeated("0", 300000) + "7f" + body);
    EXPECT_EQ(brume("info number.fs").status, 0);
    addText("low.fs",
            isf + R"("PASSES": [{"TARGET": "t", "WIDTH": "-1e300", "REPEAT": "-1e300"}, {}])" + body);
    EXPECT_EQ(brume("apply low.fs a.exr -o a.png --backend osmesa").status, 0);
    addText("high.fs", isf + R"("PASSES": [{"TARGET": "t", "WIDTH": "1e9"}, {}])" + body);
    expectError("apply high.fs a.exr -o a.png --backend osmesa", 2,
                "high.fs: t: size expression '1e9' gives");
    // Within brume's limit, beyond any driver's.
    addText("driver.fs", isf + R"("PASSES": [{"TARGET": "t", "WIDTH": "1000000"}, {}])" + body);
    expectError("apply driver.fs a.exr -o a.png --backend osmesa", 2,
                "driver.fs: the pass driver/t: OpenGL: an image of 1000000x");
    const std::string word = repeated("b", 100000);
    for (const std::string& place : {word, "a." + word, "a.b[" + repeated("1", 100000) + "].c"})
        EXPECT_EQ(brume("apply depth_fog a.exr -o a.png --set '" + place + "=1'").status, 2);
}

TEST_F(HostileInput, presetsNameEffectsAndNoFiles) {
    addFrame("a.exr");
    addEffect("own.fs", "", "void main() { store(fetch(inputImage, pixel())); }");
    fs::copy(BRUME_BINARY_DIR "/lib/brume/effects/depth_fog/depth_fog.so", path("own.so"));  // would be run
    for (const char* name : {"./own.fs", "own.fs", "../own", "/tmp/own/own.fs"}) {
        addText("p.json", std::string(R"({"effects": [{"effect": ")") + name + R"("}]})");
        expectError("apply p.json a.exr -o a.png", 2, "is a path; a preset may only name effects");
    }
    // A folder here is not run either, for all that its name is plain.
    fs::create_directories(path("own"));
    fs::copy(path("own.fs"), path("own/own.fs"));
    fs::copy(path("own.so"), path("own/own.so"));
    addText("p.json", R"({"effects": [{"effect": "own"}]})");
    expectError("apply p.json a.exr -o a.png", 2, "a preset may not run the folder 'own' here");
    addText("p.json", R"({"effects": [{"effect": ")" + repeated("own", 200) + R"("}]})");
    expectError("apply p.json a.exr -o a.png", 2, "no effect 'ownown");
    addText("p.json", R"({"effects": [{"effect": "depth_fog", "output": "../../x"}]})");
    expectError("apply p.json a.exr -o a.png", 2, "is a path; an image has a plain name");
}

TEST_F(HostileInput, presetsOfMonstrousJsonAreRefused) {
    addFrame("a.exr");
    addText("deep.json", repeated("[", 1000000));
    expectError("apply deep.json a.exr -o a.png", 2, "nested deeper than 64");
    addText("inner.json",
            R"({"effects": [{"effect": "depth_fog", "visibility": )" + repeated("{\"a\":", 100000));
    expectError("apply inner.json a.exr -o a.png", 2, "nested deeper than 64");
    addText("twice.json", R"({"effects": [{"effect": "depth_fog", "visibility": 1, "visibility": 2}]})");
    expectError("apply twice.json a.exr -o a.png", 2, "says \"visibility\" twice");
    addText("huge.json", R"({"effects": [{"effect": "depth_fog", "visibility": 1e999}]})");
    expectError("apply huge.json a.exr -o a.png", 2, "holds a number that no double can hold");
    addText("whole.json", R"({"effects": [{"effect": "gaussian_blur", "radius": 1e300}]})");
    expectError("apply whole.json a.exr -o a.png", 2, "radius");
    addText("long.json", repeated(" ", 5000000));
    expectError("apply long.json a.exr -o a.png", 2, "at most 4 MiB");
    addText("a.json", "{\"camera\": " + repeated("[", 1000000));
    expectError("apply depth_fog a.exr -o a.png", 3, "a.json: is nested deeper than 64");
}

TEST_F(HostileInput, namesMayHoldAnyByte) {
    addFrame("plain.exr");
    for (const std::string name : {"a b", "a\nb", "100%s%n%d", "\xff\xfe", "-o", "a'\"b", "a\x1b[31mb"}) {
        fs::copy(path("plain.exr"), path(name + ".exr"));
        std::string quoted;
        for (const char c : "./" + name + ".exr")
            quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
        const auto ran = brume("apply depth_fog '" + quoted + "' -o out/ --report r.json");
        EXPECT_EQ(ran.status, 0) << ran.err;
        EXPECT_TRUE(fs::exists(path("out/" + name + ".exr"))) << name;
        EXPECT_TRUE(fs::exists(path("r.json")));
        const auto resumed = brume("apply depth_fog '" + quoted + "' -o out/ --resume --report r.json");
        EXPECT_EQ(resumed.status, 0) << resumed.err;
        EXPECT_THAT(bytesOf(path("r.json")), HasSubstr("up to date")) << name;
        fs::remove(path("r.json"));
    }
}

TEST_F(HostileInput, aSentenceHoldsNoTerminalCodes) {
    expectError("apply depth_fog \"$(printf 'x\\033[2Jy.exr')\" -o a.png", 3, "x\\x1b[2Jy.exr");
}

TEST_F(HostileInput, whatIsPrintedHoldsNoTerminalCodes) {
    addText("\x1b[2J.fs", "/*{\"DESCRIPTION\": \"\\u001b[2J\\u009b2J\"}*/ void main() {}");
    const Ran ran = brume("info \"$(printf '\\033[2J.fs')\"");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_EQ(ran.out.find('\x1b'), std::string::npos);
    EXPECT_EQ(ran.out.find("\xc2\x9b"), std::string::npos);
    EXPECT_THAT(ran.out, HasSubstr("\\x1b[2J\\xc2\\x9b2J"));
}

TEST_F(HostileInput, sentencesSpeakOfNoExceptions) {
    addFrame("a.exr");
    addText("p.json", "{\"effects\": [}");
    expectError("apply p.json a.exr -o a.png", 2, "p.json:1: not JSON: parse error at line 1, column 14");
    addText("a.json", "{\"camera\": {\"fov_x\": \"wide\"}}");
    EXPECT_EQ(brume("apply depth_fog a.exr -o a.png").err.find("exception"), std::string::npos);
    addText("a.json", "{");
    expectError("apply depth_fog a.exr -o a.png", 3, "a.json: is not JSON: parse error at line 1");
}

TEST_F(HostileInput, namesTooLongForTheDiskAreSentences) {
    addFrame("a.exr");
    const std::string name = repeated("long", 80), deep = repeated("long/", 1000) + "long";
    for (const std::string& one : {name, deep}) {
        expectError("apply " + one + " a.exr -o a.png", 2, "no ");
        expectError("apply " + one + ".json a.exr -o a.png", 2, "long");
        expectError("apply depth_fog " + one + ".exr -o a.png", 3, "long");
        expectError("apply depth_fog a.exr --depth " + one + ".png -o a.png", 3, "long");
        expectError("apply depth_fog a.exr -o " + one + ".png", 3, "long");
        expectError("apply depth_fog a.exr -o 'out/{stem}/" + one + ".png'", 3, "long");
        expectError("info " + one, 2, "no ");
    }
}

TEST_F(HostileInput, outputsStayInTheirFolder) {
    addFrame("...exr");  // whose stem is ".."
    addFrame("a.exr");
    fs::create_directories(path("elsewhere"));
    fs::create_directories(path("out"));
    fs::create_directory_symlink("../elsewhere", path("out/a"));
    expectError("apply depth_fog ...exr -o 'out/{stem}/x.png'", 2, "leads out of the folder 'out'");
    expectError("apply depth_fog a.exr -o 'out/{stem}/x.png'", 2, "leads out of the folder 'out'");
    EXPECT_EQ(brume("apply depth_fog a.exr -o '{stem}/x.png'").status,
              0);  // a folder that is still to be made
    EXPECT_TRUE(fs::exists(path("a/x.png")));
    expectError("apply depth_fog ...exr -o '{stem}/x.png'", 2, "leads out of the folder '.'");
    // As long as a name may be.
    EXPECT_EQ(brume("apply depth_fog a.exr -o " + repeated("n", 251) + ".png").status, 0);
    // A link at the output's own name is replaced, not followed.
    addText("elsewhere/precious", "keep me");
    fs::create_symlink("../elsewhere/precious", path("out/a.png"));
    EXPECT_EQ(brume("apply depth_fog a.exr -o out/a.png").status, 0);
    EXPECT_EQ(bytesOf(path("elsewhere/precious")), "keep me");
    EXPECT_FALSE(fs::is_symlink(path("out/a.png")));
}

TEST_F(HostileInput, tooManyOpenFilesAreSaidToBeThat) {
    if (isSanitized) GTEST_SKIP() << "the sanitizer opens a file itself before it believes an object's type";
    addFrame("a.exr", {640, 480});  // pixels come back in shared memory, a file, too
    const std::string closeThoseOfTheCaller = "exec 3>&- 4>&- 5>&- 6>&- 7>&- 8>&- 9>&-; ";
    int refused = 0;
    for (int files = 5; files < 12; files++) {
        const Ran ran = run(folder_, closeThoseOfTheCaller + "ulimit -n " + std::to_string(files) +
                                         "; BRUME apply depth_fog a.exr -o a.png");
        if (ran.status == 0) continue;
        refused++;
        EXPECT_THAT(ran.err, HasSubstr("oo many open files")) << files;
        EXPECT_THAT(ran.err, testing::Not(HasSubstr("damaged"))) << files;
    }
    EXPECT_GE(refused, 2);
}

TEST_F(HostileInput, limitsAreRaisedByFlags) {
    addFrame("a.exr", {64, 48});
    expectError("apply depth_fog a.exr -o a.png --max-pixels 3000", 3,
                "a.exr: declares 64 × 48 pixels, more than the limit of 3000");
    expectError("apply depth_fog a.exr -o a.png --max-pixels 50", 3,
                "a.exr: declares 64 × 48 pixels, more than the limit of 50");
    EXPECT_EQ(brume("apply depth_fog a.exr -o a.png --max-pixels 4000").status, 0);
}

}  // namespace
}  // namespace brume::test
