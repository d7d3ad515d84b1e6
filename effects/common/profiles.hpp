// Means of density along a way; twin of profiles.glsl. Branch-free, so that a loop over a row vectorises; in
// double for the tests of convergence.
#pragma once

#include <algorithm>
#include <cmath>

#include "effect/kit/math.hpp"

namespace brume {

// One name for both precisions.
BRUME_INLINE float expOf(float x) { return expFast(x); }
BRUME_INLINE double expOf(double x) { return std::exp(x); }

// 1. φ(x) = (1 - exp(-x))/x for x ≥ 0: the mean of exp(-t) over 0..x; 1 at 0, 1/x from 87 on. Relative error
// in fp32 below 3e-7 (the usual forms: NaN at 0, 100 % at 1e-8).
BRUME_INLINE float phi(float x) {
    const float inside = x < 1e-30f ? 1e-30f : x;
    return extinctionOf(inside).opacity / inside;
}
BRUME_INLINE double phi(double x) { return x > 0 ? -std::expm1(-x) / x : 1; }

// 2. The mean of exp(logDensity - k·t) over the way from 0 to y, k ≥ 0 (MODELS.md §2, with y0 = 0): its
// denser end times φ. Densities are at most e⁶⁰ 1/m, so that no product with a way of any length overflows to
// 0·inf.
template <class Real>
BRUME_INLINE Real exponentialMean(Real logDensity, Real k, Real y) {
    const Real lower = y < Real(0) ? y : Real(0);
    const Real exponent = logDensity - k * lower;
    return expOf(exponent < Real(60) ? exponent : Real(60)) * phi(k * std::abs(y));
}

}  // namespace brume
