#include "projection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace capture {
namespace {

struct Row {
    double x, y, z, w;
};

double dot(const Row& a, const Row& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

Row row(const float* m, int k) { return {m[k], m[4 + k], m[8 + k], m[12 + k]}; }

Row without(const Row& a, double share, const Row& b) {
    return {a.x - share * b.x, a.y - share * b.y, a.z - share * b.z, a.w - share * b.w};
}

// Z at which the depth offset + slope/Z takes the value `depth`.
double distanceAt(double depth, double offset, double slope) {
    const double rest = depth - offset;
    if (std::abs(rest) < 2e-6 * std::max(1., std::abs(offset)))
        return std::numeric_limits<double>::infinity();
    return slope / rest;
}

}  // namespace

std::optional<Projection> perspectiveOf(const float* m, double lowestDepth) {
    for (int k = 0; k < 16; k++)
        if (!std::isfinite(m[k])) return std::nullopt;
    // Clip w is the distance Z: its row is the view direction, times the view's scale.
    const Row w = row(m, 3);
    const double scale2 = dot(w, w), scale = std::sqrt(scale2);
    if (scale < 1e-6) return std::nullopt;
    const Row x = row(m, 0), y = row(m, 1), z = row(m, 2);

    Projection p;
    p.centreX = dot(x, w) / scale2;
    p.centreY = dot(y, w) / scale2;
    const Row across = without(x, p.centreX, w), up = without(y, p.centreY, w);
    p.focalX = std::sqrt(dot(across, across)) / scale;
    p.focalY = std::sqrt(dot(up, up)) / scale;
    if (p.focalX < 1e-3 || p.focalY < 1e-3) return std::nullopt;
    if (std::abs(dot(across, up)) > 1e-3 * p.focalX * p.focalY * scale2) return std::nullopt;

    const double offset = dot(z, w) / scale2;
    const Row rest = without(z, offset, w);
    const double slope = rest.w;
    if (std::sqrt(dot(rest, rest)) > 1e-3 * scale * std::max(1., std::abs(offset))) return std::nullopt;
    const double low = distanceAt(lowestDepth, offset, slope), high = distanceAt(1, offset, slope);
    if (!(low > 0) || !(high > 0) || low == high) return std::nullopt;
    p.reversed = low > high;
    p.nearPlane = std::min(low, high);
    p.farPlane = std::max(low, high);
    p.isPure = w.w == 0 && w.x == 0 && w.y == 0 && x.y == 0 && x.w == 0 && y.x == 0 && y.w == 0;
    return p;
}

bool isOrthographic(const float* m) {
    return m[3] == 0 && m[7] == 0 && m[11] == 0 && m[15] == 1 && m[0] != 0 && m[5] != 0;
}

}  // namespace capture
