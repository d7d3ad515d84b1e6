// Phase functions: how much of the light scattered at a point goes towards the eye; twin of phase.glsl, with
// the same names and numbered steps.
//
// Normalised over the sphere: the integral over all directions is 1, so each is in 1/sr. The angle θ lies
// between the view ray and the direction towards the light (0: looking into it) and is handed over as its
// versine v = 1 - cos θ = |d - s|²/2 for unit vectors d (view ray) and s (towards the light), in 0..2: near θ
// = 0 the cosine has lost in fp32 what a narrow lobe needs (at g = .99 its usual form is wrong by 4.5e-3,
// this by 1.2e-5).
//
// Sources: Henyey & Greenstein, "Diffuse radiation in the galaxy" (1941); Rayleigh's (1 + cos²θ) law.
#pragma once

#include <cmath>

namespace brume {

inline constexpr double inverse4Pi = 0.079577471545947667884;  ///< 1/4π, the isotropic phase function

// 1. the versine of the angle between two unit vectors
template <class Real>
inline Real versineBetween(Real dx, Real dy, Real dz, Real sx, Real sy, Real sz) {
    const Real x = dx - sx, y = dy - sy, z = dz - sz;
    return Real(0.5) * (x * x + y * y + z * z);
}

// 2. Henyey-Greenstein; anisotropy g in -1..1, exclusive: (1 - g²)/(4π·((1 - g)² + 2g·v)^1.5)
template <class Real>
inline Real henyeyGreensteinPhase(Real g, Real v) {
    const Real a = Real(1) - g;
    const Real b = a * a + Real(2) * g * v;
    return Real(inverse4Pi) * (a * (Real(1) + g)) / (b * std::sqrt(b));
}

// 3. Rayleigh: 3/(16π)·(1 + cos²θ)
template <class Real>
inline Real rayleighPhase(Real v) {
    const Real c = Real(1) - v;
    return Real(0.75 * inverse4Pi) * (Real(1) + c * c);
}

}  // namespace brume
