#include "measure/compare.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "error.hpp"

using namespace brume;

namespace {

constexpr float inf = std::numeric_limits<float>::infinity();
const float nan = std::nanf("");

template <class T>
cv::Mat one(T value) {
    return cv::Mat(1, 1, cv::DataType<T>::type, cv::Scalar(value));
}

// Both precisions obey the same theorems.
template <class T>
class Compare : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Compare, Precisions);

TYPED_TEST(Compare, onlyLikeClassesMatchHoweverWideTheBound) {
    std::vector<TypeParam> classes = {TypeParam(1), TypeParam(inf), TypeParam(-inf), TypeParam(nan)};
    for (size_t i = 0; i < classes.size(); i++)
        for (size_t j = 0; j < classes.size(); j++) {
            Comparison c = compareImages(one(classes[i]), one(classes[j]), 1e30, 1e30);
            EXPECT_EQ(c.passed, i == j) << classes[i] << " against " << classes[j];
            EXPECT_EQ(c.worstOfBound, i == j ? 0 : inf);
            EXPECT_EQ(c.worst, i == j ? 0 : inf);
        }
}

TYPED_TEST(Compare, nanOfAnySignAndPayloadIsNan) {
    EXPECT_TRUE(compareImages(one(TypeParam(nan)), one(TypeParam(-nan)), 0, 0).passed);
    EXPECT_FALSE(compareImages(one(TypeParam(-nan)), one(TypeParam(0)), 1, 1).passed);
}

TYPED_TEST(Compare, zerosOfBothSignsAreEqual) {
    EXPECT_TRUE(compareImages(one(TypeParam(-0.)), one(TypeParam(0)), 0, 0).passed);
}

TYPED_TEST(Compare, boundIsAbsolutePlusRelativeToTheSecond) {
    EXPECT_TRUE(compareImages(one(TypeParam(1.5)), one(TypeParam(1)), .25, .25).passed);
    EXPECT_FALSE(compareImages(one(TypeParam(1.5078125)), one(TypeParam(1)), .25, .25).passed);
    // Relative to b, not to a.
    EXPECT_FALSE(compareImages(one(TypeParam(2)), one(TypeParam(1)), 0, .75).passed);
    EXPECT_TRUE(compareImages(one(TypeParam(1)), one(TypeParam(2)), 0, .75).passed);
    EXPECT_DOUBLE_EQ(compareImages(one(TypeParam(1.5)), one(TypeParam(1)), 1, 0).worstOfBound, .5);
}

TYPED_TEST(Compare, withoutAnyBoundOnlyEqualValuesPass) {
    EXPECT_TRUE(compareImages(one(TypeParam(.1)), one(TypeParam(.1)), 0, 0).passed);
    TypeParam next = std::nextafter(TypeParam(.1), TypeParam(1));
    Comparison c = compareImages(one(next), one(TypeParam(.1)), 0, 0);
    EXPECT_FALSE(c.passed);
    EXPECT_EQ(c.worstOfBound, inf);
}

TYPED_TEST(Compare, denormalsAndHugeValuesAreFinite) {
    TypeParam tiny = std::numeric_limits<TypeParam>::denorm_min();
    EXPECT_FALSE(compareImages(one(tiny), one(TypeParam(0)), 0, 0).passed);
    EXPECT_TRUE(compareImages(one(tiny), one(TypeParam(0)), 1e-30, 0).passed);
    TypeParam huge = std::numeric_limits<TypeParam>::max();
    EXPECT_TRUE(compareImages(one(huge), one(huge), 0, 0).passed);
    EXPECT_FALSE(compareImages(one(huge), one(TypeParam(inf)), 1e30, 1).passed);
}

TEST(Compare, anyOneChangedValueIsFoundWithItsPlace) {
    cv::RNG random(7);
    cv::Mat b(9, 13, CV_32FC4);
    random.fill(b, cv::RNG::UNIFORM, -2, 2);
    ASSERT_TRUE(compareImages(b, b, 0, 0).passed);
    for (int k = 0; k < 60; k++) {
        cv::Mat a = b.clone();
        cv::Point place(random.uniform(0, b.cols), random.uniform(0, b.rows));
        int channel = random.uniform(0, 4);
        float& value = a.ptr<cv::Vec4f>(place.y)[place.x][channel];
        value = k % 3 == 0 ? nan : k % 3 == 1 ? inf : value + 1e-3f;
        Comparison c = compareImages(a, b, 1e-4, 0);
        EXPECT_FALSE(c.passed);
        EXPECT_EQ(c.failed, 1u);
        EXPECT_EQ(c.place, place);
        EXPECT_EQ(c.channel, channel);
        EXPECT_EQ(std::isnan(c.a), std::isnan(value));
        EXPECT_EQ(float(c.b), b.ptr<cv::Vec4f>(place.y)[place.x][channel]);
        EXPECT_EQ(c.compared, b.total());
    }
}

TEST(Compare, meanIsOverFinitePairs) {
    cv::Mat a = (cv::Mat_<float>(1, 4) << 1, 2, inf, nan), b = (cv::Mat_<float>(1, 4) << 0, 0, inf, nan);
    Comparison c = compareImages(a, b, 10, 0);
    EXPECT_TRUE(c.passed);
    EXPECT_DOUBLE_EQ(c.mean, 1.5);
    EXPECT_DOUBLE_EQ(c.worst, 2);
}

TEST(Compare, allowanceWidensOnlyItsOwnPixel) {
    cv::Mat a = (cv::Mat_<float>(1, 2) << .5f, .5f), b = cv::Mat::zeros(1, 2, CV_32F);
    cv::Mat allowance = (cv::Mat_<double>(1, 2) << 1, 0);
    Comparison c = compareImages(a, b, .1, 0, allowance);
    EXPECT_EQ(c.failed, 1u);
    EXPECT_EQ(c.place, cv::Point(1, 0));
    // An allowance that is not a number excuses nothing.
    EXPECT_FALSE(compareImages(a, b, .1, 0, cv::Mat(1, 2, CV_64F, std::nan(""))).passed);
}

TEST(Compare, ambiguousPixelsAreCountedNotCompared) {
    cv::Mat a = (cv::Mat_<float>(1, 3) << 1, nan, 1), b = cv::Mat::ones(1, 3, CV_32F);
    cv::Mat ambiguous = (cv::Mat_<uint8_t>(1, 3) << 0, 1, 0);
    Comparison c = compareImages(a, b, 0, 0, {}, ambiguous);
    EXPECT_TRUE(c.passed);
    EXPECT_EQ(c.leftOut, 1u);
    EXPECT_EQ(c.compared, 2u);
}

TEST(Compare, floatAgainstDoubleIsExact) {
    cv::Mat a = one(.1f), b = one(.1);
    EXPECT_FALSE(compareImages(a, b, 1e-9, 0).passed);
    EXPECT_TRUE(compareImages(a, b, 2e-9, 0).passed);
    EXPECT_FALSE(compareImages(one(nan), one(.1), 1, 1).passed);
}

TEST(Compare, unlikeShapesAreAnError) {
    cv::Mat a = cv::Mat::zeros(2, 2, CV_32F);
    EXPECT_THROW(compareImages(a, cv::Mat::zeros(2, 3, CV_32F), 1, 1), Error);
    EXPECT_THROW(compareImages(a, cv::Mat::zeros(2, 2, CV_32FC4), 1, 1), Error);
    EXPECT_THROW(compareImages(a, cv::Mat::zeros(2, 2, CV_8U), 1, 1), Error);
}

TEST(Compare, describeNamesPlaceAndBothValues) {
    cv::Mat b = cv::Mat::zeros(4, 6, CV_32FC4), a = b.clone();
    a.ptr<cv::Vec4f>(3)[5][2] = .25f;
    std::string line = compareImages(a, b, .1, 0).describe();
    EXPECT_NE(line.find("(5, 3) B: 0.25 against 0"), std::string::npos) << line;
}

TEST(Psnr, knownValues) {
    cv::Mat black(4, 4, CV_32FC4, cv::Scalar::all(0)), white(4, 4, CV_32FC4, cv::Scalar::all(1));
    EXPECT_NEAR(psnrEncoded(black, white), 0, 1e-12);
    EXPECT_EQ(psnrEncoded(white, white), std::numeric_limits<double>::infinity());
    // Encoded .5 is linear .21404...: a difference of half the range is 6.02 dB.
    cv::Mat middle(4, 4, CV_32FC4, cv::Scalar::all(.2140411));
    EXPECT_NEAR(psnrEncoded(black, middle), 20 * std::log10(2.), 1e-4);
}

TEST(Psnr, clipsBothAndIgnoresAlpha) {
    cv::Mat a(3, 3, CV_32FC4, cv::Scalar(7, 2, -3, 0)), b(3, 3, CV_32FC4, cv::Scalar(1, 1, 0, 1));
    EXPECT_EQ(psnrEncoded(a, b), std::numeric_limits<double>::infinity());
}

TEST(Psnr, nanPassesNoBound) {
    cv::Mat a(3, 3, CV_32FC4, cv::Scalar::all(0)), b = a.clone();
    a.ptr<cv::Vec4f>(1)[1][0] = nan;
    EXPECT_TRUE(std::isnan(psnrEncoded(a, b)));
}

}  // namespace
