// Kernels over registers of four pixels and over pairs of halves (common/four.hpp) give the same bits, and so
// do multiply-adds of one instruction and of a library's: what a machine without AVX-512, or without any of
// that, makes is what one with it does. Beside what this machine runs, both widths are compiled for any
// machine, which takes the long vectors through memory.
#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/core.hpp>

#include "common/blur_bessel.hpp"
#include "common/cascade.hpp"
#include "common/recursion.hpp"
#include "fog_blur/mix_cpu.hpp"

using namespace blur;

namespace {

std::vector<float> randomFloats(size_t count, int seed) {
    std::vector<float> x(count);
    cv::RNG random(seed);
    for (float& v : x) v = random.uniform(0, 20) ? random.uniform(-1.f, 2.f) : random.uniform(0.f, 900.f);
    return x;
}
std::vector<const float*> rowsOf(const std::vector<float>& x, int count, int floats) {
    std::vector<const float*> rows;
    for (int k = 0; k < count; k++) rows.push_back(x.data() + size_t(k) * floats);
    return rows;
}
std::vector<float*> rowsOf(std::vector<float>& x, int count, int floats) {
    std::vector<float*> rows;
    for (int k = 0; k < count; k++) rows.push_back(x.data() + size_t(k) * floats);
    return rows;
}
typedef InWhole<FusedByEach> PlainWhole;
// What a kernel is run over: as this machine runs it.
struct Chosen : Plain {};
#define KERNEL(name, ...) \
    (std::is_same_v<decltype(wide), Chosen> ? name(__VA_ARGS__) : name##By<decltype(wide)>(__VA_ARGS__))
// `make(wide, out)` fills 40000 floats.
template <class Make>
void expectSameBits(const char* what, Make make) {
    std::vector<float> whole(40000, -7), halves = whole, chosen = whole;
    make(PlainWhole(), whole.data()), make(Plain(), halves.data()), make(Chosen(), chosen.data());
    const size_t bytes = whole.size() * sizeof(float);
    EXPECT_EQ(std::memcmp(whole.data(), halves.data(), bytes), 0) << what;
    EXPECT_EQ(std::memcmp(chosen.data(), halves.data(), bytes), 0) << what << ", as this machine runs it";
    EXPECT_NE(*std::max_element(whole.begin(), whole.end()), -7) << what << " did nothing";
}

}  // namespace

TEST(WideKernels, FirsAndDecimationsGiveTheSameBits) {
    const std::vector<float> x = randomFloats(40000, 1), taps = randomFloats(64, 2);
    for (int pixels : {1, 7, 12, 35, 64, 101})
        for (int reach : {0, 1, 4, 9, 12, 13, 40}) {
            for (int first : {0, 3}) {
                const Stretch part = {taps.data(), first, reach};
                expectSameBits("along", [&](auto wide, float* out) {
                    KERNEL(firAlongShort, out, x.data() + 4 * reach, part, pixels, false, nullptr);
                });
                const auto rows = rowsOf(x, 2 * reach + acrossRows, 4 * pixels + 12);
                for (int outputs : {1, 5, 8})
                    expectSameBits("across", [&](auto wide, float* out) {
                        float* to[acrossRows];
                        for (int k = 0; k < outputs; k++) to[k] = out + 4 * pixels * k;
                        KERNEL(firAcrossShort, to, outputs, rows.data() + reach, 12, part, 4 * pixels);
                    });
            }
            const int quads = (reach + 4) / 4;
            std::vector<float> spread(16 * size_t(quads));
            for (size_t k = 0; k < spread.size(); k++) spread[k] = taps[k / 4];
            expectSameBits("decimated", [&](auto wide, float* out) {
                KERNEL(decimateLine, out, x.data(), spread.data(), quads, 3, pixels);
            });
        }
    const auto rows = rowsOf(x, blockRows, 4 * 101);
    for (bool isFresh : {true, false})
        for (int count = 1; count <= blockRows; count++)
            expectSameBits("added", [&](auto wide, float* out) {
                BlockSum sum = {out, {}, isFresh, blockRows - count, count};
                std::copy_n(taps.data(), blockRows, sum.weights);
                KERNEL(addBlocks, &sum, 1, rows.data(), 4 * 101, {});
            });
}

// Wherever in a register, or behind the last whole one.
TEST(WideKernels, FirsAcrossSeeSumsThatAreTooLargeToBeAdded) {
    const float half[] = {1, 0};
    for (float value : {2e38f, HUGE_VALF, NAN, 1.0f})
        for (int pixel : {0, 1, 2, 3, 4}) {
            std::vector<float> x(3 * 4 * 5, 0.5f), out(4 * 5);
            x[size_t(4 * 5 + 4 * pixel + 1)] = value;
            const auto rows = rowsOf(std::as_const(x), 3, 4 * 5);
            float* to = out.data();
            const Stretch taps = {half, 0, 1};
            const bool isFine = value == 1.0f;
            EXPECT_EQ(firAcrossShortBy<PlainWhole>(&to, 1, rows.data() + 1, 0, taps, 4 * 5), isFine) << pixel;
            EXPECT_EQ(firAcrossShortBy<Plain>(&to, 1, rows.data() + 1, 0, taps, 4 * 5), isFine) << pixel;
            EXPECT_EQ(firAcrossShort(&to, 1, rows.data() + 1, 0, taps, 4 * 5), isFine) << pixel;
        }
}

TEST(WideKernels, EnlargedRowsAreTheSameBits) {
    const std::vector<float> x = randomFloats(40000, 3), weights = randomFloats(6, 4),
                             phases = randomFloats(16 * 6 * 4, 5);
    const auto rows = rowsOf(x, 6, 4 * 200);
    for (int factor : {2, 3, 4, 5, 8, 9, 13, 16})
        for (int width : {1, 50, 333}) {
            expectSameBits("six", [&](auto wide, float* out) {
                KERNEL(enlargeRows, out, rows.data(), weights.data(), phases.data(), factor, width);
            });
            expectSameBits("four", [&](auto wide, float* out) {
                KERNEL(enlargeRowsByFour, out, rows.data(), weights.data(), phases.data(), factor, width);
            });
        }
}

TEST(WideKernels, RecursionsGiveTheSameBits) {
    const std::vector<float> x = randomFloats(40000, 6);
    for (double radius : {.6, 9.}) {
        const Exponentials e = besselExponentials(radius);
        const std::vector<double> exact = e.packed(), cascade = cascadeOf(e).packed();
        const std::vector<float> poles(exact.begin(), exact.end()), numbers(cascade.begin(), cascade.end());
        expectSameBits("lanes", [&](auto wide, float* out) {
            KERNEL(runLanes, out, x.data(), 77, poles.data(), 1, float(e.center), float(e.origin()));
        });
        CascadeNumbers n;
        std::memcpy(&n, numbers.data(), sizeof n);
        constexpr int width = 37, floats = 4 * width, room = (floats + 15) / 16 * 16;
        const auto rows = rowsOf(x, cascadeRows, room);
        expectSameBits("cascade", [&](auto wide, float* out) {
            std::vector<float> down(size_t(cascadeRows) * room), lanes(size_t(laneCount) * (width + 8)),
                states(2 * room), after(2 * room), back(2 * room), ends(2 * stateFloats);
            KERNEL(columnsBegin, states.data(), rows[0], floats, n.scale, n);
            EXPECT_TRUE(KERNEL(columnsApproach, rows.data(), states.data(), after.data(), floats, n));
            EXPECT_TRUE(KERNEL(columnsForward, rowsOf(down, cascadeRows, room).data(), rows.data(),
                               after.data(), states.data(), floats, n));
            KERNEL(columnsTurn, back.data(), states.data(), rows[7], floats, n);
            const std::vector<float>& made = down;
            KERNEL(columnsPass, back.data(), rowsOf(made, cascadeRows, room).data(), floats, n);
            // Eight rows, those again while the first are finished, and all but one of these.
            const auto come = rowsOf(made, cascadeRows, room);
            float* to[cascadeRows];
            for (int k = 0; k < cascadeRows; k++) to[k] = out + k * floats;
            CascadeStep step = {lanes.data(), false, back.data(), come.data(), ends.data(),
                                to,           0,     width,       false};
            KERNEL(columnsBackward, step, n);
            step.isMirrored = true, step.count = cascadeRows;
            KERNEL(columnsBackward, step, n);
            for (float*& row : to) row += cascadeRows * floats;
            step.isMirrored = false, step.rows = nullptr, step.count = cascadeRows - 1;
            KERNEL(columnsBackward, step, n);
        });
    }
}

TEST(WideKernels, RowsSideBySideAreTheSameBitsAndBadOnesAreSeen) {
    std::vector<float> x = randomFloats(40000, 7);
    const auto rows = rowsOf(x, 8, 4 * 41);
    std::vector<const float*> const8(rows.begin(), rows.end());
    expectSameBits("interleaved",
                   [&](auto wide, float* out) { EXPECT_TRUE(KERNEL(interleave, out, const8.data(), 41)); });
    expectSameBits("separated", [&](auto wide, float* out) {
        float* to[8];
        for (int k = 0; k < 8; k++) to[k] = out + 4 * 41 * k;
        KERNEL(separate, to, 7, x.data(), 41);
    });
    for (int bad : {0, 9, 14, 163})
        for (float value : {NAN, HUGE_VALF, -HUGE_VALF}) {
            const float before = std::exchange(rows[3][bad], value);
            std::vector<float> lanes(32 * 41);
            EXPECT_FALSE(interleaveBy<PlainWhole>(lanes.data(), const8.data(), 41)) << bad;
            EXPECT_FALSE(interleave(lanes.data(), const8.data(), 41)) << bad;
            rows[3][bad] = before;
        }
}

TEST(WideKernels, WeighedRowsAreMadeSharpAndDividedToTheSameBits) {
    constexpr int count = 119;
    std::vector<float> x = randomFloats(40000, 8);
    const auto rows = rowsOf(x, 4, 4 * count);
    for (int i = 0; i < count; i++)  // weights, some of which are next to nothing
        rows[0][4 * i + 3] = i % 3 ? .05f + float(i) / count : 1e-3f;
    const float* node = rows[0];
    expectSameBits("divided", [&](auto wide, float* out) {
        const fog_blur::MixedRow row = {nullptr, nullptr,  &node, rows[1], rows[3],
                                        true,    x.data(), out,   false,   count};
        KERNEL(fog_blur::mix, row);
        for (int i = 0; i < count; i++) {
            const float weight = std::max(node[4 * i + 3], .05f),
                        red = (node[4 * i] + (weight - node[4 * i + 3]) * rows[1][4 * i]) / weight;
            EXPECT_NEAR(out[4 * i], red, 1e-6f + 1e-6f * std::abs(red)) << i;
            EXPECT_EQ(out[4 * i + 3], rows[3][4 * i + 3]) << i;
        }
    });
    for (float value : {0.0f, NAN, HUGE_VALF, -HUGE_VALF})
        for (int pixel : {3, count - 1}) {
            rows[2][4 * pixel + 1] = value;
            expectSameBits("sharpened", [&](auto wide, float* out) {
                KERNEL(fog_blur::sharpen, out, rows[2], count);
                for (int i = 0; i < 4 * count; i++) EXPECT_TRUE(std::isfinite(out[i])) << i;
                EXPECT_EQ(out[4 * pixel + 1], std::isinf(value) ? std::copysign(65504.0f, value) : 0.0f);
                EXPECT_EQ(out[4 * pixel + 3], 1.0f);
            });
        }
}

// What is written past the caches, where rows wait to be finished until others come, whole or by a row's
// copy.
TEST(WideKernels, RecursionsPastTheCachesGiveTheSameBits) {
    for (double radius : {.5, 3., 12.})
        for (cv::Size size : {cv::Size(1, 1), {3, 8}, {5, 17}, {37, 21}, {64, 200}, {256, 331}, {30, 1500}}) {
            const Cascade cascade = cascadeOf(besselExponentials(radius));
            if (!isCascaded(size.height, cascade.reach)) continue;
            const std::vector<double> packed = cascade.packed();
            const std::vector<float> numbers(packed.begin(), packed.end());
            cv::Mat image(size, CV_32FC4);
            cv::RNG random(size.area());
            random.fill(image, cv::RNG::UNIFORM, -1, 2);
            auto blurred = [&](bool streams, int padding) {
                cv::Mat whole(size.height, (size.width + 3) / 4 * 4 + padding, CV_32FC4, cv::Scalar::all(-7));
                cv::Mat out = whole.colRange(0, size.width);
                cascadedBlur(image, out, numbers, cascade.reach, streams);
                const cv::Mat beside = whole.colRange(size.width, whole.cols) + cv::Scalar::all(7);
                EXPECT_EQ(cv::norm(beside, cv::NORM_INF), 0) << radius << " " << size;
                return out.clone();
            };
            const cv::Mat wanted = blurred(false, 4);
            EXPECT_NE(wanted.at<cv::Vec4f>(size.height - 1, size.width - 1)[3], -7);
            for (int padding : {4, 5})  // rows that begin where a line of the cache does, or not
                EXPECT_EQ(cv::norm(blurred(true, padding), wanted, cv::NORM_INF), 0)
                    << radius << " " << size << " " << padding;
        }
}
