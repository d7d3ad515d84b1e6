// The ladder of blurred images that fog_blur interpolates, and how: computed once in fp64.
#pragma once

#include <bit>

#include "common/blur_gaussian.hpp"

namespace fog_blur {

/// One blurred image: a Gaussian of `sigma` px, on an image decimated by `factor`.
struct Level {
    double sigma = 0;
    int factor = 1, reach = 0, width = 0, height = 0;
};

/// How close the levels lie, and how exact each of them is. Variances of an octave are evenly apart, so that
/// the bits of a pixel's own variance say which it lies between.
struct Spacing {
    int rungs;          ///< levels in a doubling of the variance
    double top;         ///< the largest variance, of where its octave begins
    double smallSigma;  ///< px of a small image, at least
    double tolerance;   ///< of one level's kernel
};
/// Of one rung, the last level, which has none beyond, is less far: the four levels nearest a variance below
/// it then err no more than the four round another (.014 and .016). Of more, the last steps of an octave are
/// the smallest: errors are .0014 and .0012 of two, 1.3e-4 of four, 1.4e-5 of eight.
inline Spacing spacingOf(int rungs) {
    if (rungs == 1) return {1, 1.75, 1.45, 3e-3};
    if (rungs == 2) return {2, 2, 1.8, 1e-3};
    return {rungs, 2, 2.4, 2e-4};
}
constexpr int mostRungs = 8;
/// Where in its octave the last interval begins.
inline double lastFrom(const Spacing& s) { return s.rungs == 1 ? 1 : 2 - 1. / s.rungs; }

/// Four boxes before and after: a cubic B-spline up. From 1.45 px per small pixel on they keep .0035 (.006
/// where the factor is 2; measured, over all positions).
constexpr int boxCount = 4;
inline int factorOf(double sigma, const Spacing& s) {
    const double small = s.rungs == 1 && sigma < 4.35 ? 1.41 : s.smallSigma;
    return std::clamp(int(sigma / small), 1, blur::largestFactor);
}
inline blur::Decimation decimationOf(const Level& level) {
    return blur::boxDecimation(level.factor, boxCount);
}
inline int prefilterReach(int factor) { return boxCount / 2 * (factor - 1); }

inline int reachOf(const Level& level, double tolerance) {
    if (level.factor == 1) return blur::gaussianReach(level.sigma, tolerance);
    const double variance = std::pow(level.sigma / level.factor, 2);
    return blur::gaussianReach(std::sqrt(decimationOf(level).smallVariance(variance)), .1 * tolerance);
}
inline blur::Half tapsOf(const Level& level) {
    if (level.factor == 1) return blur::gaussianTaps(level.sigma, level.reach);
    return blur::smallTaps(decimationOf(level), level.reach, [&](double theta) {
        theta = std::remainder(theta, 2 * std::numbers::pi);
        return std::exp(-.5 * level.sigma * level.sigma * theta * theta);
    });
}

/// The first level is under .57 px, of twice the rungs under .7 of that. Level 0, the sharp image, is not in
/// the list.
inline std::vector<Level> ladderOf(double largest, int width, int height, const Spacing& s) {
    largest = std::max(largest, .05);
    const double before = largest / std::sqrt(s.top);  // where the last octave begins
    const int octaves = std::max(
                  0, int(std::floor(2 * std::log2(before / .4))) + std::countr_zero(unsigned(s.rungs))),
              steps = s.rungs * (octaves + 1);
    std::vector<Level> levels;
    for (int l = 0; l <= steps; l++) {
        Level level;
        level.sigma =
            l == steps
                ? largest
                : before * std::sqrt(std::exp2(l / s.rungs - octaves) * (1 + double(l % s.rungs) / s.rungs));
        level.factor = factorOf(level.sigma, s);
        level.reach = reachOf(level, s.tolerance);
        level.width = blur::smallLength(width, level.factor);
        level.height = blur::smallLength(height, level.factor);
        levels.push_back(level);
    }
    return levels;
}

/// Samples of the weights in each interval of variance, and the levels they belong to: `firstNode` and the
/// next three.
constexpr int samplesPerInterval = 17;
inline int firstNode(int interval, int levelCount) {
    return std::clamp(interval - 1, 0, std::max(0, levelCount - 3));
}

/// Weights of four neighbouring levels whose sum is nearest a Gaussian of `variance` in least squares over
/// the plane, the weights adding to 1. Inner products of round Gaussians are squares of those of their rows.
inline std::vector<double> nodeWeights(const std::vector<double>& sigmas, double variance) {
    const int n = int(sigmas.size()), reach = int(7 * sigmas.back()) + 3;
    std::vector<blur::Half> kernels;
    for (double sigma : sigmas) kernels.push_back(blur::gaussianTaps(sigma, reach));
    kernels.push_back(blur::gaussianTaps(std::sqrt(variance), reach));
    for (auto& kernel : kernels) kernel.resize(reach + 1, 0);
    auto product = [&](int a, int b) {
        double sum = kernels[a][0] * kernels[b][0];
        for (int t = 1; t <= reach; t++) sum += 2 * kernels[a][t] * kernels[b][t];
        return sum * sum;
    };
    // Normal equations bordered by the constraint; a trace of the diagonal keeps equal kernels solvable.
    std::vector<std::vector<double>> m(n + 1, std::vector<double>(n + 2, 0));
    for (int a = 0; a < n; a++) {
        for (int b = 0; b < n; b++) m[a][b] = product(a, b) * (a == b ? 1 + 1e-9 : 1);
        m[a][n] = m[n][a] = 1;
        m[a][n + 1] = product(a, n);
    }
    m[n][n + 1] = 1;
    for (int c = 0; c <= n; c++) {
        int pivot = c;
        for (int r = c; r <= n; r++)
            if (std::abs(m[r][c]) > std::abs(m[pivot][c])) pivot = r;
        std::swap(m[c], m[pivot]);
        for (int r = 0; r <= n; r++)
            if (r != c) {
                double f = m[r][c] / m[c][c];
                for (int k = c; k <= n + 1; k++) m[r][k] -= f * m[c][k];
            }
    }
    std::vector<double> weights(4, 0);
    for (int a = 0; a < n; a++) weights[a] = m[a][n + 1] / m[a][a];
    return weights;
}

/// [interval][sample][4], sample s at (s/16) of the interval's variance; and one more row to look at beyond
/// the last. At a level itself the weights are that level alone, exactly.
inline std::vector<double> ladderWeights(const std::vector<Level>& levels, int rungs) {
    const int count = int(levels.size()), row = 4 * samplesPerInterval;
    auto sigmasOf = [&](int interval) {
        std::vector<double> sigmas;
        const int first = firstNode(interval, count);
        for (int node = first; node <= std::min(first + 3, count); node++)
            sigmas.push_back(node == 0 ? 0 : levels[node - 1].sigma);
        return sigmas;
    };
    // An octave further up the ratios, and so the weights, are the same, once pixels are small beside the
    // blur.
    auto isLike = [&](const std::vector<double>& a, const std::vector<double>& b) {
        bool isLike = a.size() == b.size() && a[0] > 1;
        for (size_t k = 0; k < a.size() && isLike; k++)
            isLike = std::abs(b[k] / a[k] - std::numbers::sqrt2) < 1e-9;
        return isLike;
    };
    std::vector<double> table;
    for (int interval = 0; interval < count; interval++) {
        const std::vector<double> sigmas = sigmasOf(interval);
        if (interval > rungs && isLike(sigmasOf(interval - rungs), sigmas)) {
            const size_t from = size_t(interval - rungs) * row;
            table.resize(table.size() + row);
            std::copy_n(table.begin() + ptrdiff_t(from), row, table.end() - row);
            continue;
        }
        const int first = firstNode(interval, count);
        double low = interval == 0 ? 0 : levels[interval - 1].sigma, high = levels[interval].sigma;
        for (int s = 0; s < samplesPerInterval; s++) {
            const bool isLevel = s == 0 || s == samplesPerInterval - 1;
            double variance = low * low + (high * high - low * low) * s / (samplesPerInterval - 1);
            std::vector<double> weights(4, 0);
            if (isLevel)
                weights[interval + (s > 0) - first] = 1;
            else
                weights = nodeWeights(sigmas, variance);
            table.insert(table.end(), weights.begin(), weights.end());
        }
    }
    table.insert(table.end(), 4, 0.);
    return table;
}

}  // namespace fog_blur
