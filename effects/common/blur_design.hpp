// The numbers behind the blurs, computed once in fp64 and rounded to fp32 for both halves of an effect.
// Kernels are symmetric, so "half" means the centre tap and one side's; they are normalised to sum 1.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <opencv2/core.hpp>
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

/// What a separable pair of Gaussians cut at `reach` errs by at most (L1): both tails of both axes, moved to
/// the middle by normalising, so each counted twice.
inline double gaussianCutError(double sigma, int reach) {
    return std::erfc((reach + .5) / (sigma * std::numbers::sqrt2)) * 4;
}
/// The least reach that errs by at most `tolerance`.
inline int gaussianReach(double sigma, double tolerance) {
    int reach = 0;
    while (gaussianCutError(sigma, reach) > tolerance) reach++;
    return reach;
}

/// DTFT of a half kernel at `theta` radians a tap.
inline double response(const Half& half, double theta) {
    double sum = half[0];
    for (size_t t = 1; t < half.size(); t++) sum += 2 * half[t] * std::cos(theta * double(t));
    return sum;
}

// A decimated blur: a prefilter, every factor-th pixel, a blur of the small image, and back up.

/// Small pixels on each side beyond the first and last that lie within the image: one more than a prefilter
/// reaches, so that the outermost hold nothing but the replicated edge.
constexpr int smallMargin = 5;
inline int smallLength(int length, int factor) { return (length - 1) / factor + 1 + 2 * smallMargin; }

/// Small pixels that make one of the enlarged image, from -2 to 3.
constexpr int enlargingTaps = 6;

/// Both half kernels in px of the large image; prefilter reaches at most 4·factor, enlarging (sum factor: of
/// one small pixel) less than 3·factor. A factor of 1 decimates nothing.
struct Decimation {
    int factor = 1;
    Half prefilter = {1}, enlarging = {1};

    /// What the small FIR's variance is, in squared small px, where the whole blur's is `variance`.
    double smallVariance(double variance) const {
        auto own = [&](const Half& half) {
            double sum = 0, moment = 0;
            for (size_t t = 0; t < half.size(); t++) {
                sum += (t ? 2 : 1) * half[t], moment += 2 * half[t] * double(t * t);
            }
            return moment / sum / (factor * factor);
        };
        return std::max(.1, variance - own(prefilter) - own(enlarging));
    }
};

/// `order` boxes of `factor` px in a row, before and after. The spectrum that every factor-th pixel folds
/// onto low frequencies then has a zero of that order there, and a polynomial of lower degree comes back from
/// the small image whole. (One with fewer taps than a Gaussian as good.)
inline Decimation boxDecimation(int factor, int order) {
    Decimation d;
    d.factor = factor;
    if (factor == 1) return d;
    Half whole = {1};
    for (int n = 0; n < order; n++) {
        Half longer(whole.size() + factor - 1, 0);
        for (size_t t = 0; t < whole.size(); t++)
            for (int k = 0; k < factor; k++) longer[t + k] += whole[t] / factor;
        whole = longer;
    }
    d.prefilter.assign(whole.begin() + ptrdiff_t(whole.size() / 2), whole.end());
    for (double w : d.prefilter) d.enlarging.push_back(w * factor);
    d.enlarging.erase(d.enlarging.begin());
    return d;
}

/// [phase][6]: weights of small pixels -2 to 3 for the pixel `phase` px to the right of small pixel 0.
inline std::vector<double> enlargingWeights(const Decimation& d) {
    std::vector<double> weights;
    for (int phase = 0; phase < d.factor; phase++)
        for (int m = -2; m <= 3; m++) {
            size_t distance = size_t(std::abs(phase - m * d.factor));
            weights.push_back(distance < d.enlarging.size() ? d.enlarging[distance] : 0.);
        }
    return weights;
}

/// The FIR on the small image. `target(theta)` is the spectrum of the blur wanted, theta in radians a px of
/// the large image. Of all of its reach that keep a constant it is the least-squares one over all positions
/// of an impulse between small pixels: it makes ∫ W·S² - 2·V·S least, W = Σ P²·Σ E² and V = Σ T·P·E sums over
/// the aliases of each small frequency, P the prefilter, E the enlarging.
template <class Target>
Half smallTaps(const Decimation& d, int reach, Target target) {
    const Half enlarging = normalised(d.enlarging);
    const int frequencies = std::max(64, 4 * reach);  // of the half circle: more than the FIR can tell apart
    // S = 1 + Σ small[t]·(2·cos(omega·t) - 2): a symmetric system of equations for all but the centre tap.
    cv::Mat system = cv::Mat::zeros(reach, reach, CV_64F), right = cv::Mat::zeros(reach, 1, CV_64F), taps;
    for (int n = 0; n <= frequencies; n++) {
        double omega = std::numbers::pi * n / frequencies, wanted = 0, p2 = 0, e2 = 0;
        for (int alias = 0; alias < d.factor; alias++) {
            double theta = (omega + 2 * std::numbers::pi * alias) / d.factor;
            double p = response(d.prefilter, theta), e = response(enlarging, theta);
            wanted += target(theta) * p * e, p2 += p * p, e2 += e * e;
        }
        const double weight = n == 0 || n == frequencies ? .5 : 1;
        cv::Mat wave(reach, 1, CV_64F);
        for (int t = 1; t <= reach; t++) wave.at<double>(t - 1) = 2 * std::cos(omega * t) - 2;
        system += weight * p2 * e2 * wave * wave.t();
        right += weight * (wanted - p2 * e2) * wave;
    }
    cv::solve(system, right, taps, cv::DECOMP_CHOLESKY);
    Half small = {1 - 2 * cv::sum(taps)[0]};
    small.insert(small.end(), taps.begin<double>(), taps.end<double>());
    return small;
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
    /// What poles are counted from, so that fp32 keeps the little by which they miss it: 1, or 0 where a
    /// pixel leaves the next less than half of the state.
    double origin() const {
        auto isSmall = [](const Term& t) { return std::abs(t.pole) < .5; };
        return std::all_of(terms.begin(), terms.end(), isSmall) ? 0 : 1;
    }
    /// Four numbers a term: pole - origin, amplitude.
    std::vector<double> packed() const {
        std::vector<double> numbers;
        for (const Term& t : terms)
            for (double x : {t.pole.real() - origin(), t.pole.imag(), t.amplitude.real(), t.amplitude.imag()})
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

/// Px beyond which no more than so much of an exponential is left.
inline int reachOf(Complex pole, double left = 7e-7) {
    return int(std::ceil(std::log(left) / std::log(std::abs(pole))));
}

/// A two-sided sum of one term, whose spectrum is above 0, as one real filter that runs forward and then
/// backward: v' = keep·v + s, s' = damping·s + x - pull·v, and what it gives is v' + slope·s' + before·v.
/// Poles near 1 take the delta form, keep = 1 and pull = |pole - 1|²: it keeps in fp32 the little by which
/// they miss 1. Others take the normal form, keep = damping = Re pole: a step rounds by no more than the
/// little that it leaves, so that dark pixels near a bright one are what they should be.
struct Cascade {
    /// What x is multiplied by, so that both ways along both axes keep a constant.
    double scale = 1;
    double keep = 1, damping = 0, pull = 1, slope = 1, before = 0;
    /// What lies beyond the last pixel is like it: off the steady state by (v, s) in front of it, the
    /// backward filter is off by this matrix times that.
    double end[4] = {};
    int reach = 0;  ///< reachOf(pole)

    /// v and s in the steady state that all x = 1 lead to.
    double steady = 1, steadySlope = 0;
    /// What is given there.
    double gain() const { return steady + slope * steadySlope + before * steady; }
    std::vector<double> packed() const {
        return {scale,  keep,   damping, pull,   slope,       before, end[0],
                end[1], end[2], end[3],  steady, steadySlope, gain()};
    }
};

inline Cascade cascadeOf(const Exponentials& e) {
    const Complex pole = e.terms[0].pole, amplitude = e.terms[0].amplitude;
    const double own[] = {1, -2 * pole.real(), std::norm(pole)},
                 side[] = {0, amplitude.real(), -(amplitude * std::conj(pole)).real()};
    // The spectrum is N(w)/|own|², w = z + 1/z, N = n[0] + n[1]·w + n[2]·(w² - 2).
    double n[3] = {};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            if (i >= j) n[i - j] += e.center * own[i] * own[j] + side[i] * own[j];
            if (j >= i) n[j - i] += side[i] * own[j];
        }
    // Its zeros inside the unit circle are the filter's.
    const Complex root = std::sqrt(Complex(n[1] * n[1] - 4 * n[2] * (n[0] - 2 * n[2])));
    Complex zeros[2];
    for (int k = 0; k < 2; k++) {
        const Complex w = ((k ? -root : root) - n[1]) / (2 * n[2]), apart = std::sqrt(w * w - 4.);
        zeros[k] = std::abs(w + apart) < std::abs(w - apart) ? (w + apart) / 2. : (w - apart) / 2.;
    }
    const double first = -(zeros[0] + zeros[1]).real(), second = (zeros[0] * zeros[1]).real();
    Cascade c;
    const bool isDelta = std::abs(pole) > .65;
    c.keep = isDelta ? 1 : pole.real();
    c.damping = 2 * pole.real() - c.keep;
    c.pull = isDelta ? std::norm(pole - 1.) : std::pow(pole.imag(), 2);
    c.slope = 1 / (c.keep + first), c.before = second * c.slope;
    c.steady = 1 / std::norm(pole - 1.), c.steadySlope = (1 - c.keep) * c.steady;
    c.scale = 1 / std::pow(c.gain(), 4);
    // Σ powersⁿ·(what the backward filter reads of the forward one)·powersⁿ, twice as many terms each time.
    double powers[] = {c.keep, 1, -c.pull, c.damping}, product[4], more[4],
           sum[] = {0, 0, c.keep - c.slope * c.pull + c.before, 1 + c.slope * c.damping};
    auto multiply = [](const double* a, const double* b, double* to) {
        for (int k = 0; k < 4; k++) to[k] = a[k / 2 * 2] * b[k % 2] + a[k / 2 * 2 + 1] * b[2 + k % 2];
    };
    for (int doubling = 0; doubling < 20; doubling++) {
        multiply(powers, sum, product), multiply(product, powers, more);
        for (int k = 0; k < 4; k++) sum[k] += more[k];
        multiply(powers, powers, product), std::copy(product, product + 4, powers);
    }
    std::copy(sum, sum + 4, c.end);
    c.reach = reachOf(pole);
    return c;
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
