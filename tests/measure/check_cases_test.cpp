// What the check tries an effect on: frames of every kind, parameters from all of their ranges.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "measure/check.hpp"
#include "measure/compare.hpp"

using namespace brume;

namespace {

TEST(CheckFrames, coverSizesDepthsAndCameras) {
    auto frames = checkFrames();
    bool hasZero = false, hasDenormal = false, hasHuge = false, hasSky = false, hasHdr = false,
         isPitched = false;
    for (const CheckFrame& f : frames) {
        EXPECT_LE(f.frame.color.cols, 64);
        EXPECT_LE(f.frame.color.rows, 48);
        EXPECT_EQ(f.frame.color.type(), CV_32FC4);
        EXPECT_EQ(f.frame.depth.size(), f.frame.color.size());
        for (float z : cv::Mat_<float>(f.frame.depth)) {
            ASSERT_FALSE(std::isnan(z)) << f.name;
            ASSERT_GE(z, 0);
            hasZero |= z == 0;
            hasDenormal |= z > 0 && z < 1e-38f;
            hasHuge |= std::isfinite(z) && z > 1e30f;
            hasSky |= std::isinf(z);
        }
        for (const cv::Vec4f& c : cv::Mat_<cv::Vec4f>(f.frame.color)) {
            bool isFinite = std::isfinite(c[0]) && std::isfinite(c[1]) && std::isfinite(c[2]);
            EXPECT_TRUE(isFinite || !f.finiteColor) << f.name;
            hasHdr |= c[0] > 1000;
        }
        isPitched |= f.frame.camera.worldFromCamera(1, 2) != 0;
    }
    EXPECT_TRUE(hasZero && hasDenormal && hasHuge && hasSky && hasHdr && isPitched);
    auto again = checkFrames();
    for (size_t k = 0; k < frames.size(); k++)
        EXPECT_TRUE(compareImages(frames[k].frame.color, again[k].frame.color, 0, 0).passed);
}

TEST(CheckParameters, coverEveryChoiceAndStayInRange) {
    EffectHeader header = parseHeader("fixture.fs", R"(/*{
        "ISFVSN": "2", "SPACE": "linear",
        "INPUTS": [
            {"NAME": "inputImage", "TYPE": "image"},
            {"NAME": "wide", "TYPE": "float", "DEFAULT": 1, "MIN": 1e-3, "MAX": 1e4},
            {"NAME": "tint", "TYPE": "color", "DEFAULT": [1, 1, 1, 1], "MIN": [0, 0, 0, 0], "MAX": [2, 2, 2, 2]},
            {"NAME": "on", "TYPE": "bool", "DEFAULT": false},
            {"NAME": "method", "TYPE": "long", "VALUES": [3, 5, 9], "LABELS": ["a", "b", "c"], "DEFAULT": "auto", "AUTO": true},
            {"NAME": "boxes", "TYPE": "list", "MAX": 6, "FIELDS": [
                {"NAME": "density", "TYPE": "float", "DEFAULT": 1, "MIN": 0, "MAX": 2}]}
        ]
    }*/ void main() {})");
    CheckOptions options;
    options.randomSets = 40;
    auto sets = checkParameters(header, options);
    EXPECT_EQ(sets, checkParameters(header, options));
    std::set<long> methods;
    std::set<bool> switches;
    size_t mostRows = 0, small = 0, large = 0;
    for (const auto& [name, values] : sets) {
        for (const auto& [parameter, value] : values)
            EXPECT_FALSE(value.automatic) << name << ": " << parameter;
        double wide = values.at("wide").numbers.at(0);
        EXPECT_GE(wide, 1e-3) << name;
        EXPECT_LE(wide, 1e4) << name;
        small += wide < .1;
        large += wide > 100;
        for (double c : values.at("tint").numbers) EXPECT_TRUE(c >= 0 && c <= 2) << name;
        methods.insert(long(values.at("method").numbers.at(0)));
        switches.insert(values.at("on").numbers.at(0) != 0);
        mostRows = std::max(mostRows, values.at("boxes").rows.size());
    }
    EXPECT_EQ(methods, (std::set<long>{3, 5, 9}));
    EXPECT_EQ(switches.size(), 2u);
    EXPECT_EQ(mostRows, 6u);
    EXPECT_GT(small, 5u) << "log-uniform draws reach every decade";
    EXPECT_GT(large, 5u);
    auto named = [&](const std::string& name) {
        return std::find_if(sets.begin(), sets.end(), [&](auto& s) { return s.first == name; });
    };
    ASSERT_NE(named("min"), sets.end());
    ASSERT_NE(named("max"), sets.end());
    EXPECT_EQ(named("min")->second.at("wide").numbers[0], 1e-3);
    EXPECT_EQ(named("max")->second.at("wide").numbers[0], 1e4);
    EXPECT_NE(named("method=c"), sets.end());
}

}  // namespace
