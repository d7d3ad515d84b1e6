#include "effect/size_expression.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "error.hpp"

using brume::Error;
using brume::SizeExpression;

static double valueOf(const std::string& source) {
    return SizeExpression(source).evaluate({{"WIDTH", 640}, {"HEIGHT", 360}, {"radius", 4.5}});
}

TEST(SizeExpression, FollowsTheUsualPrecedence) {
    EXPECT_EQ(valueOf("1 + 2 * 3"), 7);
    EXPECT_EQ(valueOf("(1 + 2) * 3"), 9);
    EXPECT_EQ(valueOf("2 - 3 - 4"), -5);
    EXPECT_EQ(valueOf("-2 ^ 2"), -4);
    EXPECT_EQ(valueOf("2 ^ 3 ^ 2"), 512);
    EXPECT_EQ(valueOf("7 % 4 + 1"), 4);
    EXPECT_EQ(valueOf("1 < 2 && 3 >= 3 || 0"), 1);
    EXPECT_EQ(valueOf("!(1 != 2)"), 0);
    EXPECT_EQ(valueOf("0 ? 1 : 2 ? 3 : 4"), 3);
}

TEST(SizeExpression, KnowsNamesAndFunctions) {
    EXPECT_EQ(valueOf("$WIDTH/2"), 320);
    EXPECT_EQ(valueOf("ceil($HEIGHT / max($radius, 1.0))"), 80);
    EXPECT_EQ(valueOf("clamp(floor(sqrt($WIDTH)), 1, 20)"), 20);
    EXPECT_EQ(SizeExpression("$a + $b * $a").names(), (std::vector<std::string>{"a", "b", "a"}));
}

TEST(SizeExpression, NamesTheMistake) {
    auto mistake = [](const std::string& source) -> std::string {
        try {
            valueOf(source);
        } catch (const Error& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_NE(mistake("$WIDHT/2").find("'WIDTH'"), std::string::npos);
    EXPECT_NE(mistake("1 +").find("character 4"), std::string::npos);
    EXPECT_NE(mistake("min(1)").find("takes 2"), std::string::npos);
    EXPECT_NE(mistake("foo(1)").find("no function 'foo'"), std::string::npos);
    EXPECT_NE(mistake("1 2").find("expected an operator"), std::string::npos);
    EXPECT_NE(mistake(std::string(1000, '(')).find("nested"), std::string::npos);
    EXPECT_NE(mistake(std::string(1000, '-') + "1").find("nested"), std::string::npos);
    EXPECT_NE(mistake(std::string(10000, '1')).find("characters"), std::string::npos);
    EXPECT_NE(mistake("").find("expected a number"), std::string::npos);
}
