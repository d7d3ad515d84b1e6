// noise_fog tried on some of a frame's rays.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "common/trial.hpp"
#include "noise_fog/derived.hpp"
#include "noise_fog/tile.hpp"

namespace brume::noise_fog {

// The method that tends to the truth: procedural noise in ever more steps.
constexpr int exactly = -1;

// What the CPU half makes of rays: their noise, and the fog of a noise.
class RayFog {
  public:
    RayFog(const NoiseFog& p, const PlanInput& in, const std::vector<Probe>& rays, Texels& texels)
        : p_(p), rays_(rays) {
        p_.method = procedural;
        const std::pair<const char*, std::vector<double> (*)(const NoiseFog&, const DeriveContext&)>
            constants[] = {{"noise_cell", noiseCell},
                           {"noise_fraction", noiseFraction},
                           {"inverse_size", inverseSize},
                           {"inverse_distance", inverseDistance},
                           {"to_sun", toSun},
                           {"baked_edge", bakedEdge},
                           {"baked", bakedNoise},
                           {"axis_log", axisLog},
                           {"axis_points", axisPoints},
                           {"axis_begin", axisBegin}};
        for (const auto& [name, derive] : constants) {
            const std::vector<double> numbers = derive(p_, in.scene);
            derived_[name].assign(numbers.begin(), numbers.end());
        }
        CpuContext context;
        context.derivedValues = &derived_;
        constants_ = constantsOf(p_, context);
        // A baked volume costs more than a frame; of its texels, a few are looked up here, most of them
        // often.
        constants_.edge = p_.edge();
        constants_.texels = &texels;
    }

    BRUME_VECTORISE void noiseOf(int tile, int method, int steps, float* noise) const {
        Tile t;
        place(tile, t);
        NoiseFog p = p_;
        p.method = method == exactly ? int(procedural) : method, p.steps = steps;
        pixelNoiseTile(p, constants_, t.L, trialWidth, t);
        for (int x = 0; x < trialWidth; x++) noise[x] = t.noise[x];
    }
    BRUME_VECTORISE void fogOf(int tile, const float* noise, TrialOutcome& outcome) const {
        Tile t;
        place(tile, t);
        for (int x = 0; x < trialWidth; x++) t.noise[x] = noise[x];
        noisyTile(p_, constants_, t.L, trialWidth, t);
        for (int x = 0; x < trialWidth; x++) {
            outcome.through[x] = t.transmittance[0][x];
            for (int n = 0; n < 3; n++)
                outcome.added[n][x] =
                    t.opacity[0][x] * (constants_.varyingAirlight ? t.airlight[n][x] : p_.color[n]);
        }
    }

  private:
    NoiseFog p_;
    const std::vector<Probe>& rays_;
    DerivedValues derived_;
    Constants constants_;

    // Rays of unit length: their planar depth is the distance.
    void place(int tile, Tile& t) const {
        for (int x = 0; x < trialWidth; x++) {
            const Probe& ray = rays_[size_t(tile) * trialWidth + x];
            t.length[x] = 1;
            t.L[x] = float(ray.distance);
            for (int n = 0; n < 3; n++) t.ray[n][x] = float(ray.direction[n]);
        }
    }
};

inline Trial::Fog fogOn(const NoiseFog& p, const PlanInput& in, const std::vector<Probe>& rays,
                        Texels& texels) {
    auto fog = std::make_shared<const RayFog>(p, in, rays, texels);
    return [fog](int tile, int method, int steps, TrialOutcome& outcome) {
        float noise[trialWidth];
        fog->noiseOf(tile, method, steps, noise);
        fog->fogOf(tile, noise, outcome);
    };
}

// Those of the rays whose fog shows the noise at all: near ones have none of it, and in far ones it is opaque
// or has its mean.
inline std::vector<Probe> showingNoise(const NoiseFog& p, const PlanInput& in, std::vector<Probe> rays,
                                       Texels& texels) {
    rays = Trial::filled(std::move(rays));
    const RayFog fog(p, in, rays, texels);
    std::vector<char> shows(rays.size());
    cv::parallel_for_({0, int(rays.size()) / trialWidth}, [&](const cv::Range& tiles) {
        for (int tile = tiles.start; tile < tiles.end; tile++) {
            constexpr int levels = 5;
            TrialOutcome outcomes[levels];
            for (int level = 0; level < levels; level++) {
                float noise[trialWidth];
                for (int x = 0; x < trialWidth; x++) {
                    const double distance = rays[size_t(tile) * trialWidth + x].distance;
                    const double share =
                        p.where == alongTheRay && distance > p.range ? p.range / distance : 1;
                    noise[x] = float(.5 + share * (level / (levels - 1.) - .5));
                }
                fog.fogOf(tile, noise, outcomes[level]);
            }
            for (int x = 0; x < trialWidth; x++) {
                const size_t k = size_t(tile) * trialWidth + x;
                double difference = 0;
                for (int level = 0; level + 1 < levels; level++)
                    difference += differenceAt(in, rays[k], outcomes[level], outcomes[level + 1], x);
                shows[k] = difference > in.tolerance / 8;
            }
        }
    });
    std::vector<Probe> kept;
    for (size_t k = 0; k < rays.size(); k++)
        if (shows[k]) kept.push_back(rays[k]);
    return Trial::filled(kept);
}

// What steps along the ray and baked texels come to on rays of the frame.
class RayTrial {
  public:
    RayTrial(const NoiseFog& p, const PlanInput& in, std::vector<Probe> rays, Texels& texels)
        : p_(p),
          rays_(showingNoise(p, in, std::move(rays), texels)),
          fog_(p, in, rays_, texels),
          noise_(rays_.size()),
          trial_(
              in, rays_,
              [this](int tile, int method, int steps, TrialOutcome& outcome) {
                  float tried[trialWidth], *noise = method == exactly ? noiseAt(tile) : tried;
                  fog_.noiseOf(tile, method, steps, noise);
                  fog_.fogOf(tile, noise, outcome);
              },
              exactly, p.where == alongTheRay ? 16 : 1, p.where == alongTheRay ? 4096 : 1) {}

    /// How visible a method in so many steps is at worst; gives up where that exceeds `enough`.
    double error(int method, int steps, double enough) { return trial_.error(method, steps, enough); }
    double doubt() const { return trial_.doubt(); }
    /// Where the noise takes the last of the fog away, holes in it may have edges as hard as the fog is
    /// dense: how visible it is at most that they lie elsewhere.
    double atEdge(int method, int steps) const {
        if (p_.mode != subtractive || !(p_.strength > 1) || noise_.empty()) return 0;
        std::vector<double> errors(trial_.tiles(), 0.);
        trial_.each([&](int tile) {
            constexpr double rounding = 1e-6;
            const double error = rounding + offOf(tile, method, steps), edge = 1 / double(p_.strength);
            const auto [least, most] = std::minmax_element(noiseAt(tile), noiseAt(tile) + trialWidth);
            if (edge < *least - error || edge > *most + error) return;
            for (int sign : {-1, 1}) {
                float from[trialWidth], to[trialWidth];
                TrialOutcome a, b;
                std::fill(from, from + trialWidth, float(edge));
                std::fill(to, to + trialWidth, float(edge + sign * error));
                fog_.fogOf(tile, from, a), fog_.fogOf(tile, to, b);
                errors[tile] = std::max(errors[tile], trial_.differenceOf(a, b, tile));
            }
        });
        return *std::max_element(errors.begin(), errors.end());
    }

    static constexpr double deviations = 5;

  private:
    const NoiseFog& p_;
    std::vector<Probe> rays_;
    RayFog fog_;
    std::vector<float> noise_;  // of each ray, the truth
    Trial trial_;

    float* noiseAt(int tile) { return noise_.data() + size_t(tile) * trialWidth; }
    const float* noiseAt(int tile) const { return noise_.data() + size_t(tile) * trialWidth; }

    // By how much a tile's noise may be off at worst: errors of the noise are chance, and few rays come to an
    // edge.
    double offOf(int tile, int method, int steps) const {
        float noise[trialWidth];
        fog_.noiseOf(tile, method, steps, noise);
        double squares = 0;
        for (int x = 0; x < trialWidth; x++) squares += std::pow(double(noise[x]) - noiseAt(tile)[x], 2);
        return deviations * std::sqrt(squares / trialWidth);
    }
};

// The frame's probes, sorted by distance, since errors of noise are alike on ways of like length; along the
// ray, also rays beside the lattice's axes, where steps may keep time with cells.
inline std::vector<Probe> fewRays(const NoiseFog& p, const PlanInput& in) {
    std::vector<Probe> rays = fewProbes(in);
    if (rays.empty()) return rays;
    std::stable_sort(rays.begin(), rays.end(),
                     [](const Probe& a, const Probe& b) { return a.distance < b.distance; });
    rays = Trial::filled(rays);
    for (int axis = 0; axis < 6 && p.where == alongTheRay; axis++) {
        cv::Vec3d way;
        way[axis / 2] = axis % 2 ? 1 : -1;
        for (int y = -4; y < 4; y++)
            for (int x = -4; x < 4; x++) addRay(in, way, 12 * x + 6, 12 * y + 6, rays);
        rays = Trial::filled(rays);
    }
    return rays;
}

}  // namespace brume::noise_fog
