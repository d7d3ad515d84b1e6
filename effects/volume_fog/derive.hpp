// World parameters brought to the eye: what the marches read. Everything is computed in fp64 and rounded
// once.
//
// `volumes`: six rows of four a volume: (low corner, extinction), (high corner, 0), (albedo, 0) and three
// falloffs, (height start, linear rate, exponential rate, 0), then for x and z (centre, start, linear rate,
// exponential rate). Density there is extinction·Π max(0, 1 - u·linear rate)·exp(-Σ u·exponential rate), u
// the way beyond a start, m. The whole scene is a volume without walls. Rows are sorted by content: the sum
// over boxes does not know their order.
//
// `lamps`: three rows a light: (position, range), (colour, intensity), (constant, linear, quadratic, core²),
// where core² = constant/quadratic is what a light's attenuation adds to the squared distance.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/noise.hpp"
#include "effect/plugin.hpp"
#include "error.hpp"
#include "volume_fog/volume_fog.hpp"

namespace volume_fog {

constexpr int volumeRows = 6, lampRows = 3;
constexpr double exponentialRate = 7.5;  // P2 §4.1.2: "approaches 0 at the falloff's end"
constexpr double unbounded = 1e30;       // m: squares of it stay out of the arithmetic
constexpr double leastAttenuation =
    1e-4;  // as of a lamp 1 cm across: intensity stays finite on the light itself
constexpr unsigned noisePeriod = 1024;  // cells

using VolumeNumbers = std::array<double, 4 * volumeRows>;

struct FalloffRates {
    double linear = 0, exponential = 0;
};

// Rates of a falloff over `distance` m; a distance of nothing is a wall, which the caller puts there.
inline FalloffRates ratesOf(int falloff, double distance) {
    if (falloff == NoFalloff || !(distance > 0)) return {};
    if (falloff == Linear) return {1 / distance, 0};
    return {0, exponentialRate / distance};
}

// Height falloff above `start` (world y): sets the volume's third falloff row, and its ceiling where nothing
// is left.
inline void setHeightFalloff(VolumeNumbers& v, int falloff, double start, double distance, double eyeY) {
    if (falloff == NoFalloff) return;
    const FalloffRates rates = ratesOf(falloff, distance);
    v[12] = start - eyeY;
    v[13] = rates.linear;
    v[14] = rates.exponential;
    if (falloff == Linear || !(distance > 0)) v[5] = std::min(v[5], start + std::max(distance, 0.) - eyeY);
}

inline void setEdgeFalloff(VolumeNumbers& v, int row, int falloff, double centre, double half,
                           double percent) {
    const double start = half * std::clamp(percent / 100, 0., 1.);
    const FalloffRates rates = ratesOf(falloff, half - start);
    v[4 * row] = centre;
    v[4 * row + 1] = start;
    v[4 * row + 2] = rates.linear;
    v[4 * row + 3] = rates.exponential;
}

inline std::vector<VolumeNumbers> volumesOf(const Params& p, const brume::DeriveContext& c) {
    const cv::Vec3d eye = c.camera.eye();
    std::vector<VolumeNumbers> volumes;
    if (p.density > 0) {
        VolumeNumbers v{};
        for (int k = 0; k < 3; k++) v[k] = -unbounded, v[4 + k] = unbounded, v[8 + k] = p.albedo[k];
        v[3] = p.density;
        setHeightFalloff(v, p.height_falloff, p.height_start, p.height_distance, eye[1]);
        volumes.push_back(v);
    }
    for (const Box& box : p.boxes) {
        VolumeNumbers v{};
        for (int k = 0; k < 3; k++) {
            v[k] = box.center[k] - .5 * double(box.size[k]) - eye[k];
            v[4 + k] = box.center[k] + .5 * double(box.size[k]) - eye[k];
            v[8 + k] = box.albedo[k];
        }
        v[3] = box.density;
        const double bottom = box.center[1] - .5 * double(box.size[1]);
        const double room = double(box.size[1]) - box.height_start;
        setHeightFalloff(v, box.height_falloff, bottom + box.height_start,
                         std::min(double(box.height_distance), room), eye[1]);
        setEdgeFalloff(v, 4, box.edge_falloff, box.center[0] - eye[0], .5 * double(box.size[0]),
                       box.edge_start_x);
        setEdgeFalloff(v, 5, box.edge_falloff, box.center[2] - eye[2], .5 * double(box.size[2]),
                       box.edge_start_z);
        if (box.density > 0 && box.size[0] > 0 && box.size[1] > 0 && box.size[2] > 0) volumes.push_back(v);
    }
    std::sort(volumes.begin(), volumes.end());
    return volumes;
}

inline std::vector<double> deriveVolumes(const Params& p, const brume::DeriveContext& c) {
    std::vector<double> numbers;
    for (const VolumeNumbers& v : volumesOf(p, c)) numbers.insert(numbers.end(), v.begin(), v.end());
    if (numbers.empty()) numbers.assign(4 * volumeRows, 0.);
    return numbers;
}

inline std::vector<double> deriveVolumeCount(const Params& p, const brume::DeriveContext& c) {
    return {double(volumesOf(p, c).size())};
}

inline std::vector<double> deriveLamps(const Params& p, const brume::DeriveContext& c) {
    const cv::Vec3d eye = c.camera.eye();
    std::vector<double> numbers;
    for (const PointLight& light : p.point_lights) {
        const double constant = std::max(double(light.attenuation[0]), leastAttenuation);
        const double core = std::min(constant / std::max(double(light.attenuation[2]), 1e-12), 1e12);
        for (int k = 0; k < 3; k++) numbers.push_back(light.position[k] - eye[k]);
        numbers.push_back(light.range);
        for (int k = 0; k < 3; k++) numbers.push_back(light.color[k]);
        numbers.push_back(light.intensity);
        numbers.insert(numbers.end(), {constant, light.attenuation[1], light.attenuation[2], core});
    }
    if (numbers.empty()) numbers.assign(4 * lampRows, 0.);
    return numbers;
}

inline std::vector<double> deriveTowardsSun(const Params& p, const brume::DeriveContext&) {
    const cv::Vec3d s = cv::Vec3d(p.sun_direction);
    const double length = cv::norm(s);
    if (!(length > 0)) return {0, 1, 0};
    return {s[0] / length, s[1] / length, s[2] / length};
}

inline brume::NoiseLattice latticeAtEye(const Params& p, const brume::DeriveContext& c, cv::Vec3d& fraction) {
    return brume::noiseLattice(c.camera.eye(), cv::Vec3d(p.wind), c.time, p.noise_size, noisePeriod,
                               uint32_t(p.noise_seed), fraction);
}

inline std::vector<double> deriveNoiseCell(const Params& p, const brume::DeriveContext& c) {
    cv::Vec3d fraction;
    const brume::NoiseLattice lattice = latticeAtEye(p, c, fraction);
    return {double(lattice.cellX), double(lattice.cellY), double(lattice.cellZ)};
}

inline std::vector<double> deriveNoiseFraction(const Params& p, const brume::DeriveContext& c) {
    cv::Vec3d fraction;
    latticeAtEye(p, c, fraction);
    return {fraction[0], fraction[1], fraction[2]};
}

// The sun's row of the sidecar that names a shadow map, or null.
inline const nlohmann::json* shadowLight(const std::shared_ptr<const nlohmann::json>& extras) {
    if (!extras || !extras->is_object() || !extras->contains("lights")) return nullptr;
    for (const auto& light : extras->at("lights"))
        if (light.is_object() && light.value("type", "") == "directional")
            return light.contains("world_to_shadow") ? &light : nullptr;
    return nullptr;
}

// Rows u, v, δ of the way from the eye into the shadow map; δ less the bias. All 0: nothing is in shadow.
inline std::vector<double> deriveShadow(const Params& p, const brume::DeriveContext& c) {
    std::vector<double> rows(12, 0.);
    const nlohmann::json* light = shadowLight(c.extras);
    if (!light) return rows;
    const auto m = light->at("world_to_shadow").get<std::vector<double>>();
    if (m.size() != 16 || m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
        brume::failUsage(
            "volume_fog: the sidecar's world_to_shadow must be 16 numbers, row by row, ending in 0, 0, 0, 1");
    const cv::Vec3d eye = c.camera.eye();
    for (int r = 0; r < 3; r++) {
        for (int k = 0; k < 3; k++) rows[4 * r + k] = m[4 * r + k];
        rows[4 * r + 3] = m[4 * r] * eye[0] + m[4 * r + 1] * eye[1] + m[4 * r + 2] * eye[2] + m[4 * r + 3];
    }
    rows[11] -= p.shadow_bias * std::sqrt(m[8] * m[8] + m[9] * m[9] + m[10] * m[10]);
    return rows;
}

}  // namespace volume_fog
