// Separable FIRs on the CPU are the sums of their taps whatever their reach, the image's size, where its rows
// lie, the threads and how it is written, and bad pixels count as what copyFinite makes of them.
#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/core.hpp>

#include "common/blur_cpu.hpp"

using namespace blur;

namespace {

// Taps that all differ and add up to 1.
std::vector<float> unevenTaps(int reach, cv::RNG& random) {
    std::vector<float> half(size_t(reach) + 1);
    double sum = 0;
    for (int t = 0; t <= reach; t++) half[t] = random.uniform(.1f, 1.f), sum += (t ? 2 : 1) * half[t];
    for (float& tap : half) tap = float(tap / sum);
    return half;
}

// What of each input pixel each output pixel takes along one axis.
cv::Mat sharesAlong(int length, const std::vector<float>& half) {
    const int reach = int(half.size()) - 1;
    cv::Mat shares = cv::Mat::zeros(length, length, CV_64F);
    for (int i = 0; i < length; i++)
        for (int t = -reach; t <= reach; t++)
            shares.at<double>(i, std::clamp(i + t, 0, length - 1)) += half[std::abs(t)];
    return shares;
}

cv::Mat filtered(const cv::Mat& in, const std::vector<float>& half) {
    cv::Mat finite = in.clone(), channels[4], result;
    for (int y = 0; y < in.rows; y++) copyFinite(finite.ptr<float>(y), in.ptr<float>(y), 4 * in.cols);
    finite.convertTo(finite, CV_64F);
    cv::split(finite, channels);
    for (cv::Mat& channel : channels)
        channel = sharesAlong(in.rows, half) * channel * sharesAlong(in.cols, half).t();
    cv::merge(channels, 4, result);
    return result;
}

}  // namespace

TEST(SeparableFir, IsTheSumOfItsTaps) {
    const int threads = cv::getNumThreads();
    cv::RNG random(1);
    for (int reach : {0, 1, 5, 12, 13, 32, 33, 129, 257, 300})
        for (cv::Size size : {cv::Size(1, 1), {3, 70}, {37, 9}, {64, 41}, {256, 230}})
            for (bool isBad : {false, true}) {
                const std::vector<float> half = unevenTaps(reach, random);
                cv::Mat image(size, CV_32FC4);
                random.fill(image, cv::RNG::UNIFORM, -1, 2);
                double largest = 2;
                if (isBad) {
                    const cv::Point corner(size.width - 1, size.height - 1);
                    image.at<cv::Vec4f>(corner)[3] = HUGE_VALF, image.at<cv::Vec4f>(0, 0)[1] = NAN;
                    largest = 65504;
                }
                const cv::Mat wanted = filtered(image, half);
                cv::Mat first;
                for (int threadCount : {1, 2})
                    for (bool streams : {false, true})
                        for (int padding :
                             {4, 5}) {  // rows that begin where a line of the cache does, or not
                            cv::Mat whole(size.height, (size.width + 3) / 4 * 4 + padding, CV_32FC4,
                                          cv::Scalar::all(-7));
                            cv::Mat out = whole.colRange(0, size.width);
                            cv::setNumThreads(threadCount);
                            separableFir(image, out, half, streams);
                            const std::string what = cv::format(
                                "reach %d, %d x %d, bad %d, %d threads, streams %d, padding %d", reach,
                                size.width, size.height, isBad, threadCount, streams, padding);
                            const cv::Mat beside = whole.colRange(size.width, whole.cols);
                            EXPECT_EQ(cv::norm(beside + cv::Scalar::all(7), cv::NORM_INF), 0) << what;
                            if (first.empty()) {
                                first = out.clone();
                                EXPECT_TRUE(cv::checkRange(out)) << what;
                                cv::Mat exact;
                                out.convertTo(exact, CV_64F);
                                EXPECT_LE(cv::norm(exact, wanted, cv::NORM_INF), 1e-6 * largest) << what;
                            }
                            EXPECT_EQ(cv::norm(first, out, cv::NORM_INF), 0) << what;
                        }
            }
    cv::setNumThreads(threads);
}

// A pair of taps is added before it is weighed: pixels that are finite, but two of which are not together,
// must not become infinite, nor two such sums NaN.
TEST(SeparableFir, FinitePixelsGiveFiniteSums) {
    cv::Mat image(60, 60, CV_32FC4);
    for (int y = 0; y < image.rows; y++)
        for (int x = 0; x < image.cols; x++)
            image.at<cv::Vec4f>(y, x) = cv::Vec4f::all(x / 6 % 2 ? 2.5e38f : y / 6 % 2 ? -2.5e38f : 3.4e38f);
    for (int reach : {1, 2, 9, 20, 40}) {
        const std::vector<float> half(size_t(reach) + 1, 1.0f / float(2 * reach + 1));
        cv::Mat out(image.size(), CV_32FC4);
        separableFir(image, out, half);
        EXPECT_TRUE(cv::checkRange(out)) << reach;
        EXPECT_GT(cv::norm(out, cv::NORM_INF), 1e37) << reach;
    }
}
