// The numbers behind the blurs, computed once in fp64 and rounded to fp32 for both halves of an effect.
// Kernels are symmetric, so "half" means the centre tap and one side's; they are normalised to sum 1.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

namespace blur {

using Half = std::vector<double>;

inline Half normalised(Half half) {
    double sum = half[0];
    for (size_t t = 1; t < half.size(); t++) sum += 2 * half[t];
    for (double& w : half) w /= sum;
    return half;
}

/// A sampled Gaussian out to `reach`.
inline Half gaussianTaps(double sigma, int reach) {
    if (sigma <= 0) return {1};
    Half half(reach + 1);
    for (int t = 0; t <= reach; t++) half[t] = std::exp(-.5 * t * t / (sigma * sigma));
    return normalised(half);
}

/// The reach beyond which a Gaussian's tails, moved to its middle by normalising, change a separable pair by
/// at most `tolerance` (L1): both tails of both axes, each counted twice.
inline int gaussianReach(double sigma, double tolerance) {
    int reach = 0;
    while (std::erfc((reach + .5) / (sigma * std::numbers::sqrt2)) * 4 > tolerance) reach++;
    return reach;
}

/// DTFT of a half kernel at `theta` radians a tap.
inline double response(const Half& half, double theta) {
    double sum = half[0];
    for (size_t t = 1; t < half.size(); t++) sum += 2 * half[t] * std::cos(theta * double(t));
    return sum;
}

/// The quintic B-spline: a box of width 1, six of which in a row.
inline double bSpline(double x) {
    const double binomial[] = {1, -6, 15, -20, 15, -6, 1};
    double sum = 0,
           from = 3 - std::abs(x);  // by truncated powers; few are not 0, counted from the nearer end
    for (int n = 0; n <= 6 && from > n; n++) sum += binomial[n] * std::pow(from - n, 5);
    return sum / 120;
}

// A decimated blur: `prefilter`, every factor-th pixel, a small FIR, quintic B-spline up. (A cubic one lets
// through so much of the small image's repeated spectrum that 1e-4 would take twice as large a small image.)

/// Small pixels on each side beyond the first and last that lie within the image: one more than the prefilter
/// reaches, so that the outermost hold nothing but the replicated edge.
constexpr int smallMargin = 5;
inline int smallLength(int length, int factor) { return (length - 1) / factor + 1 + 2 * smallMargin; }

/// The Gaussian before decimation, in small px: its standard deviation, and its reach, beyond which it weighs
/// 3e-6. A factor of 1 decimates nothing.
constexpr double prefilterDeviation = .86;
constexpr int prefilterReach = 4;
inline Half prefilterTaps(int factor) {
    return factor == 1 ? Half{1, 0, 0, 0, 0}
                       : gaussianTaps(prefilterDeviation * factor, prefilterReach * factor);
}

/// Small pixels that make one of the enlarged image, from -2 to 3.
constexpr int enlargingTaps = 6;
/// [phase][6]: weights of small pixels -2 to 3 for the pixel `phase` px to the right of small pixel 0.
inline std::vector<double> enlargingWeights(int factor) {
    if (factor == 1) return {0, 0, 1, 0, 0, 0};
    std::vector<double> weights;
    for (int phase = 0; phase < factor; phase++)
        for (int m = -2; m <= 3; m++) weights.push_back(bSpline(double(phase) / factor - m));
    return weights;
}

/// What the small FIR's variance is, in squared small px, where the whole blur's is `variance`: the prefilter
/// and the spline (6/12) have theirs.
inline double smallVariance(double variance) {
    return std::max(.1, variance - prefilterDeviation * prefilterDeviation - .5);
}

/// The FIR on the small image. `target(theta)` is the spectrum of the blur wanted, theta in radians a px of
/// the large image. It is the least-squares one over all positions of an impulse between small pixels: S = Σ
/// T·P·B / (Σ P²·Σ B²), sums over the aliases of each small frequency, P the prefilter, B the B-spline.
template <class Target>
Half smallTaps(int factor, int reach, Target target) {
    Half prefilter = prefilterTaps(factor), spline(3 * factor), small(reach + 1, 0);
    for (int t = 0; t < 3 * factor; t++) spline[t] = bSpline(double(t) / factor);
    spline = normalised(spline);
    int frequencies = std::max(64, 4 * reach);  // of the half circle: more than the FIR can tell apart
    for (int n = 0; n <= frequencies; n++) {
        double omega = std::numbers::pi * n / frequencies, wanted = 0, p2 = 0, b2 = 0;
        for (int alias = 0; alias < factor; alias++) {
            double theta = (omega + 2 * std::numbers::pi * alias) / factor;
            double p = response(prefilter, theta), b = response(spline, theta);
            wanted += target(theta) * p * b, p2 += p * p, b2 += b * b;
        }
        double s = wanted / (p2 * b2), weight = n == 0 || n == frequencies ? .5 : 1;
        for (int t = 0; t <= reach; t++) small[t] += weight * s * std::cos(omega * t) / frequencies;
    }
    return normalised(small);
}

/// Largest factor: from there on the small image is too small to matter.
constexpr int largestFactor = 16;

using Complex = std::complex<double>;

/// A two-sided sum of exponentials: kernel(0) = center, kernel(n) = Re Σ amplitude·pole^(|n| - 1).
struct Exponentials {
    struct Term {
        Complex pole, amplitude;
    };
    double center = 1;
    std::vector<Term> terms;

    double at(int n) const {
        double sum = n == 0 ? center : 0;
        for (const Term& t : terms)
            if (n != 0) sum += (t.amplitude * std::pow(t.pole, std::abs(n) - 1)).real();
        return sum;
    }
    double response(double theta) const {
        double sum = center;
        for (const Term& t : terms)
            for (double sign : {-1., 1.}) {
                Complex turn = std::polar(1., sign * theta);
                sum += (t.amplitude * turn / (1. - t.pole * turn)).real();
            }
        return sum;
    }
    /// Four numbers a term: pole - 1 (delta form: fp32 keeps the little by which a pole misses 1), amplitude.
    std::vector<double> packed() const {
        std::vector<double> numbers;
        for (const Term& t : terms)
            for (double x : {t.pole.real() - 1, t.pole.imag(), t.amplitude.real(), t.amplitude.imag()})
                numbers.push_back(x);
        return numbers;
    }
};

inline Exponentials normalised(Exponentials e) {
    double sum = e.response(0);
    e.center /= sum;
    for (auto& t : e.terms) t.amplitude /= sum;
    return e;
}

/// The kernel of a causal filter with impulse response g0, Re(b·pole^(n - 1)) run forward, then backward.
inline Exponentials forwardAndBackward(double g0, Complex b, Complex pole) {
    Complex own = b / (1. - pole * pole), other = std::conj(b) / (1 - std::norm(pole));
    Exponentials e;
    e.terms = {{pole, b * (g0 + pole * .5 * (own + other))}};
    e.center = g0 * g0 + .5 * ((b * own).real() + std::norm(b) / (1 - std::norm(pole)));
    return normalised(e);
}

}  // namespace blur
