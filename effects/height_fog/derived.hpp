// height_fog's derived constants, fp64, every height counted from the eye.
#pragma once

#include <vector>

#include "effect/plugin.hpp"
#include "height_fog/params.hpp"

namespace brume::height_fog {

/// A density profile that is linear between points and constant beyond them; empty: no fog.
struct Knot {
    double y;  ///< m above the eye
    cv::Vec3d density;
};
using Knots = std::vector<Knot>;

inline constexpr double endless = 1e30;  ///< stands for an infinite optical depth: finite, and e^-it is 0

inline Knots rampKnots(const HeightFog& p, double eye) {
    Knots knots;
    for (const auto& point : p.ramp)
        knots.push_back({point.height - eye, cv::Vec3d(point.tint) * double(point.density)});
    std::stable_sort(knots.begin(), knots.end(), [](auto& a, auto& b) { return a.y < b.y; });
    return knots;
}

// The two ends of the table's range of heights above the eye, ascending.
inline std::pair<double, double> tableRange(const HeightFog& p, double eye) {
    return {std::min(p.tableBottom, p.tableTop) - eye, std::max(p.tableBottom, p.tableTop) - eye};
}

inline Knots tableKnots(const HeightFog& p, double eye) {
    Knots knots;
    auto [bottom, top] = tableRange(p, eye);
    const size_t count = p.table.size();
    for (size_t k = 0; k < count; k++) {
        const double t = count > 1 ? double(k) / double(count - 1) : 0;
        knots.push_back(
            {bottom + (top - bottom) * t, cv::Vec3d(p.table[k].tint) * double(p.table[k].density)});
    }
    return knots;
}

inline cv::Vec3d densityOf(const Knots& knots, double y) {
    if (knots.empty()) return {};
    if (y <= knots.front().y) return knots.front().density;
    for (size_t k = 1; k < knots.size(); k++)
        if (y < knots[k].y) {
            const double t = (y - knots[k - 1].y) / (knots[k].y - knots[k - 1].y);
            return knots[k - 1].density * (1 - t) + knots[k].density * t;
        }
    return knots.back().density;
}

// ∫ from a to b > a, piece by piece.
inline cv::Vec3d integralOf(const Knots& knots, double a, double b) {
    cv::Vec3d sum;
    if (knots.empty()) return sum;
    double from = a;
    for (const auto& knot : knots) {
        const double to = std::min(b, knot.y);
        if (to > from) sum += densityOf(knots, .5 * (from + to)) * (to - from), from = to;
    }
    if (b > from) sum += knots.back().density * (b - from);
    return sum;
}

/// Either kind of profile, evaluated and integrated in closed form.
struct ProfileFunction {
    struct Layer {
        double logDensity, k;  ///< at the eye's height
        cv::Vec3d tint;
    };
    std::vector<Layer> layers;
    Knots knots;

    ProfileFunction(const HeightFog& p, double eye) {
        if (p.profile == Profile::exponential) {
            add(p.density, p.height, p.falloff, p.tint, eye);
            add(p.density2, p.height2, p.falloff2, p.tint2, eye);
        } else {
            knots = p.profile == Profile::ramp ? rampKnots(p, eye) : tableKnots(p, eye);
        }
    }
    cv::Vec3d at(double y) const {
        cv::Vec3d sum = densityOf(knots, y);
        for (const auto& l : layers) sum += l.tint * std::exp(std::min(60., l.logDensity - l.k * y));
        return sum;
    }
    // ∫ from a to b > a.
    cv::Vec3d integral(double a, double b) const {
        cv::Vec3d sum = integralOf(knots, a, b);
        for (const auto& l : layers) {
            // e⁶⁰ up to where the exponential falls below it
            const double capped = l.k > 0 ? std::clamp((l.logDensity - 60) / l.k, a, b) : a;
            const double low = std::exp(std::min(60., l.logDensity - l.k * capped)), x = l.k * (b - capped);
            sum += l.tint *
                   (std::exp(60.) * (capped - a) + low * (x > 0 ? -std::expm1(-x) / x : 1) * (b - capped));
        }
        return sum;
    }
    // ∫ from the eye to as far as there is anything, `up` or down; at most `endless` a channel.
    cv::Vec3d endlessIntegral(bool up) const {
        cv::Vec3d sum;
        if (!knots.empty()) {
            const auto& last = up ? knots.back() : knots.front();
            if (up ? last.y > 0 : last.y < 0)
                sum = up ? integralOf(knots, 0, last.y) : integralOf(knots, last.y, 0);
            for (int n = 0; n < 3; n++)
                if (last.density[n] > 0) sum[n] = endless;
        }
        for (const auto& l : layers)
            for (int n = 0; n < 3; n++)
                if (l.tint[n] > 0)
                    sum[n] +=
                        up && l.k > 0 ? l.tint[n] * std::exp(std::min(60., l.logDensity)) / l.k : endless;
        for (double& s : sum.val) s = std::min(s, endless);
        return sum;
    }

  private:
    void add(double density, double height, double falloff, const cv::Vec3f& tint, double eye) {
        if (density > 0) layers.push_back({std::log(density) - falloff * (eye - height), falloff, tint});
    }
};

/// The table that table methods, and the table profile, look up.
struct Table {
    double step = 1;                       ///< m
    int base = 0;                          ///< the node nearest the eye
    double baseHeight = 0;                 ///< m above the eye
    std::vector<cv::Vec3d> density, mean;  ///< at nodes; of the cell above a node
    std::vector<cv::Vec3d> toNode;         ///< mean from the eye to a node
};

inline size_t tableNodes(const HeightFog& p) {
    if (p.method == tableLinear || p.method == tableHermite) return size_t(std::max(2, p.tableSize));
    return p.profile == Profile::table ? std::max<size_t>(2, p.table.size()) : 2;
}

inline Table makeTable(const HeightFog& p, double eye) {
    const ProfileFunction profile(p, eye);
    const size_t nodes = tableNodes(p);
    auto [bottom, top] = tableRange(p, eye);
    const int last = int(nodes) - 1;
    Table t;
    t.step = std::max((top - bottom) / last, 1e-9);
    t.base = int(std::clamp(std::round(-bottom / t.step), 0., double(last)));
    t.baseHeight = bottom + t.base * t.step;
    for (int k = 0; k <= last; k++) t.density.push_back(profile.at(bottom + k * t.step));
    for (int k = 0; k < last; k++) {
        const double a = bottom + k * t.step;
        t.mean.push_back(profile.integral(a, a + t.step) * (1 / t.step));
    }
    t.mean.push_back(t.density.back());
    // Upwards and downwards from the eye, in whose cell the method's own rule holds: no two integrals from
    // the table's end are subtracted. s cells of way from a node whose density is a, m in the mean to the
    // next, b.
    auto ownMean = [&](double s, const cv::Vec3d& a, const cv::Vec3d& m, const cv::Vec3d& b) -> cv::Vec3d {
        if (p.method == tableLinear) return m;
        if (p.method == tableHermite)
            return m * (s * (3 - 2 * s)) + a * ((1 - s) * (1 - s)) + b * (s * (s - 1));
        return a + (b - a) * (.5 * s);
    };
    t.toNode.resize(nodes);
    auto heightOf = [&](int k) { return t.baseHeight + (k - t.base) * t.step; };
    auto wayTo = [&](int k) { return std::abs(heightOf(k)); };
    int down = t.baseHeight > 0 ? t.base - 1 : t.base, up = down + 1;  // the nodes around the eye
    if (down < 0) {
        t.toNode[0] = t.density[0], up = 1, down = 0;
    } else if (down == last) {
        t.toNode[last] = t.density[last];
    } else {
        const cv::Vec3d &a = t.density[down], &b = t.density[up], &m = t.mean[down];
        t.toNode[down] = ownMean(wayTo(down) / t.step, a, m, b);
        t.toNode[up] = ownMean(wayTo(up) / t.step, b, m, a);
        up++;
    }
    auto extend = [&](int from, int to, const cv::Vec3d& cellMean) {
        t.toNode[to] = (t.toNode[from] * wayTo(from) + cellMean * t.step) * (1 / wayTo(to));
    };
    for (int k = up; k <= last; k++) extend(k - 1, k, t.mean[k - 1]);
    for (int k = down; k > 0; k--) extend(k, k - 1, t.mean[k - 1]);
    return t;
}

}  // namespace brume::height_fog
