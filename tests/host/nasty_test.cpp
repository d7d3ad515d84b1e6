// Tables of what a hostile file or word may try: each is refused by one sentence, and nothing is written.
#include <sys/stat.h>

#include <cstring>
#include <filesystem>
#include <limits>

#include "error.hpp"
#include "program.hpp"

namespace brume::test {
namespace {

namespace fs = std::filesystem;
using namespace std::string_literals;

std::string repeated(const std::string& part, int times) {
    std::string all;
    for (int k = 0; k < times; ++k) all += part;
    return all;
}

class Nasty : public Program {
  protected:
    struct Row {
        std::string content, sentence;
    };
    /// Each content as a file of that name, and what `command` says of it; NAME stands for the name.
    void expectRefused(const std::string& command, int status, const std::string& ending,
                       const std::vector<Row>& rows) {
        for (size_t k = 0; k < rows.size(); ++k) {
            const std::string name = "n" + std::to_string(k) + ending;
            std::string line = command;
            for (size_t at = 0; (at = line.find("NAME", at)) != std::string::npos;) line.replace(at, 4, name);
            addText(name, rows[k].content);
            expectError(line, status, rows[k].sentence);
        }
    }
};

TEST_F(Nasty, Images) {
    const std::string npy = "\x93NUMPY\1\0\x50\0"s, exr = [&] {
        addFrame("a.exr");
        return bytesOf(path("a.exr"));
    }();
    const auto array = [&](std::string header) { return npy + (header.resize(79, ' '), header) + "\n"; };
    expectRefused(
        "apply depth_fog NAME -o a.png", 3, "",
        {{"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16000 +X 16000\n\2\2\x3e\x80", "holds only 57 bytes"},
         {"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y -5 +X 99999999999999999\n", "declares 2147483647 × -5"},
         {"#?RADIANCE\n" + repeated("A=b\n", 100000), "only begins like"},
         {"\xff\xd8\xff\xe0garbage", "only begins like"},
         {"II*\0\xff\xff\xff\xff"s, "only begins like"},
         {"II*\0\x08\0\0\0\1\0\0\1\4\0\1\0\0\0\x08\0\0\0\x08\0\0\0"s, "only begins like"},
         {array("{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999999999999, 3)}"), "senseless"},
         {array("{'descr': '|O', 'fortran_order': False, 'shape': (6, 8)}"), "number type '|O'"},
         {array("{'descr': '<f4', 'fortran_order': False, 'shape': (-6, -8)}"), "truncated"},
         {"\x93NUMPY\2\0\xff\xff\xff\xff{"s, "truncated"},
         {"PF\n1e9 -3\nnan\n", "the PFM header's scale"},
         {"PF\n8 6\n0\n" + std::string(576, '\0'), "senseless PFM header"},
         {"PF" + std::string(1 << 20, '\n'), "the PFM header's width"},
         {"PIEH\0\0\0\x40\0\0\0\x40"s, "declares 1073741824 × 1073741824 pixels, more than the limit"},
         {exr.substr(0, exr.size() / 2), "damaged"},
         {exr.substr(0, exr.size() - 3), "truncated or damaged"}});
}

TEST_F(Nasty, Sidecars) {
    addFrame("plain.exr");
    const std::vector<Row> rows = {
        {repeated("{\"a\":", 1000000), "is nested deeper than 64"},
        {R"({"camera": {"height": 1, "height": 2}})", "says \"height\" twice"},
        {R"({"camera": {"height": 1e999}})", "holds a number that no double can hold"},
        {R"({"camera": {"height": )" + repeated("9", 1000000) + "}}",
         "holds a number that no double can hold"},
        {R"({"camera": {"horizontal_view_degrees": 0}})", "horizontal_view_degrees"},
        {R"({"camera": {"fx": 500, "horizontal_view_degrees": 60}})",
         "fx and horizontal_view_degrees say the same thing twice: leave one out"},
        {R"({"camera": {"horizontal_view_degrees": 60, "fy": 500}})",
         "fy and horizontal_view_degrees say the same thing twice: leave one out"},
        {R"({"camera": {"pitch_degrees": 5, "world_from_camera": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}})",
         "pitch_degrees and world_from_camera say the same thing twice: leave one out"},
        {R"({"camera": {"fx": -1}})", "camera"},
        {R"({"camera": {"fx": 1e-300}})", "the focal lengths 1e-300, 1e-300 px are not within 1e-6 to 1e9"},
        {R"({"camera": {"cy": -1e10}})", "the principal point"},
        {R"({"camera": {"height": 1e30}})", "the pose holds 1e+30, not within 1e+15 m of the origin"},
        {R"({"camera": {"world_from_camera": [1e4, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}})",
         "the pose holds 10000, not within 1000"},
        {R"({"camera": {"world_from_camera": [0, 0, 0]}})", "must be 16 numbers"},
        {"{\"camera\": {\"height\": 6\0}}"s, "holds zero bytes"},
        {"{\"c\xff\": 1}", "ill-formed UTF-8"},
        {R"({"depth": "/dev/zero"})", "depth: must be an object"},
        {"3", "must hold an object"},
        {"", "the file is empty"}};
    for (size_t k = 0; k < rows.size(); ++k) fs::copy(path("plain.exr"), path(text("n", k, ".exr")));
    size_t k = 0;
    for (const Row& row : rows) {
        addText(text("n", k, ".json"), row.content);
        expectError(text("apply depth_fog n", k++, ".exr -o a.png"), 3, row.sentence);
    }
}

// What an EXR of brume's own says may be any 64 bits.
TEST_F(Nasty, StatementsOfAnExr) {
    addFrame("plain.exr");
    ASSERT_EQ(brume("apply depth_fog plain.exr -o stated.exr --with-depth --camera cx=3").status, 0);
    const std::string bytes = bytesOf(path("stated.exr"));
    const double nan = std::numeric_limits<double>::quiet_NaN(), huge = 1e300;
    struct Case {
        std::string attribute;
        double value;
        std::string sentence;
    };
    for (const Case& one : {Case{"brumeFx\0double\0"s, nan, "not above 0"},
                            {"brumeFx\0double\0"s, huge, "not within 1e-6 to 1e9"},
                            {"brumeCx\0double\0"s, nan, "the principal point nan"},
                            {"brumeWorldFromCamera\0m44d\0"s, nan, "the pose holds nan"},
                            {"brumeWorldFromCamera\0m44d\0"s, huge, "the pose holds 1e+300"},
                            {"brumeTime\0double\0"s, nan, "its time (brumeTime) is nan"}}) {
        std::string changed = bytes;
        const size_t at = changed.find(one.attribute);
        ASSERT_NE(at, std::string::npos) << one.attribute.c_str();
        std::memcpy(changed.data() + at + one.attribute.size() + 4, &one.value, sizeof one.value);
        addText("changed.exr", changed);
        expectError("apply depth_fog changed.exr -o a.png", 3, one.sentence);
    }
}

TEST_F(Nasty, Presets) {
    addFrame("a.exr");
    const auto effect = [](const std::string& rest) { return R"({"effects": [{"effect": )" + rest + "}]}"; };
    std::string many = R"({"effects": [)" + repeated(R"({"effect": "depth_fog"}, )", 100000);
    many.replace(many.size() - 2, 2, "]}");
    expectRefused("apply NAME a.exr -o a.png", 2, ".json",
                  {{many, "100000 effects; at most 256"},
                   {R"({"effects": [], "effects": []})", "says \"effects\" twice"},
                   {R"({"effects": {"a": 1}})", "\"effects\" must be an array"},
                   {R"({"effects": []} x)", "parse error at line 1, column 17"},
                   {repeated("/* ", 100), "missing closing '*/'"},
                   {effect(R"("\ud800")"), "surrogate"},
                   {effect(R"("a\nb")"), "holds no control characters"},
                   {effect(R"("depth\u0000fog")"), "holds no control characters"},
                   {effect(R"("../../depth_fog")"), "is a path"},
                   {effect(R"("depth_fog", "visibility": [1, 2])"), "needs 1 number, not 2"},
                   {effect(R"("depth_fog", "visibility": "∞")"), "'∞' is not a number"},
                   {effect(R"("gaussian_blur", "radius": 99999999999999999999999)"), "1e+23 is out of range"},
                   {effect(R"("gaussian_blur", "radius": -1)"), "-1 is out of range"},
                   {effect(R"("depth_fog", "input": "nowhere")"), "reads the image 'nowhere'"},
                   {"", "not JSON"}});
    for (const char* line : {"apply /dev/zero a.exr -o a.png", "info /dev/zero"})
        expectError(line, 2, "no such");
    expectError("convert-preset /dev/zero -o x.json", 3, "/dev/zero: is not a regular file");
}

TEST_F(Nasty, ReshadePresets) {
    const std::string head = "Techniques=SpiritFog@SpiritFog.fx\n[SpiritFog.fx]\n";
    expectRefused("convert-preset NAME -o x.json", 3, ".ini",
                  {{head + "FogStart=0\0\n"s, "holds zero bytes"},
                   {head + repeated("FogStart=0.1\n", 1000000), "holds more than 4 MiB of text"},
                   {"", "is empty"}});
    std::string on, order;  // sorting them takes no square of their number
    for (int k = 0; k < 60000; ++k) on += text("T", k, ","), order += text("T", 60000 - k, ",");
    expectRefused("convert-preset NAME -o x.json", 2, ".ini",
                  {{head + "FogStart=1e999\n", "n0.ini:3: FogStart=1e999 is not a number"},
                   {head + "FogColor=1e30,-1e30,nan\n", "is not 3 numbers"},
                   {head + "FogCurve=1e300\n", "the value must be a finite number"},
                   {"Techniques=" + repeated("SpiritFog,", 257) + "\n", "257 effects; at most 256"},
                   {"Techniques=\xff\x1b[2J@\xff.fx\n", "no technique that is on makes something"},
                   {"Techniques=" + on + "\nTechniqueSorting=" + order + "\n", "no technique that is on"},
                   {"[[[\n=\n==\n]]]", "no line 'Techniques='"}});
    addText("x.ini", head + "Name=caf\xe9\nFogStart=0.1\nFogStart=0.7\n");  // no UTF-8, and a key twice
    const Ran ran = brume("convert-preset x.ini -o x.json");
    EXPECT_EQ(ran.status, 0) << ran.err;
    EXPECT_NE(bytesOf(path("x.json")).find("\"linear_start\":0.7"), std::string::npos);
    addFrame("a.exr");
    EXPECT_EQ(brume("apply x.json a.exr -o a.png").status, 0);
}

// An EXR's record has no checksum: any letter of it may be another's.
TEST_F(Nasty, Records) {
    addFrame("abcde.exr");
    ASSERT_EQ(brume("apply depth_fog abcde.exr -o made.exr --seed 1234567890").status, 0);
    const std::string bytes = bytesOf(path("made.exr"));
    struct Change {
        std::string from, to;
        int status;
        std::string sentence;
    };
    for (const Change& change :
         {Change{"\"fps\":24.0", "\"fps\":-4.0", 3, "index, seed or fps is out of range"},
          {"\"fps\":24.0", "\"fps\":0e00", 3, "index, seed or fps is out of range"},
          {"1234567890", "9999999999", 3, "index, seed or fps is out of range"},
          {"1234567890", "-123456789", 3, "index, seed or fps is out of range"},
          {"\"with_depth\":false", "\"with_depth\":12345", 3, "type must be boolean"},
          {"\"backend\":\"cpu\"", "\"backend\":\"../\"", 2, "no backend '../'"},
          {"\"effect\":\"depth_fog\"", "\"effect\":\"./pth_fog\"", 2, "is a path"},
          {"\"input\":\"abcde.exr\"", "\"input\":\"/dev/zero\"", 3, "not a regular file"},
          {"{\"version\"", "[\"version\"", 3, "does not say how it was made"}}) {
        ASSERT_EQ(change.from.size(), change.to.size());
        std::string changed = bytes;
        const size_t at = changed.find(change.from);
        ASSERT_NE(at, std::string::npos) << change.from;
        addText("changed.exr", changed.replace(at, change.to.size(), change.to));
        expectError("apply --like changed.exr -o a.png", change.status, change.sentence);
    }
    addText("changed.exr", bytes);
    EXPECT_EQ(brume("apply --like changed.exr -o a.png").status, 0);
}

TEST_F(Nasty, EffectFiles) {
    addFrame("a.exr", {8, 6});
    const auto file = [](const std::string& inputs, const std::string& more,
                         const std::string& body = "void main() { store(fetch(inputImage, pixel())); }") {
        return R"(/*{"SPACE": "linear", "INPUTS": [{"NAME": "inputImage", "TYPE": "image"})" + inputs + "]" +
               more + "}*/\n#include \"kit/image.glsl\"\n" + body;
    };
    const auto sized = [&](const std::string& width) {
        return file("", R"(, "PASSES": [{"TARGET": "t", "WIDTH": ")" + width + "\"}, {}]");
    };
    std::string passes, inputs;
    for (int k = 0; k < 1000; ++k) passes += text("{\"TARGET\": \"t", k, "\"}, ");
    for (int k = 0; k < 2000; ++k)
        inputs +=
            text(", {\"NAME\": \"f", k, "\", \"TYPE\": \"float\", \"DEFAULT\": 0, \"MIN\": 0, \"MAX\": 1}");
    expectRefused(
        "apply NAME a.exr -o a.png --backend osmesa", 2, ".fs",
        {{"/*{\"SPACE\": \"linear\"*/", "is not JSON"},
         {"/*" + repeated("[", 1000000) + "*/", "no comment holds a JSON object"},
         {file("", R"(, "PASSES": [)" + passes + "{}]"), "1001 PASSES; at most 256"},
         {file(inputs, ""), "2001 INPUTS; at most 1024"},
         {sized(std::string(100000, '(')), "a size expression of 100000 characters"},
         {sized(std::string(4000, '(')), "size expression"},
         {sized("1/0"), "gives inf"},
         {sized("1e30"), "gives 1e+30"},
         {sized("10000000"), "px a side"},
         {file("", R"(, "PASSES": [{"TARGET": "t", "COMPUTE": {"LOCAL_SIZE": [99999, 9]}}, {}])"),
          "LOCAL_SIZE"},
         {file(R"(, {"NAME": "a; }", "TYPE": "float", "DEFAULT": 0, "MIN": 0, "MAX": 1})", ""), "a; }"},
         {file("", "", "#include \".\"\nvoid main() {}"), "is not in"},
         {file("", "", "#include \"NAME.fs\"\nvoid main() {}"), "is not in"}});
    addText(
        "imported.fs",
        R"(/*{"INPUTS": [], "IMPORTED": {"x": {"PATH": "../../../../../../etc/passwd"}}}*/ void main() {})");
    expectError("apply imported.fs a.exr -o a.png --backend osmesa", 3, "etc/passwd");
}

TEST_F(Nasty, StandardStreamsAndFullDisks) {
    addFrame("a.exr", {1024, 768});
    Ran ran = test::run(folder_, "BRUME list >/dev/full");
    EXPECT_EQ(ran.status, 3);
    EXPECT_EQ(ran.err, "brume: standard output: cannot be written\n");
    // A closed stream's number would be the next file's, which would get what is printed.
    EXPECT_EQ(brume("apply depth_fog a.exr -o a.png").status, 0);
    ran = test::run(folder_, "BRUME apply depth_fog a.exr -o b.png <&- >&- 2>&-");
    EXPECT_EQ(ran.status, 0);
    EXPECT_EQ(bytesOf(path("b.png")), bytesOf(path("a.png")));
    EXPECT_EQ(brume("apply blend a.exr -o a.npy").status, 0);  // which is read without shared memory
    ran = test::run(folder_, "ulimit -f 6000; BRUME apply blend a.npy --depth none -o c.npy");
    EXPECT_EQ(ran.status, 3);
    EXPECT_THAT(ran.err, testing::HasSubstr("brume: c.npy: cannot be written: File too large\n"));
    EXPECT_FALSE(fs::exists(path("c.npy")));
}

TEST_F(Nasty, ListsAndPlaces) {
    addFrame("a.exr");
    expectRefused("apply depth_fog NAME -o out/", 3, ".txt",
                  {{"n0.txt\n", "n0.txt: is not an image"},
                   {"a.exr\na.exr\n\0\0\0"s, "holds zero bytes"},
                   {"1e999 a.exr 1 a.exr", "n2.txt:1: is not"},
                   {"", "is empty"},
                   {std::string(1000000, 'x'), "xxxx ... xxxx"}});
    ASSERT_EQ(mkfifo(path("fifo").c_str(), 0600), 0);
    fs::create_symlink("loop", path("loop"));
    fs::create_symlink("/dev/zero", path("zero.txt"));
    fs::create_symlink("fifo", path("b.json"));
    fs::copy(path("a.exr"), path("b.exr"));
    expectError("apply depth_fog fifo -o a.png", 3, "is not a regular file");
    expectError("apply depth_fog /dev/zero -o a.png", 3, "is not a regular file");
    expectError("apply depth_fog zero.txt -o a.png", 3, "is not a regular file");
    expectError("apply depth_fog b.exr -o a.png", 3, "b.json: is not a regular file");
    expectError("apply depth_fog loop -o a.png", 3, "there is no such file");
    expectError("apply depth_fog a.exr -o loop/a.png", 3, "'loop' cannot be made");
    expectError("apply depth_fog a.exr -o /dev/full --format png", 3, "cannot be made");
    expectError("apply depth_fog . -o out/ --keep-going", 3, "");
}

TEST_F(Nasty, Words) {
    addFrame("a.exr");
    const std::vector<std::pair<std::string, std::string>> words = {
        {"--max-pixels nan", "nan"},
        {"--fps inf", "inf"},
        {"--fps nan", "nan"},
        {"--pass-seconds nan", "nan"},
        {"--memory 1e99Q", "1e99Q"},
        {"--jobs 99999999", "99999999"},
        {"--shard 5/0", "5/0"},
        {"--seed -1", "--seed"},
        {"--keep ../../x", "--keep"},
        {"--depth-encoding opengl:near=0,far=0", "near is 0"},
        {"--camera fx=0", "the focal lengths 0, 0 px are not above 0"},
        {"--camera horizontal_view_degrees=180", "horizontal_view_degrees is 180"},
        {"--camera pixel_centres=3", "pixel_centres is 3.0, not half or whole"},
        {"--camera cx=1e300", "the principal point"},
        {"--camera fx=nan", "fx is \"nan\", not a number"},
        {"--camera height=high", "height is \"high\", not a number"},
        {"--camera height", "height is not key=value"},
        {"--set depth_fog.visibility=nan", "'nan' is not a number"},
        {"--set depth_fog.visibility=1e400", "'1e400' is not a number"},
        {"--set depth_fog.color=../../x", "is no colour"},
        {"--set depth_fog.visibility=" + repeated("1,", 20000) + "1", "more than 10000 outputs"}};
    for (const auto& [word, part] : words) expectError("apply depth_fog a.exr -o a.png " + word, 2, part);
    for (const char* out :
         {"out/{stem}/../../../../x.png", "{nope}.png", "'{index:999999999}.png'", "x.exe", "a.exr"})
        expectError("apply depth_fog a.exr -o "s + out, 2, "-o");
    for (const char* name : {"../../x", "'a;b'", "''"}) expectError("new "s + name, 2, "");
    expectError("apply '' '' -o ''", 2, "");
}

}  // namespace
}  // namespace brume::test
