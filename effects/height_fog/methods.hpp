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
// the mantissa as much too small: thin air's numbers would be denormal, which take many times as long.
// (Density ends at e^60, 2^86.) Of a layer so deep below the eye that e^x leaves reduceExp's range on the way
// to it, x counts from there.
struct Layer {
    static constexpr int lift = 32, least = lift - 126, most = 126;  // of powers of two
    static constexpr float deepest = -5e5f;  // ln density at the eye; 1e6 is as far as x goes
    float mantissa = 1;                      ///< density at the eye, or in a deep layer: mantissa·2^exponent
    int exponent = 0;
    float falloff = 0;
    float deep = 0;  ///< x where a deep layer's density is 1

    static Layer of(float logDensity, float falloff) {
        Layer layer;
        if (falloff > 0 && logDensity < deepest) layer.deep = -logDensity;
        double binary = std::min(double(logDensity) + double(layer.deep), 60.) / 0.69314718055994531;
        if (falloff == 0) binary = std::max(binary, -93.);  // hides the sky, 1e30 m away, and nothing nearer
        layer.exponent = int(std::floor(binary)) + lift;
        layer.mantissa = float(std::exp2(binary - std::floor(binary) - lift));
        layer.falloff = falloff;
        return layer;
    }
    template <bool isDeep>
    BRUME_INLINE float opticalDepth(float L, float dy) const {
        const float way = -falloff * dy;
        // a level way as one that is hardly not: 1e-7 is 5e-8 off, and thin fog times much less would vanish
        const float x = std::fabs(way) < 1e-7f ? 1e-7f : way;
        const float rising = isDeep ? x - deep : x;
        const ReducedExp e = reduceExp(rising < -87.0f ? -87.0f : (rising > 1e6f ? 1e6f : rising));
        int power = exponent + e.n;
        power = power < least ? least : (power > most ? most : power);
        const float here = powerOfTwo(isDeep || exponent < least ? least : exponent),
                    there = powerOfTwo(power);
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
// So is the way inside a cell, from the node on the eye's side: of a density that falls from great to little
// at the eye, the other node's share would be the rounding of 1.
template <class Real>
struct TableView {
    const Real *density, *cellMean, *toNode;  ///< toNode: mean from the eye to a node
    int nodes, base;                          ///< base: the node nearest the eye
    Real baseHeight, step;

    struct Place {
        int cell, near, far;  ///< its nodes: on the eye's side, and the other; beyond the ends the same
        Real cells;           ///< between `near` and the place, 0..1
    };
    BRUME_INLINE Place placeOf(Real y) const {
        const Real cells = (y - baseHeight) / step, whole = std::floor(cells) + Real(base);
        Place at;
        at.cell = int(whole < Real(-1) ? Real(-1) : (whole > Real(nodes - 1) ? Real(nodes - 1) : whole));
        at.near = at.cell < base ? at.cell + 1 : at.cell;
        at.far = at.cell < base ? at.cell : at.cell + 1;
        at.far = at.far < 0 ? 0 : (at.far < nodes ? at.far : nodes - 1);
        at.cells = std::fabs(cells - Real(at.near - base));
        at.cells = at.cells < Real(1) ? at.cells : Real(1);
        return at;
    }
    // What is tabulated round a place, of one channel.
    struct Found {
        Real near, far, cellMean, toNode;  ///< toNode: of the near one
    };
    BRUME_INLINE Found find(int n, int near, int far) const {
        const Real a = density[4 * near + n];
        return {a, density[4 * far + n], near == far ? a : cellMean[4 * (near < far ? near : far) + n],
                toNode[4 * near + n]};
    }
    // 3.1 the mean inside the cell, between t0 and t1 cells beyond its near node
    template <int method>
    BRUME_INLINE static Real insideMean(const Found& found, Real t0, Real t1) {
        const Real a = found.near, b = found.far, m = found.cellMean, t = Real(0.5) * (t0 + t1);
        if (method == tableLinear) return m;
        if (method != tableHermite) return a + (b - a) * t;
        // the derivative of the cubic through both integrals and slopes, averaged exactly by Simpson's rule
        auto slope = [&](Real s) {
            return m * (Real(6) * s * (Real(1) - s)) + a * ((Real(1) - s) * (Real(1) - Real(3) * s)) +
                   b * (s * (Real(3) * s - Real(2)));
        };
        const Real mean = (slope(t0) + Real(4) * slope(t) + slope(t1)) / Real(6);
        return mean > Real(0) ? mean : Real(0);
    }
    // 3.2 from the eye to the height y
    template <int method>
    BRUME_INLINE Real mean(const Found& found, const Place& eye, const Place& at, Real y) const {
        const bool isHere = at.cell == eye.cell;
        const Real inside = insideMean<method>(found, isHere ? eye.cells : Real(0), at.cells);
        // both parts from one height of the node, so that its rounding counts only where the means differ
        const Real node = baseHeight + Real(at.near - base) * step;
        const Real mean = (found.toNode * node + inside * (y - node)) / y;
        // a cubic through too few nodes can dip below 0
        return isHere ? inside : (mean > Real(0) ? mean : Real(0));
    }
    template <int method>
    BRUME_INLINE Real mean(int n, Real y) const {
        const Place at = placeOf(y);
        return mean<method>(find(n, at.near, at.far), placeOf(Real(0)), at, y);
    }
    BRUME_INLINE Real at(int n, Real y) const {
        const Place at = placeOf(y);
        return insideMean<closedForm>(find(n, at.near, at.far), at.cells, at.cells);
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
