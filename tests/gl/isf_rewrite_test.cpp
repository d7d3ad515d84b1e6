#include "gl/isf_rewrite.hpp"

#include <gtest/gtest.h>

namespace brume {
namespace {

std::string repeated(const std::string& piece, size_t bytes) {
    std::string text;
    while (text.size() < bytes) text += piece;
    return text;
}

std::string rewritten(const std::string& source) {
    IsfUses uses;
    return rewriteIsf(source, IsfStage::Fragment, {"RENDERSIZE", "inputImage"}, uses);
}

// Half a MiB each: where each word looks to the end of the file, minutes; else a tenth of a second.
TEST(IsfRewrite, TimeGrowsAsTheText) {
    const size_t size = 1 << 19;
    for (const char* piece : {"const ", "const a=(", "in ", "in vec3 a[ ", "varying a ", "out a b; ) ",
                              ": float a= ", "lowp float a=( ", "{float a=", "{float a, ", "layout( ",
                              "# version ", "/**/a", "//\n# "}) {
        SCOPED_TRACE(piece);
        const std::string text = repeated(piece, size);
        EXPECT_GE(rewritten(text).size(), size / 4);
        EXPECT_GE(rewritten("void main() { layout(" + text).size(), size / 4);
    }
}

TEST(IsfRewrite, DeclarationsEndWhereTheNextBegins) {
    EXPECT_EQ(rewritten("layout(location = 0) out vec4 a; layout(location = 1) out vec4 b;").find("layout"),
              std::string::npos);
    EXPECT_EQ(rewritten("uniform vec2 RENDERSIZE; uniform float b;").find("RENDERSIZE"), std::string::npos);
    EXPECT_EQ(rewritten("void f(const in vec3 a, const in vec3 b) {}"),
              "void f(const in vec3 a, const in vec3 b) {}");
    EXPECT_EQ(rewritten("void f() { float a = max(1.0, 2.0), b, c[2], d; int e; }"),
              "void f() { float a = max(1.0, 2.0), b = float(0), c[2], d = float(0); int e = int(0); }");
}

}  // namespace
}  // namespace brume
