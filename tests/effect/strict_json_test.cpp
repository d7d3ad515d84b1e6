// JSON that anybody may have written: presets, effect headers, sidecars, records.
#include "strict_json.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "error.hpp"

namespace brume {
namespace {

std::string refusal(const std::string& json) {
    try {
        parseJson(json);
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

std::string repeated(const std::string& part, int times) {
    std::string all;
    for (int k = 0; k < times; ++k) all += part;
    return all;
}

TEST(StrictJson, ReadsWhatIsSound) {
    EXPECT_EQ(
        parseJson("{\"a\": [1, {\"a\": 2}, {\"a\": 3}], /* twice, but not in one object */ \"b\": 4}")["b"],
        4);
    EXPECT_EQ(parseJson(repeated("[", 64) + repeated("]", 64)).dump().size(), 128u);
}

TEST(StrictJson, RefusesDepth) {
    EXPECT_EQ(refusal(repeated("[", 65) + repeated("]", 65)), "is nested deeper than 64 brackets");
    EXPECT_EQ(refusal(repeated("[", 1000000)), "is nested deeper than 64 brackets");
    EXPECT_EQ(refusal(repeated("{\"a\":", 1000000)), "is nested deeper than 64 brackets");
}

TEST(StrictJson, RefusesAKeySaidTwice) {
    EXPECT_EQ(refusal("{\"near\": 1, \"far\": 2, \"near\": 3}"), "says \"near\" twice");
    EXPECT_EQ(refusal("[{\"a\": {\"b\": 1, \"b\": 1}}]"), "says \"b\" twice");
    EXPECT_EQ(refusal("{\"a\": {\"b\": 1}, \"c\": {\"b\": 1}}"), "");
}

TEST(StrictJson, RefusesNumbersBeyondADouble) {
    EXPECT_NE(refusal("{\"a\": -1e306672}").find("holds a number that no double can hold"),
              std::string::npos);
    EXPECT_EQ(refusal("{\"a\": 1e308, \"b\": 123456789012345678901234567890}"), "");
}

// A string of 255,000 line ends came back as 2 MB of "<U+000A>".
TEST(StrictJson, AReasonIsASentenceWhateverTheFileHolds) {
    for (const char* part : {"\n", "\xc3\xa9", "\xf0\x9f\x8c\xab"}) {
        const std::string text = "{\"a\": \"" + repeated(part, 100000) + "\x01";
        try {
            parseJson(text);
            FAIL() << "was read";
        } catch (const nlohmann::json::parse_error& error) {
            const std::string reason = reasonOf(error);
            EXPECT_LE(reason.size(), 410u);
            EXPECT_EQ(reason.find("parse error at line "), 0u) << reason;
            EXPECT_EQ(shownJson(nlohmann::json(reason)).find("\xef\xbf\xbd"), std::string::npos)
                << "a character is cut: " << reason;
        }
    }
}

TEST(StrictJson, ShowsTextThatIsNoUtf8) {
    const std::string shown =
        shownJson(nlohmann::json("a\xdc"
                                 "b"));
    EXPECT_EQ(shown,
              "\"a\xef\xbf\xbd"
              "b\"");
}

}  // namespace
}  // namespace brume
