// height_fog's truth: the integral of P3's eq 7 in fp64 by adaptive Gauss-Kronrod quadrature, split at the
// profile's breakpoints.
#pragma once

#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <limits>
#include <vector>

#include "effect/plugin.hpp"
#include "height_fog/params.hpp"

namespace brume::height_fog {

inline double referenceDensity(const HeightFog& p, double y, int n) {
    if (p.profile == Profile::exponential) {
        const auto layer = [y](double density, double falloff, double height) {
            return density > 0 ? std::min(std::exp(60.), density * std::exp(-falloff * (y - height))) : 0;
        };
        return p.tint[n] * layer(p.density, p.falloff, p.height) +
               p.tint2[n] * layer(p.density2, p.falloff2, p.height2);
    }
    // The points round y, whatever their order; the nearest one beyond the ends.
    double below = -HUGE_VAL, above = HUGE_VAL, densityBelow = 0, densityAbove = 0;
    auto point = [&](double height, double density) {
        if (height <= y && height >= below) below = height, densityBelow = density;
        if (height > y && height < above) above = height, densityAbove = density;
    };
    if (p.profile == Profile::ramp)
        for (const auto& r : p.ramp) point(r.height, double(r.density) * r.tint[n]);
    const double bottom = std::min(p.tableBottom, p.tableTop), top = std::max(p.tableBottom, p.tableTop);
    if (p.profile == Profile::table)
        for (size_t k = 0; k < p.table.size(); k++)
            point(p.table.size() > 1 ? bottom + (top - bottom) * double(k) / double(p.table.size() - 1)
                                     : bottom,
                  double(p.table[k].density) * p.table[k].tint[n]);
    if (below == -HUGE_VAL) return densityAbove;
    if (above == HUGE_VAL) return densityBelow;
    return densityBelow + (densityAbove - densityBelow) * (y - below) / (above - below);
}

// Heights at which the profile changes its form, or (exponential) its size by e³.
inline std::vector<double> breakpoints(const HeightFog& p, double low, double high) {
    std::vector<double> at = {low, high};
    auto add = [&](double y) {
        if (y > low && y < high) at.push_back(y);
    };
    if (p.profile == Profile::exponential)
        for (double k : {double(p.falloff), double(p.falloff2)})
            for (int e = 1; k > 0 && e <= 20; e++) add(low + 3 * e / k);
    for (const auto& r : p.ramp) add(r.height);
    const double bottom = std::min(p.tableBottom, p.tableTop), top = std::max(p.tableBottom, p.tableTop);
    for (size_t k = 0; k < p.table.size(); k++)
        add(p.table.size() > 1 ? bottom + (top - bottom) * double(k) / double(p.table.size() - 1) : bottom);
    std::sort(at.begin(), at.end());
    return at;
}

inline double referenceIntegral(const HeightFog& p, double low, double high, int n) {
    using Quadrature = boost::math::quadrature::gauss_kronrod<double, 15>;
    const std::vector<double> at = breakpoints(p, low, high);
    double sum = 0;
    for (size_t k = 0; k + 1 < at.size(); k++)
        if (at[k + 1] > at[k])
            sum += Quadrature::integrate([&](double y) { return referenceDensity(p, y, n); }, at[k],
                                         at[k + 1], 5, 1e-12);
    return sum;
}

// Where nothing is left of an exponential, or of a ramp that ends at 0; HUGE_VAL if the fog never ends.
inline double topOfFog(const HeightFog& p, double y, int n) {
    double top = y;
    if (p.profile != Profile::exponential) {
        for (const auto& r : p.ramp) top = std::max(top, double(r.height));
        top = std::max({top, double(p.tableBottom), double(p.tableTop)});
        return referenceDensity(p, top + 1, n) > 0 ? HUGE_VAL : top;
    }
    if (p.density * p.tint[n] > 0) top = std::max(top, p.falloff > 0 ? y + 60. / p.falloff : HUGE_VAL);
    if (p.density2 * p.tint2[n] > 0) top = std::max(top, p.falloff2 > 0 ? y + 60. / p.falloff2 : HUGE_VAL);
    return top;
}
inline double bottomOfFog(const HeightFog& p, double y, int n) {
    if (p.profile == Profile::exponential)
        return p.density * p.tint[n] > 0 || p.density2 * p.tint2[n] > 0 ? -HUGE_VAL : y;
    double bottom = y;
    for (const auto& r : p.ramp) bottom = std::min(bottom, double(r.height));
    bottom = std::min({bottom, double(p.tableBottom), double(p.tableTop)});
    return referenceDensity(p, bottom - 1, n) > 0 ? -HUGE_VAL : bottom;
}

/// τ of the way of length L (inf: sky) from height `eye`, climbing `up` a metre.
inline double referenceDepth(const HeightFog& p, double eye, double L, double up, int n) {
    if (L == 0) return 0;
    if (std::isinf(L)) {
        if (up == 0) return referenceDensity(p, eye, n) > 0 ? HUGE_VAL : 0;
        const double end = up > 0 ? topOfFog(p, eye, n) : bottomOfFog(p, eye, n);
        if (std::isinf(end)) return HUGE_VAL;
        return referenceIntegral(p, std::min(eye, end), std::max(eye, end), n) / std::abs(up);
    }
    const double dy = L * up;
    if (std::abs(dy) <= 1e-9 * std::max(1., std::abs(eye))) return L * referenceDensity(p, eye + .5 * dy, n);
    return referenceIntegral(p, std::min(eye, eye + dy), std::max(eye, eye + dy), n) * L / std::abs(dy);
}

/// The largest of the differences of height that fp32 has to hold, in m: to the way's end, and to the points
/// of a ramp between which the way goes. (Above a point of great density, 4 ulp of its height are much of the
/// little that is left where the ramp ends.)
inline double heldHeight(const HeightFog& p, double eye, double dy) {
    double below = 0, above = 0;
    if (p.profile == Profile::ramp) {
        const double low = std::min(eye, eye + dy), high = std::max(eye, eye + dy);
        below = above = HUGE_VAL;
        for (const auto& r : p.ramp) {
            if (r.height <= low) below = std::min(below, eye - r.height);
            if (r.height >= high) above = std::min(above, r.height - eye);
        }
    }
    return std::max({std::abs(dy), std::isfinite(below) ? below : 0, std::isfinite(above) ? above : 0});
}

/// The methods that only approximate it, in fp64 and as the papers write them: how far each may be off.
class ApproximateDepth {
  public:
    explicit ApproximateDepth(const HeightFog& p) : p_(p) {
        if (p.method != tableLinear && p.method != tableHermite) return;
        bottom_ = std::min(p.tableBottom, p.tableTop);
        cells_ = std::max(2, p.tableSize) - 1;
        step_ = std::max((std::max(p.tableBottom, p.tableTop) - bottom_) / cells_, 1e-9);
        cell_.resize(cells_);
        for (int k = 0; k < cells_; k++)
            for (int n = 0; n < 3; n++) cell_[k][n] = referenceIntegral(p, nodeAt(k), nodeAt(k + 1), n);
        below_.resize(cells_ + 1), above_.resize(cells_ + 1);
        for (int k = 0; k < cells_; k++) below_[k + 1] = below_[k] + cell_[k];
        for (int k = cells_; k > 0; k--) above_[k - 1] = above_[k] + cell_[k - 1];
    }
    bool isExact() const { return cell_.empty() && p_.method != march; }

    double operator()(double eye, double L, double up, int n) const {
        const double dy = L * up;
        if (p_.method == march) {
            double sum = 0;
            for (int k = 0; k < p_.steps; k++) sum += referenceDensity(p_, eye + dy * (k + .5) / p_.steps, n);
            return L * sum / p_.steps;
        }
        return std::max(0., L * mean(std::min(eye, eye + dy), std::max(eye, eye + dy), n));
    }

    /// How far 4 fp32 ulp of each height at which the march asks for the density can move it. (The integral
    /// hardly notices such a shift; a few samples on a steep ramp do.)
    double changeOfHeights(double eye, double L, double up, int n) const {
        if (p_.method != march) return 0;
        double sum = 0;
        for (int k = 0; k < p_.steps; k++) {
            const double dy = L * up * (k + .5) / p_.steps, density = referenceDensity(p_, eye + dy, n);
            double change = 0;
            for (double ulps : {-4, 4}) {
                const double shifted =
                    eye + dy + ulps * std::numeric_limits<float>::epsilon() * heldHeight(p_, eye, dy);
                change = std::max(change, std::abs(referenceDensity(p_, shifted, n) - density));
            }
            sum += change;
        }
        return L * sum / p_.steps;
    }

    /// Of a depth: what fp32 may round away of a sum of so many steps, of about one size.
    double roundingOfSum() const {
        return p_.method == march ? .25 * p_.steps * std::numeric_limits<float>::epsilon() : 0;
    }

  private:
    double nodeAt(int k) const { return bottom_ + k * step_; }
    // -1 below the table, cells_ above it.
    int cellOf(double y) const {
        return int(std::clamp(std::floor((y - bottom_) / step_), -1., double(cells_)));
    }
    double densityIn(int cell, double y, int n) const {
        if (cell < 0 || cell >= cells_) return referenceDensity(p_, nodeAt(cell < 0 ? 0 : cells_), n);
        if (p_.method == tableLinear) return cell_[cell][n] / step_;
        // the derivative of the cubic that has the cell's integral, and at its ends the profile's densities
        const double t = (y - nodeAt(cell)) / step_;
        return 6 * t * (1 - t) * cell_[cell][n] / step_ +
               (1 - t) * (1 - 3 * t) * referenceDensity(p_, nodeAt(cell), n) +
               t * (3 * t - 2) * referenceDensity(p_, nodeAt(cell + 1), n);
    }
    // Inside one cell: by Gauss's rule with two points, exact for that derivative however short the way.
    double meanIn(int cell, double low, double high, int n) const {
        const double middle = .5 * (low + high), away = .5 / std::sqrt(3.) * (high - low);
        return .5 * (densityIn(cell, middle - away, n) + densityIn(cell, middle + away, n));
    }
    double mean(double low, double high, int n) const {
        const int first = cellOf(low), last = cellOf(high);
        if (first == last) return meanIn(first, low, high, n);
        const double from = nodeAt(first + 1), to = nodeAt(last);
        // From the end with less: an exponential's sum from far below would round away all that is here.
        const bool isFromBelow = std::max(below_[first + 1][n], below_[last][n]) <=
                                 std::max(above_[first + 1][n], above_[last][n]);
        const double between =
            isFromBelow ? below_[last][n] - below_[first + 1][n] : above_[first + 1][n] - above_[last][n];
        return (meanIn(first, low, from, n) * (from - low) + between +
                meanIn(last, to, high, n) * (high - to)) /
               (high - low);
    }

    HeightFog p_;
    double bottom_ = 0, step_ = 1;
    int cells_ = 0;
    std::vector<cv::Vec3d> cell_, below_,
        above_;  // integrals: of a cell; from the bottom, and to the top, of a node
};

}  // namespace brume::height_fog
