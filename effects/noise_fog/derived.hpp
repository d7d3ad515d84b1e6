// noise_fog's derived constants, fp64.
#pragma once

#include <algorithm>
#include <vector>

#include "common/noise.hpp"
#include "common/noise_volume.hpp"
#include "effect/plugin.hpp"
#include "noise_fog/params.hpp"

namespace brume::noise_fog {

struct NoiseOrigin {
    NoiseLattice lattice;
    cv::Vec3d fraction;
};
inline NoiseOrigin originOf(const NoiseFog& p, const DeriveContext& c) {
    cv::Vec3d eye = c.camera.eye(), wind(p.wind);
    if (p.isGround()) eye[1] = wind[1] = 0;
    NoiseOrigin origin;
    origin.lattice =
        noiseLattice(eye, wind, c.time, p.size, uint32_t(p.tile), uint32_t(p.seed), origin.fraction);
    return origin;
}
inline std::vector<double> noiseCell(const NoiseFog& p, const DeriveContext& c) {
    const NoiseLattice l = originOf(p, c).lattice;
    return {double(l.cellX), double(l.cellY), double(l.cellZ)};
}
inline std::vector<double> noiseFraction(const NoiseFog& p, const DeriveContext& c) {
    const cv::Vec3d f = originOf(p, c).fraction;
    return {f[0], f[1], f[2]};
}

inline std::vector<double> inverseSize(const NoiseFog& p, const DeriveContext&) { return {1. / p.size}; }
inline std::vector<double> inverseDistance(const NoiseFog& p, const DeriveContext&) {
    return {1. / p.powerDistance};
}

inline std::vector<double> toSun(const NoiseFog& p, const DeriveContext&) {
    const cv::Vec3d s(p.sunDirection);
    const double length = cv::norm(s);
    return length > 0 ? std::vector<double>{s[0] / length, s[1] / length, s[2] / length}
                      : std::vector<double>{0, 0, 0};
}

inline std::vector<double> bakedEdge(const NoiseFog& p, const DeriveContext&) {
    return {p.isBaked() ? double(p.edge()) : 1.};
}
inline std::vector<double> bakedNoise(const NoiseFog& p, const DeriveContext&) {
    if (!p.isBaked()) return {.5};
    return bakeNoise(NoiseKind(p.noise), p.octaves, p.tile, p.edge(), p.smoothingRow(), uint32_t(p.seed));
}

inline std::vector<double> axisLog(const NoiseFog& p, const DeriveContext& c) {
    std::vector<double> logs;
    for (int a = 0; a < 3; a++)
        logs.push_back(-double(p.axis(a).falloff) * (c.camera.eye()[a] - p.axis(a).origin));
    return logs;
}

struct AxisPoint {
    double position, density;
};
/// One axis' points, ascending; those of a table moved to equal steps.
inline std::vector<AxisPoint> pointsOf(const NoiseFog& p, int axis) {
    std::vector<AxisPoint> points;
    for (const auto& point : p.points)
        if (point.axis == axis) points.push_back({point.position, point.density});
    if (p.axis(axis).profile == tableAxis && points.size() > 1) {
        const double first = points.front().position, last = points.back().position;
        for (size_t k = 0; k < points.size(); k++)
            points[k].position = first + (last - first) * double(k) / double(points.size() - 1);
    }
    std::stable_sort(points.begin(), points.end(), [](auto& a, auto& b) { return a.position < b.position; });
    return points;
}
inline std::vector<double> axisPoints(const NoiseFog& p, const DeriveContext& c) {
    std::vector<double> all;
    for (int axis = 0; axis < 3; axis++) {
        const auto points = pointsOf(p, axis);
        for (size_t k = 0; k < points.size(); k++) {
            const double way = k + 1 < points.size() ? points[k + 1].position - points[k].position : 0;
            const double slope = way > 0 ? (points[k + 1].density - points[k].density) / way : 0;
            all.insert(all.end(), {points[k].position - c.camera.eye()[axis], points[k].density, slope, 0});
        }
    }
    all.resize(4 * 48, 0);
    return all;
}
inline std::vector<double> axisBegin(const NoiseFog& p, const DeriveContext&) {
    std::vector<double> begin = {0};
    for (int axis = 0; axis < 3; axis++) begin.push_back(begin.back() + double(pointsOf(p, axis).size()));
    return begin;
}

}  // namespace brume::noise_fog
