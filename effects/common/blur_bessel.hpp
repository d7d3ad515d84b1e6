// The second-order Bessel low-pass H(s) = 3/((sτ)² + 3sτ + 3), forward and back, in fp64.
#pragma once

#include "common/blur_design.hpp"

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

/// Taps out to where what is cut off changes a separable pair by at most `tolerance`.
inline Half besselTaps(double radius, double tolerance) {
    Exponentials e = besselExponentials(radius);
    if (e.terms.empty()) return {1};
    int last = 1 + int(12 * besselTau(radius));  // the tail beyond is 1e-8
    Half half;
    for (int t = 0; t <= last; t++) half.push_back(e.at(t));
    double tail = 0;
    while (half.size() > 1 && 4 * (tail + 2 * std::abs(half.back())) <= tolerance)
        tail += 2 * std::abs(half.back()), half.pop_back();
    return normalised(half);
}

/// What is left of the kernel's spectrum, ω^-4, beyond the small image's is what a decimated pair errs by. So
/// many standard deviations per small pixel keep that and the small FIR's tail under `tolerance`, at most
/// 1e-3 (measured over all positions of an impulse, and tested: .77 to .97 of it from 1e-3 to 1e-5).
inline double besselRatio(double tolerance) { return 3.4 * std::pow(1e-3 / std::min(tolerance, 1e-3), .25); }
inline int besselFactor(double radius, double tolerance) {
    return std::clamp(int(radius / besselRatio(tolerance)), 1, largestFactor);
}

/// A tolerance that the factor just keeps.
inline double besselTolerance(double radius, int factor) {
    return std::min(1e-3, 1.0001e-3 * std::pow(besselRatio(1e-3) * factor / radius, 4));
}

inline Decimation besselDecimation(double radius, double tolerance) {
    return boxDecimation(besselFactor(radius, tolerance), 4);
}

/// At most so much is a decimated blur's kernel off along one axis, at a distance in px. Most is where r
/// bends: what of its spectrum, ω^-4, lies beyond the small image's. From six deviations on it is what the
/// small FIR is cut by, and beyond that r itself. (Measured at all positions of an impulse, and tested.)
inline auto besselRidge(double radius, double tolerance) {
    const int factor = besselFactor(radius, tolerance);
    const double error = std::min(tolerance, 1e-3) / 2, bend = .027 * std::pow(factor / radius, 4);
    return [=](double distance) {
        const double cut = error * (distance < 6 * radius ? .0018 : .0137) / factor,
                     r = 3.5 * std::exp(-1.5 * distance / besselTau(radius)) / besselTau(radius);
        return bend * (std::exp(-.4 * distance / factor) + .85 * std::exp(-2 * distance / factor)) / factor +
               std::min(cut, r);
    };
}

/// And so much it adds up to from any distance on.
inline double besselStep(double tolerance) { return .085 * std::min(tolerance, 1e-3); }

inline int besselSmallReach(double radius, double tolerance) {
    int factor = besselFactor(radius, tolerance);
    if (factor > 1) tolerance = std::min(tolerance, 1e-3) / 4;
    return int(besselTaps(radius / factor, tolerance).size()) - 1;
}
inline Half besselSmallTaps(double radius, double tolerance) {
    int factor = besselFactor(radius, tolerance);
    if (factor == 1) return besselTaps(radius, tolerance);
    Exponentials e = besselExponentials(radius);
    return smallTaps(besselDecimation(radius, tolerance), besselSmallReach(radius, tolerance),
                     [&](double theta) { return e.response(theta); });
}

}  // namespace blur
