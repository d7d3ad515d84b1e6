// The second-order Bessel low-pass H(s) = 3/((sτ)² + 3sτ + 3), forward and back, in fp64.
#pragma once

#include "common/blur_design.hpp"
#include "common/blur_unseen.hpp"

namespace blur {

inline const Complex besselRoot{-1.5, std::numbers::sqrt3 / 2};  ///< of s² + 3s + 3

/// τ of a standard deviation.
inline double besselTau(double radius) { return radius / std::sqrt(2. / 3); }

/// The kernel at a distance in standard deviations, per deviation.
inline double besselDensity(double distance) {
    const double a = distance / besselTau(1);
    return std::exp(-1.5 * a) * std::cos(std::numbers::sqrt3 * a / 2 - std::numbers::pi / 3) / besselTau(1);
}

/// The two-sided kernel r(x) = e^(-1.5a)·cos(√3·a/2 - π/3)/τ, a = |x|/τ, integrated over each pixel. Its
/// integrals are again a damped oscillation, so a recursion gives them exactly.
inline Exponentials besselExponentials(double radius) {
    double tau = besselTau(radius);
    if (tau <= 0) return {};
    Complex pole = std::exp(besselRoot / tau), half = std::exp(besselRoot / (2 * tau));
    Complex integral = std::polar(1., -std::numbers::pi / 3) / besselRoot;
    Exponentials e;
    e.center = 2 * (integral * (half - 1.)).real();
    e.terms = {{pole, integral * (half * pole - half)}};
    return normalised(e);
}

/// The zero-order hold: each sample held for one pixel while the analogue filter runs.
inline Exponentials besselHold(double radius) {
    double tau = besselTau(radius);
    if (tau <= 0) return {};
    // The step response is 1 + Re(2·e^(2πi/3)·e^(s·t/τ)).
    Complex pole = std::exp(besselRoot / tau);
    return forwardAndBackward(0, std::polar(2., 2 * std::numbers::pi / 3) * (pole - 1.), pole);
}

/// The bilinear transform, s = k·(z - 1)/((z + 1)·τ) with k = 2τ: what GPU code commonly does.
inline Exponentials besselBilinear(double radius) {
    double k = 2 * besselTau(radius);
    if (k <= 0) return {};
    Complex pole = (k + besselRoot) / (k - besselRoot);
    double g0 = 3 / (k * k + 3 * k + 3);
    Complex b = 2 * g0 * (pole + 1.) * (pole + 1.) / (pole - std::conj(pole));
    return forwardAndBackward(g0, b, pole);
}

/// The kernel's taps out to where there is 1e-8 beyond.
inline Half besselWhole(double radius) {
    const Exponentials e = besselExponentials(radius);
    Half half;
    for (int t = 0, last = e.terms.empty() ? 0 : 1 + int(12 * besselTau(radius)); t <= last; t++)
        half.push_back(e.at(t));
    return half;
}

/// The fewest taps that keep a separable pair's error (L1) within `tolerance`, and what it is: what lies
/// beyond them is missing, and of what they are its sum is made up for.
struct Cut {
    Half taps = {1};
    double error = 0;
};
inline Cut besselCut(const Half& whole, double tolerance) {
    double norm = 0, missing = 0, sum = 0;
    for (size_t t = 0; t < whole.size(); t++) norm += (t ? 2 : 1) * std::abs(whole[t]);
    Cut cut;
    size_t size = whole.size();
    for (size_t t = whole.size() - 1; t > 0; t--) {
        missing += 2 * std::abs(whole[t]), sum += 2 * whole[t];
        const double axis = missing + (norm - missing) * std::abs(sum / (1 - sum)),
                     error = axis * (2 * norm + axis);
        if (error <= tolerance) size = t, cut.error = error;
    }
    cut.taps = normalised(Half(whole.begin(), whole.begin() + ptrdiff_t(size)));
    return cut;
}
inline Half besselTaps(double radius, double tolerance) {
    return besselCut(besselWhole(radius), tolerance).taps;
}

/// What a decimated pair errs by: what is left of the kernel's spectrum, ω^-4, beyond the small image's.
/// Whole pixels lie at few places of a small one where factors are small, and not at the worst. (Over all
/// positions of an impulse it comes to .96 of this for 7 and to .97 to .996 for others, from 3 deviations per
/// small pixel on; tested up to 5.)
inline double besselDecimationError(double radius, int factor) {
    constexpr double leading[] = {.857, .84, 1.009, .99, 1.068};  // factors 2, 3, 4, 5, and from 6 on
    const double ratio = radius / factor;
    return factor == 1
               ? 0
               : 1e-3 * leading[std::min(factor, 6) - 2] * (1 - .65 / ratio) * std::pow(3.4 / ratio, 4);
}

/// The largest that errs by at most `tolerance`, and 1e-3.
inline int besselFactor(double radius, double tolerance) {
    int factor = std::clamp(int(radius / 3), 1, largestFactor);
    while (factor > 1 && besselDecimationError(radius, factor) > std::min(tolerance, 1e-3)) factor--;
    return factor;
}

/// A tolerance that the factor just keeps, of those that are asked for.
inline double besselTolerance(double radius, int factor) {
    return std::clamp(1.0001 * besselDecimationError(radius, factor), 1e-6, 1e-3);
}

inline Decimation besselDecimation(int factor) { return boxDecimation(factor, 4); }

/// What is left of the small image's recursion where a FIR of it, or a band, ends: beside a light as bright
/// as infinity counts, 65504, it is a quarter of an 8-bit step of black.
constexpr double besselSmallCut = 1e-9;

/// A decimated blur's kernel is off along one axis where r bends, by what of its spectrum, ω^-4, lies beyond
/// the small image's; and far away by what is cut off there. (Measured at all positions of an impulse, and
/// tested.)
inline AxisError besselAxisError(double radius, int factor) {
    // Pixels lie at some places of a small one alone: those at its thirds are not where the kernel errs most.
    const double ratio = radius / factor, bend = std::pow(ratio, -4), places = factor == 3 ? .82 : 1;
    AxisError e;
    e.largest = [=](double distance) {
        const double apart = distance / factor;
        return places * bend / factor *
                   (.055 * std::exp(-.4 * apart * apart) + .0235 / ratio * std::exp(-apart / (.9 * ratio))) +
               besselSmallCut / radius;
    };
    e.step = .0187 * bend + 2 * besselSmallCut;
    e.beyond = [=](double distance) {
        const double apart = distance / factor,
                     far = .005 * std::sqrt(ratio) * std::exp((2 - apart) / (.9 * ratio));
        return places * bend * (apart < 1 ? .0685 : apart < 2 ? .03 + far : far) + 2 * besselSmallCut;
    };
    return e;
}

/// What runs on the small image: the wanted kernel's own recursion at a small pixel's steps, its amplitude
/// and centre tap such that beside the boxes, which keep polynomials of lower degree than 4, the whole has
/// the sum, the variance and the fourth moment that are wanted.
inline Exponentials besselSmall(double radius, int factor) {
    if (factor == 1) return besselExponentials(radius);
    // Second and fourth cumulants: of r, of a pixel's integral and of eight boxes of `factor` px.
    const double tau2 = std::pow(besselTau(radius), 2), f2 = double(factor) * factor;
    const double variance = (2 * tau2 / 3 + 1. / 12 - 8 * (f2 - 1) / 12) / f2,
                 fourth = (-4 * tau2 * tau2 / 3 - 1. / 120 + 8 * (f2 * f2 - 1) / 120) / (f2 * f2);
    const Complex pole = std::exp(besselRoot * double(factor) / besselTau(radius)), left = 1. - pole;
    // Σ n²·pole^(n - 1) and Σ n⁴·pole^(n - 1): twice the real part of amplitude times each is its moment.
    const Complex two = (1. + pole) / std::pow(left, 3),
                  four = (1. + pole) * (1. + 10. * pole + pole * pole) / std::pow(left, 5);
    const double of2 = variance / 2, of4 = (fourth + 3 * variance * variance) / 2,
                 determinant = two.imag() * four.real() - two.real() * four.imag();
    const Complex amplitude((of4 * two.imag() - of2 * four.imag()) / determinant,
                            (of4 * two.real() - of2 * four.real()) / determinant);
    Exponentials e;
    e.center = 1 - 2 * (amplitude / left).real();
    e.terms = {{pole, amplitude}};
    return e;
}

/// The same as a FIR.
inline Half besselSmallTaps(double radius, int factor) {
    const Exponentials e = besselSmall(radius, factor);
    if (e.terms.empty()) return {1};
    Half half;
    for (int t = 0, last = reachOf(e.terms[0].pole, besselSmallCut); t <= last; t++) half.push_back(e.at(t));
    return normalised(half);
}

}  // namespace blur
