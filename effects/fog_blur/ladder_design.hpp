// The ladder of blurred images that fog_blur interpolates, and how: computed once in fp64.
#pragma once

#include "common/blur_gaussian.hpp"

namespace fog_blur {

/// One blurred image: a Gaussian of `sigma` px, on an image decimated by `factor`.
struct Level {
    double sigma = 0;
    int factor = 1, reach = 0, width = 0, height = 0;
};

constexpr double levelTolerance = 3e-3;  ///< of one level's kernel; interpolating errs by .016

/// Four boxes before and after: a cubic B-spline up. From 1.45 px per small pixel on they keep .0035 (.006
/// where the factor is 2; measured, over all positions).
constexpr int boxCount = 4;
inline int factorOf(double sigma) {
    return std::clamp(int(sigma / (sigma < 4.35 ? 1.41 : 1.45)), 1, blur::largestFactor);
}
inline blur::Decimation decimationOf(const Level& level) {
    return blur::boxDecimation(level.factor, boxCount);
}
inline int prefilterReach(int factor) { return boxCount / 2 * (factor - 1); }

inline int reachOf(const Level& level) {
    if (level.factor == 1) return blur::gaussianReach(level.sigma, levelTolerance);
    const double variance = std::pow(level.sigma / level.factor, 2);
    return blur::gaussianReach(std::sqrt(decimationOf(level).smallVariance(variance)), .1 * levelTolerance);
}
inline blur::Half tapsOf(const Level& level) {
    if (level.factor == 1) return blur::gaussianTaps(level.sigma, level.reach);
    return blur::smallTaps(decimationOf(level), level.reach, [&](double theta) {
        theta = std::remainder(theta, 2 * std::numbers::pi);
        return std::exp(-.5 * level.sigma * level.sigma * theta * theta);
    });
}

/// Variances double from level to level, the first under .57 px; but to the last, the largest wanted, which
/// has none beyond, it is only this much: the four levels nearest a variance below it then err no more than
/// the four round another (.014 and .016). Level 0, the sharp image, is not in the list.
constexpr double lastRatio = 1.75;
inline std::vector<Level> ladderOf(double largest, int width, int height) {
    largest = std::max(largest, .05);
    const double before = largest / std::sqrt(lastRatio);
    const int steps = std::max(1, int(std::floor(2 * std::log2(before / .4))) + 1);
    std::vector<Level> levels;
    for (int l = 1; l <= steps + 1; l++) {
        Level level;
        level.sigma = l > steps ? largest : before * std::exp2(.5 * (l - steps));
        level.factor = factorOf(level.sigma);
        level.reach = reachOf(level);
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
inline std::vector<double> ladderWeights(const std::vector<Level>& levels) {
    const int count = int(levels.size());
    std::vector<double> table;
    for (int interval = 0; interval < count; interval++) {
        int first = firstNode(interval, count);
        std::vector<double> sigmas;
        for (int node = first; node <= std::min(first + 3, count); node++)
            sigmas.push_back(node == 0 ? 0 : levels[node - 1].sigma);
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
