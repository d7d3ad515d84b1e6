// height_fog's CPU methods: the mean of one channel's density between the eye's height (0) and y, in 1/m.
// Numbered as in height_fog.fs; in double for the tests of convergence. Each is to be inlined into a loop
// over a row.
#pragma once

#include "common/profiles.hpp"
#include "height_fog/params.hpp"

namespace brume::height_fog {

// 1. One exponential layer of density e^(logDensity - falloff·y) before its tint, with one exponential and
// one division: L·ρ·(e^x - 1)/x, x = -falloff·dy, whose sign tells up from down. ρ = mantissa·2^exponent
// shares e^x's power of two, so that a layer far below the eye neither vanishes nor overflows. Ways are
// finite
// (`endlessWay` at most), so the limit to the sky comes out by itself. The power is kept 2^32 too large and
// the mantissa as much too small: thin air's numbers would be
// denormal, which take many times as long. (Density ends at e^60, 2^86.)
struct Layer {
    static constexpr int lift = 32, least = lift - 126, most = 126;  // of powers of two
    float mantissa = 1;  ///< density at the eye = mantissa·2^exponent
    int exponent = 0;
    float falloff = 0;

    static Layer of(float logDensity, float falloff) {
        double binary = std::min(double(logDensity), 60.) / 0.69314718055994531;
        if (falloff == 0) binary = std::max(binary, -93.);  // hides the sky, 1e30 m away, and nothing nearer
        Layer layer;
        layer.exponent = int(std::max(std::floor(binary), -2e6)) + lift;
        layer.mantissa = float(std::exp2(binary - std::floor(binary) - lift));
        layer.falloff = falloff;
        return layer;
    }
    BRUME_INLINE float opticalDepth(float L, float dy) const {
        const float way = -falloff * dy;
        // a level way as one that is hardly not: 1e-7 is 5e-8 off, and thin fog times much less would vanish
        const float x = std::fabs(way) < 1e-7f ? 1e-7f : way;
        const ReducedExp e = reduceExp(x < -87.0f ? -87.0f : (x > 1e6f ? 1e6f : x));
        int power = exponent + e.n;
        power = power < least ? least : (power > most ? most : power);
        const float here = powerOfTwo(exponent < least ? least : exponent), there = powerOfTwo(power);
        const float rise = (there - here) + there * e.expm1;
        const float depth = (L * mantissa) * (rise / x);
        return depth < 1e30f ? depth : 1e30f;
    }
};

// 2. Ramp: over each linear piece, the density half-way, weighted by how much of the way lies in it.
template <class Real>
struct Ramp {
    Real y[4], density[4], slope[4];  ///< the last slope unused

    BRUME_INLINE Real at(Real h) const {
        // from the knot below: a sum of all rises up to h would keep the rounding of knots far from the eye
        Real rho = density[0];
        for (int k = 0; k < 3; k++) rho = h > y[k] ? density[k] + slope[k] * (h - y[k]) : rho;
        return h > y[3] ? density[3] : rho;
    }
    BRUME_INLINE Real mean(Real h, Real eyeDensity) const {
        const Real low = h < Real(0) ? h : Real(0), high = h < Real(0) ? Real(0) : h;
        const Real way = high - low;
        Real sum = positive((high < y[0] ? high : y[0]) - low) * density[0];
        for (int k = 0; k < 3; k++) {
            const Real from = low > y[k] ? low : y[k], to = high < y[k + 1] ? high : y[k + 1];
            const Real middle = Real(0.5) * (from + to) - y[k];
            sum += positive(to - from) * (density[k] + slope[k] * middle);
        }
        sum += positive(high - (low > y[3] ? low : y[3])) * density[3];
        return way < Real(1e-30) ? eyeDensity : sum / way;
    }
    BRUME_INLINE static Real positive(Real x) { return x > Real(0) ? x : Real(0); }
};

// 3. Table: whole cells from their mean, the rest by the cell's own rule. Arrays hold RGB_ a node. Nodes are
// counted from the eye's, not from the first: that may be so far that fp32 holds its height to a metre only.
template <class Real>
struct TableView {
    const Real *density, *cellMean, *toNode;  ///< toNode: mean from the eye to a node
    int nodes, base;                          ///< base: the node at or below the eye, or the nearest one
    Real baseHeight, step;

    BRUME_INLINE int cellOf(Real y) const {
        const Real cell = std::floor((y - baseHeight) / step) + Real(base);
        return int(cell < Real(-1) ? Real(-1) : (cell > Real(nodes - 1) ? Real(nodes - 1) : cell));
    }
    BRUME_INLINE Real nodeAt(int cell) const { return baseHeight + Real(cell - base) * step; }
    // 3.1 the mean inside one cell, between two heights
    template <int method>
    BRUME_INLINE Real insideMean(int n, int cell, Real y0, Real y1) const {
        if (cell < 0) return density[n];
        if (cell >= nodes - 1) return density[4 * (nodes - 1) + n];
        const Real a = density[4 * cell + n], b = density[4 * cell + 4 + n], m = cellMean[4 * cell + n];
        if (method == tableLinear) return m;
        const Real t0 = (y0 - nodeAt(cell)) / step, t1 = (y1 - nodeAt(cell)) / step,
                   t = Real(0.5) * (t0 + t1);
        if (method != tableHermite) return a + (b - a) * t;
        // the derivative of the cubic through both integrals and slopes, averaged exactly by Simpson's rule
        auto slope = [&](Real s) {
            return m * (Real(6) * s * (Real(1) - s)) + a * ((Real(1) - s) * (Real(1) - Real(3) * s)) +
                   b * (s * (Real(3) * s - Real(2)));
        };
        const Real mean = (slope(t0) + Real(4) * slope(t) + slope(t1)) / Real(6);
        return mean > Real(0) ? mean : Real(0);
    }
    template <int method>
    BRUME_INLINE Real mean(int n, Real y) const {
        const int eye = cellOf(Real(0)), cell = cellOf(y);
        if (cell == eye) return insideMean<method>(n, cell, Real(0), y);
        const int node = cell > eye ? cell : cell + 1;
        const Real from = nodeAt(node);
        // as means, so that the rounding of a node's height counts only where they differ
        const Real mean =
            toNode[4 * node + n] * (from / y) + insideMean<method>(n, cell, from, y) * ((y - from) / y);
        return mean > Real(0) ? mean : Real(0);  // a cubic through too few nodes can dip below
    }
};

// 4. March: the mean of ρ at the middles of equal steps.
template <class Real, class Density>
BRUME_INLINE Real marchMean(Real y, int steps, const Density& densityAt) {
    Real sum = 0;
    for (int k = 0; k < steps; k++) sum += densityAt(y * ((Real(k) + Real(0.5)) / Real(steps)));
    return sum / Real(steps);
}

}  // namespace brume::height_fog
