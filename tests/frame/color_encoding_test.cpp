#include "frame/color_encoding.hpp"

#include "frame_fixture.hpp"

namespace brume {
namespace {

using test::randomColor;

TEST(SrgbCurve, RowsMatchTheFp64Curve) {
    std::vector<float> x, y, back;
    for (double e = -40; e < 0; e += .0005) x.push_back(float(std::exp2(e)));
    for (float v = 0; v <= 1; v += 1e-5f) x.push_back(v);
    const int n = int(x.size());
    y.resize(n);
    back.resize(n);
    srgbEncodeRow(x.data(), y.data(), n);
    srgbDecodeRow(x.data(), back.data(), n);
    double encodeError = 0, decodeError = 0;
    for (int i = 0; i < n; ++i) {
        encodeError = std::max(encodeError, std::abs(y[i] - srgbEncode(x[i])));
        decodeError = std::max(decodeError, std::abs(back[i] - srgbDecode(x[i])));
    }
    // Measured: 2.1e-7 and 2.7e-7, a 16-bit step is 1.5e-5.
    EXPECT_LT(encodeError, 4e-7);
    EXPECT_LT(decodeError, 5e-7);
}

TEST(SrgbCurve, ClassesAndSignsSurvive) {
    const float inf = INFINITY;
    const float x[8] = {0, -0.0f, inf, -inf, NAN, -.5f, 5e4f, 1e30f};
    float y[8], z[8];
    srgbEncodeRow(x, y, 8);
    srgbDecodeRow(x, z, 8);
    for (const float* out : {y, z}) {
        EXPECT_EQ(out[0], 0);
        EXPECT_EQ(out[2], inf);
        EXPECT_EQ(out[3], -inf);
        EXPECT_TRUE(std::isnan(out[4]));
        EXPECT_LT(out[5], 0);
    }
    EXPECT_NEAR(y[5], -srgbEncode(.5), 1e-6);
    EXPECT_NEAR(y[6] / srgbEncode(5e4), 1, 2e-6);
}

TEST(SrgbCurve, EightBitsThereAndBackAreTheIdentity) {
    cv::Mat bytes(16, 16, CV_8UC3);
    for (int k = 0; k < 256; ++k) bytes.at<cv::Vec3b>(k / 16, k % 16) = cv::Vec3b(k, 255 - k, (k * 7) & 255);
    for (uint32_t seed = 0; seed < 50; ++seed) {
        const cv::Mat again = toSrgb8(toLinearRgba(bytes, true), false, 0, seed);
        ASSERT_EQ(cv::norm(bytes, again, cv::NORM_INF), 0) << "seed " << seed;
    }
}

TEST(Dither, KeepsTheMean) {
    // A value between two steps must come out as its neighbours in proportion, each pixel by its own number.
    cv::Mat flat(256, 256, CV_32F, cv::Scalar(srgbDecode(100.3 / 255)));
    const cv::Mat bytes = toSrgb8(flat, false, 3, 9);
    const double mean = cv::mean(bytes)[0];
    EXPECT_NEAR(mean, 100.3, 4 * .46 / 256);  // 4 σ of the mean of 65536 draws
    double low, high;
    cv::minMaxLoc(bytes, &low, &high);
    EXPECT_EQ(low, 100);
    EXPECT_EQ(high, 101);
}

TEST(Dither, DependsOnFrameAndSeedOnly) {
    const cv::Mat image = randomColor({97, 31}, 0, 1, 5);
    const cv::Mat first = toSrgb8(image, false, 7, 11);
    EXPECT_EQ(cv::norm(first, toSrgb8(image, false, 7, 11), cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(first, toSrgb8(image, false, 8, 11), cv::NORM_INF), 1);
    EXPECT_EQ(cv::norm(first, toSrgb8(image, false, 7, 12), cv::NORM_INF), 1);
}

TEST(Dither, ClipsWhatNoByteHolds) {
    cv::Mat image(1, 6, CV_32F);
    const float values[] = {NAN, -1, INFINITY, -INFINITY, 7, 0};
    std::copy(values, values + 6, image.ptr<float>());
    const cv::Mat bytes = toSrgb8(image, false, 0, 0);
    const uchar wanted[] = {0, 0, 255, 0, 255, 0};
    for (int i = 0; i < 6; ++i) EXPECT_EQ(bytes.at<uchar>(0, i), wanted[i]) << i;
}

TEST(ToLinearRgba, SpreadsGreyAndNeverDecodesAlpha) {
    cv::Mat greyAlpha(1, 1, CV_16UC2, cv::Scalar(32768, 32768));
    const cv::Vec4f p = toLinearRgba(greyAlpha, true).at<cv::Vec4f>(0, 0);
    EXPECT_FLOAT_EQ(p[0], float(srgbDecode(32768 / 65535.)));
    EXPECT_EQ(p[0], p[1]);
    EXPECT_EQ(p[0], p[2]);
    EXPECT_FLOAT_EQ(p[3], float(32768 / 65535.));
    cv::Mat floats(1, 1, CV_32FC4, cv::Scalar(.5, .25, 2, .5));
    const cv::Vec4f q = toLinearRgba(floats, true).at<cv::Vec4f>(0, 0);
    EXPECT_NEAR(q[2], srgbDecode(2), 1e-5);
    EXPECT_EQ(q[3], .5f);
}

}  // namespace
}  // namespace brume
