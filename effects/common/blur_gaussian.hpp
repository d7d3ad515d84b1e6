// The Gaussian's kernels for each method, in fp64.
#pragma once

#include "common/blur_design.hpp"

namespace blur {

/// The Gaussian at a distance in standard deviations, per deviation.
inline double gaussianDensity(double distance) {
    return std::exp(-.5 * distance * distance) / std::sqrt(2 * std::numbers::pi);
}

/// e^(-x²/2), x ≥ 0, as three damped oscillations, fitted for this project to the least L1 error (6.6e-6 of
/// the normalised kernel) by reweighted least squares; sampled at n/σ. In separate first-order complex
/// recursions, where a direct form of sixth order would lose all of fp32 at large σ.
inline Exponentials gaussianExponentials(double sigma) {
    Exponentials e;
    if (sigma <= 0) return e;
    const double fit[3][4] = {
        // damping, frequency, cosine, sine
        {2.212099799570418, 0.5286609970498182, 3.2263087047191443, 7.883203907905881},
        {2.183455794975312, 1.6217498079502488, -2.3981724685556642, -1.1258617151030124},
        {2.1158897242374044, 2.8641099119502025, 0.1718398283409157, -0.026722311953323974}};
    e.center = 0;
    for (const auto& [damping, frequency, cosine, sine] : fit) {
        Complex pole = std::exp(Complex(-damping, frequency) / sigma);
        e.terms.push_back({pole, Complex(cosine, -sine) * pole});
        e.center += cosine;
    }
    return normalised(e);
}

/// The row 2m of Pascal's triangle, whose variance is m/2, m the nearest to 2σ²; cut where the tails, moved
/// to the middle, change a separable pair by at most `tolerance`.
inline Half pascalTaps(double sigma, double tolerance) {
    double m = std::round(2 * sigma * sigma);
    Half half;
    double covered = 0;
    for (int t = 0; t <= m; t++) {
        half.push_back(std::exp(std::lgamma(2 * m + 1) - std::lgamma(m + t + 1) - std::lgamma(m - t + 1) -
                                2 * m * std::numbers::ln2));
        covered += (t ? 2 : 1) * half.back();
        if (4 * (1 - covered) <= tolerance) break;
    }
    return normalised(half);
}

/// The coarsest decimation whose error, of a separable pair, is at most `tolerance`, from 1e-3 down to 1e-6.
/// Small factors have room for more boxes, which let a small pixel be larger: so each factor has its least σ
/// per small pixel, linear in the tolerance's logarithm between those given (measured over all positions of
/// an impulse, and tested).
inline Decimation gaussianDecimation(double sigma, double tolerance) {
    struct Way {
        int order;
        double leastSigma[4];  // at 1e-3, 1e-4, 1e-5, 1e-6
    };
    // Factors 2, 3, and from 4 on.
    constexpr Way ways[] = {
        {10, {1.29, 1.52, 1.8, 2.2}}, {8, {1.29, 1.55, 1.93, 2.45}}, {6, {1.45, 1.85, 2.5, 4}}};
    const double decades = std::clamp(-3 - std::log10(tolerance), 0., 3.);
    const int decade = std::min(int(decades), 2);
    for (int factor = largestFactor; factor > 1; factor--) {
        const Way& way = ways[std::min(factor, 4) - 2];
        const double* least = way.leastSigma + decade;
        if (sigma >= std::lerp(least[0], least[1], decades - decade) * factor)
            return boxDecimation(factor, way.order);
    }
    return {};
}
inline int gaussianFactor(double sigma, double tolerance) {
    return gaussianDecimation(sigma, tolerance).factor;
}

inline int gaussianSmallReach(double sigma, double tolerance) {
    const Decimation d = gaussianDecimation(sigma, tolerance);
    if (d.factor == 1) return gaussianReach(sigma, tolerance);
    double left = std::sqrt(d.smallVariance(std::pow(sigma / d.factor, 2)));
    return std::max(1, gaussianReach(left, std::clamp(.7 * tolerance, 7e-7, 2.5e-4)));
}
inline Half gaussianSmallTaps(double sigma, double tolerance) {
    const Decimation d = gaussianDecimation(sigma, tolerance);
    int reach = gaussianSmallReach(sigma, tolerance);
    if (d.factor == 1) return gaussianTaps(sigma, reach);
    return smallTaps(d, reach, [&](double theta) {
        theta = std::remainder(theta, 2 * std::numbers::pi);
        return std::exp(-.5 * sigma * sigma * theta * theta);
    });
}

/// Extended box: a box of 2·reach + 1 and a share of one more pixel at each end, of which three in a row have
/// exactly the variance σ² (Gwosdek et al. 2011).
struct ExtendedBox {
    int reach = 0;
    double share = 0;
};
inline ExtendedBox extendedBox(double sigma) {
    double variance = sigma * sigma / 3;  // of one box
    ExtendedBox box;
    box.reach = int((std::sqrt(12 * variance + 1) - 1) / 2);
    double r = box.reach;
    // Variance of the extended box: (Σ_{-r}^{r} i² + 2·share·(r + 1)²)/(2r + 1 + 2·share).
    box.share =
        (variance * (2 * r + 1) - r * (r + 1) * (2 * r + 1) / 3) / (2 * ((r + 1) * (r + 1) - variance));
    return box;
}

}  // namespace blur
