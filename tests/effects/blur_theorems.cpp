#include "effects/blur_theorems.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apply/apply.hpp"
#include "cpu/cpu_runner.hpp"
#include "effect/plugin.hpp"
#include "effect/preset.hpp"
#include "error.hpp"
#include "gl/gl_runner.hpp"

namespace blur_test {

using namespace brume;

std::string Blur::describe() const {
    return text(effect, " ", method, " radius ", radius, " tolerance ", tolerance, isGlsl ? " GLSL" : "");
}

static FramePair frameOf(const cv::Mat& image) {
    FramePair frame;
    frame.color = image;
    frame.depth = cv::Mat(image.size(), CV_32F, cv::Scalar(10));
    frame.camera = Camera::withHorizontalView(image.size(), 90);
    return frame;
}
static Chain chainOf(const Blur& blur, const FramePair& frame, Backend backend) {
    std::string preset =
        text("{\"effects\": [{\"effect\": \"", blur.effect, "\", \"method\": \"", blur.method,
             "\", \"radius\": ", blur.radius, ", \"tolerance\": ", blur.tolerance, "}]}");
    return planChain(parsePreset(preset, "test", EffectRegistry::standard()), frame, backend, {});
}
static cv::Mat run(Runner& runner, const Blur& blur, const cv::Mat& image) {
    const FramePair frame = frameOf(image);
    return runner.run(chainOf(blur, frame, runner.backend()), frame, {}).images["color"].clone();
}
cv::Mat onCpu(const Blur& blur, const cv::Mat& image) {
    static auto runner = makeCpuRunner();
    return run(*runner, blur, image);
}
cv::Mat onGl(const Blur& blur, const cv::Mat& image) {
    static auto runner = makeGlRunner(GlPlatform::Osmesa);
    return run(*runner, blur, image);
}

cv::Mat blurred(const Blur& blur, const cv::Mat& image) {
    return blur.isGlsl ? onGl(blur, image) : onCpu(blur, image);
}

cv::Mat randomImage(cv::Size size, unsigned seed) {
    cv::Mat image(size, CV_32FC4);
    cv::RNG random(seed);
    random.fill(image, cv::RNG::UNIFORM, 0, 2);
    return image;
}

double difference(const cv::Mat& a, const cv::Mat& b) {
    double largest = 1e-30, worst = 0;
    for (int j = 0; j < b.rows; j++)
        for (int i = 0; i < 4 * b.cols; i++) {
            double x = a.ptr<float>(j)[i], y = b.ptr<float>(j)[i];
            if (!std::isfinite(x) || !std::isfinite(y)) return std::numeric_limits<double>::infinity();
            largest = std::max(largest, std::abs(y));
            worst = std::max(worst, std::abs(x - y));
        }
    return worst / largest;
}

OperatorError operatorError(const Blur& blur, const Kernel& truth, int period) {
    // The operator repeats every `period` px. Impulses at its positions, four at a time in the four channels,
    // give columns; moved by whole periods they give every row.
    const int reach = int(truth.size()) / 2, width = (2 * reach / period + 3) * period,
              middle = width / 2 / period * period;
    std::vector<std::vector<double>> columns(period, std::vector<double>(width));
    for (int first = 0; first < period; first += 4) {
        cv::Mat impulses(1, width, CV_32FC4, cv::Scalar::all(0));
        for (int c = 0; c < 4 && first + c < period; c++)
            impulses.at<cv::Vec4f>(0, middle + first + c)[c] = 1;
        const cv::Mat columnsOf = blurred(blur, impulses);
        for (int c = 0; c < 4 && first + c < period; c++)
            for (int i = 0; i < width; i++) columns[first + c][i] = columnsOf.at<cv::Vec4f>(0, i)[c];
    }
    auto entry = [&](int to, int from) {  // both relative to `middle`
        int phase = ((from % period) + period) % period, at = middle + to - (from - phase);
        return at >= 0 && at < width ? columns[phase][at] : 0;
    };
    OperatorError error;
    std::vector<Kernel>& rows = error.rows;
    for (int to = 0; to < period; to++) {
        Kernel row(truth.size());
        double sum = 0;
        for (int d = -reach; d <= reach; d++) {
            row[d + reach] = entry(to, to + d);
            sum += std::abs(row[d + reach] - truth[d + reach]);
        }
        error.oneAxis = std::max(error.oneAxis, sum);
        rows.push_back(row);
    }
    if (reach > 250) {  // |a⊗b - g⊗g| ≤ |a - g|·|b| + |g|·|b - g|
        double norm = 0;
        for (double w : truth) norm += std::abs(w);
        error.pair = error.oneAxis * (2 * norm + error.oneAxis);
        return error;
    }
    for (const Kernel& a : rows)
        for (const Kernel& b : rows) {
            double sum = 0;
            for (size_t i = 0; i < truth.size(); i++)
                for (size_t j = 0; j < truth.size(); j++) sum += std::abs(a[i] * b[j] - truth[i] * truth[j]);
            error.pair = std::max(error.pair, sum);
        }
    return error;
}

void expectWithinStatedError(const Blur& blur, const cv::Mat& image) {
    const FramePair frame = frameOf(image);
    const Chain chain = chainOf(blur, frame, Backend::Cpu);
    const auto& step = chain.steps.at(0);
    std::vector<cv::Point> pixels;
    for (int j = 0; j < image.rows; j++)
        for (int i = 0; i < image.cols; i++) pixels.emplace_back(i, j);
    std::vector<ReferencePixel> truth(pixels.size());
    const PluginEffect& plugin = *step.effect->plugin;
    plugin.reference(plugin.makeParams(step.values), {frame.camera, frame.size(), image, frame.depth}, pixels,
                     truth);
    const cv::Mat result = onCpu(blur, image);
    double used = 0;
    for (size_t k = 0; k < pixels.size(); k++)
        for (int n = 0; n < 4; n++)
            used = std::max(used, std::abs(result.at<cv::Vec4f>(pixels[k])[n] - truth[k].color[n]) /
                                      (truth[k].methodError + 1e-5 * truth[k].scale));
    EXPECT_LE(used, 1) << blur.describe() << " " << image.size();
}

void expectConstantsKept(const Blur& blur) {
    for (cv::Size size : {cv::Size(1, 1), cv::Size(37, 5), cv::Size(1, 23), cv::Size(70, 33)}) {
        cv::Mat image(size, CV_32FC4, cv::Scalar(.3, 1, 60000, .5)), result = blurred(blur, image);
        for (int c = 0; c < 4; c++) {
            double value = image.at<cv::Vec4f>(0, 0)[c];
            for (int j = 0; j < size.height; j++)
                for (int i = 0; i < size.width; i++)
                    ASSERT_NEAR(result.at<cv::Vec4f>(j, i)[c], value, 1e-5 * value)
                        << blur.describe() << " " << size;
        }
    }
}

void expectTransposed(const Blur& blur, double bound) {
    cv::Mat image = randomImage({61, 45}, 3), transposed, back;
    cv::transpose(image, transposed);
    cv::transpose(blurred(blur, transposed), back);
    EXPECT_LE(difference(back, blurred(blur, image)), bound) << blur.describe();
}

void expectMirrored(const Blur& blur, double bound, cv::Size size) {
    cv::Mat image = randomImage(size, 4), mirrored, back;
    cv::flip(image, mirrored, -1);
    cv::flip(blurred(blur, mirrored), back, -1);
    EXPECT_LE(difference(back, blurred(blur, image)), bound) << blur.describe();
}

void expectMeanKept(const Blur& blur, int reach, double bound) {
    cv::Mat image(2 * reach + 9, 2 * reach + 7, CV_32FC4, cv::Scalar::all(0));
    randomImage({7, 9}, 5).copyTo(image(cv::Rect(reach, reach, 7, 9)));
    cv::Scalar before = cv::sum(image), after = cv::sum(blurred(blur, image));
    for (int c = 0; c < 4; c++) EXPECT_NEAR(after[c], before[c], bound * before[c]) << blur.describe();
}

void expectStep(const Blur& blur, const Kernel& truth, double bound) {
    const int reach = int(truth.size()) / 2, width = 4 * reach + 2;
    cv::Mat image(3, width, CV_32FC4, cv::Scalar::all(0));
    image.colRange(width / 2, width).setTo(cv::Scalar::all(1));
    const cv::Mat result = blurred(blur, image);
    double sum = 0;  // of the kernel up to the distance from the step
    for (int i = width / 2 - reach - 1; i <= width / 2 + reach; i++) {
        int d = i - width / 2;
        if (d + reach >= 0) sum += truth[d + reach];
        ASSERT_NEAR(result.at<cv::Vec4f>(1, i)[0], sum, bound)
            << blur.describe() << " px from the step: " << d;
    }
}

void expectEdgesReplicate(const Blur& blur, int reach, double bound) {
    cv::Mat image = randomImage({13, 9}, 6), larger;
    cv::copyMakeBorder(image, larger, reach, reach, reach, reach, cv::BORDER_REPLICATE);
    cv::Mat inside = blurred(blur, larger)(cv::Rect(reach, reach, 13, 9));
    EXPECT_LE(difference(blurred(blur, image), inside), bound) << blur.describe();
}

void expectBadPixelsBounded(const Blur& blur) {
    const float infinity = std::numeric_limits<float>::infinity();
    cv::Mat bad = randomImage({41, 30}, 7), bounded = bad.clone();
    auto put = [&](int x, int y, int c, float value, float meant) {
        bad.at<cv::Vec4f>(y, x)[c] = value;
        bounded.at<cv::Vec4f>(y, x)[c] = meant;
    };
    put(20, 15, 0, std::nanf(""), 0);
    put(0, 0, 1, infinity, 65504);
    put(40, 29, 2, -infinity, -65504);
    put(7, 22, 3, std::nanf(""), 0);
    cv::Mat a = blurred(blur, bad), b = blurred(blur, bounded);
    EXPECT_EQ(cv::norm(a.reshape(1), b.reshape(1), cv::NORM_INF), 0) << blur.describe();
    EXPECT_TRUE(cv::checkRange(a)) << blur.describe();
}

void expectTheoremsInGlsl(Blur blur, const Kernel& truth, int period, double stepBound) {
    blur.isGlsl = true;
    EXPECT_LE(operatorError(blur, truth, period).pair, 1e-3) << blur.describe();
    expectConstantsKept(blur);
    expectStep(blur, truth, stepBound);
    expectTransposed(blur, 5e-6);
    expectMirrored(blur, period > 1 ? 1e-3 : 5e-6);
    expectBadPixelsBounded(blur);
}

void expectSameBitsOnAnyThreads(const Blur& blur) {
    cv::Mat image = randomImage({333, 217}, 8), first;
    int threads = cv::getNumThreads();
    for (int n : {1, 2, 3, 5}) {
        cv::setNumThreads(n);
        cv::Mat blurred = onCpu(blur, image);
        if (first.empty()) first = blurred;
        EXPECT_EQ(cv::countNonZero(blurred.reshape(1) != first.reshape(1)), 0)
            << blur.describe() << " threads " << n;
    }
    cv::setNumThreads(threads);
}

void expectGlMatches(const Blur& blur, cv::Size size) {
    cv::Mat image = randomImage(size, 9), gl = onGl(blur, image), cpu = onCpu(blur, image);
    for (int j = 0; j < size.height; j++)
        for (int i = 0; i < 4 * size.width; i++) {
            double a = gl.ptr<float>(j)[i], b = cpu.ptr<float>(j)[i];
            ASSERT_LE(std::abs(a - b), 2e-6 + 3e-5 * std::abs(b)) << blur.describe() << " " << i << " " << j;
        }
}

}  // namespace blur_test
