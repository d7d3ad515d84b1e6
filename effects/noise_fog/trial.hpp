// noise_fog tried on some of a frame's rays.
#pragma once

#include <utility>
#include <vector>

#include "common/trial.hpp"
#include "noise_fog/derived.hpp"
#include "noise_fog/tile.hpp"

namespace brume::noise_fog {

// What the CPU half makes of rays: their noise, and the fog of a noise.
class RayFog {
  public:
    RayFog(const NoiseFog& p, const PlanInput& in, const std::vector<Probe>& rays) : p_(p), rays_(rays) {
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
    }

    BRUME_VECTORISE void noiseOf(int tile, int steps, float* noise) const {
        Tile t;
        place(tile, t);
        NoiseFog p = p_;
        p.steps = steps;
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

// What steps along the ray, and errors of the noise, come to on the frame's probes.
class RayTrial {
  public:
    RayTrial(const NoiseFog& p, const PlanInput& in)
        : p_(p),
          rays_(in.frame.probes.empty() ? in.frame.probes : Trial::filled(in.frame.probes)),
          fog_(p, in, rays_),
          noise_(rays_.size()),
          trial_(
              in, rays_,
              [this](int tile, int method, int steps, TrialOutcome& outcome) {
                  float noise[trialWidth];
                  fog_.noiseOf(tile, steps, noise);
                  if (method == exactly) std::copy(noise, noise + trialWidth, noiseAt(tile));
                  fog_.fogOf(tile, noise, outcome);
              },
              exactly, 1024) {}

    /// As visible as noise that is off by `error` can be.
    double offBy(double error) const {
        return worst([&](int tile, float* from, float* to, int sign) {
            for (int x = 0; x < trialWidth; x++) {
                from[x] = noiseAt(tile)[x];
                to[x] = std::clamp(from[x] + float(sign * error), 0.0f, 1.0f);
            }
        });
    }
    /// As visible as so many steps along the ray; gives up where that exceeds `enough`.
    double inSteps(int steps, double enough) {
        if (p_.where != alongTheRay) return 0;
        return trial_.error(procedural, steps, enough) + trial_.doubt();
    }
    /// Where the noise takes the last of the fog away, holes in it may have edges as hard as the fog is
    /// dense: how visible it is at most that they lie elsewhere, the noise being off by what so many steps
    /// cost and `error`.
    double atEdge(int steps, double error) const {
        if (p_.mode != subtractive || !(p_.strength > 1) || noise_.empty()) return 0;
        std::vector<float> off(trial_.tiles(), 0.0f);
        trial_.each([&](int tile) {
            float noise[trialWidth];
            if (p_.where == alongTheRay) fog_.noiseOf(tile, steps, noise);
            for (int x = 0; x < trialWidth && p_.where == alongTheRay; x++)
                off[tile] = std::max(off[tile], std::abs(noise[x] - noiseAt(tile)[x]));
        });
        constexpr double rounding = 1e-6;
        error += rounding + 2 * double(*std::max_element(off.begin(), off.end()));
        const auto [least, most] = std::minmax_element(noise_.begin(), noise_.end());
        const double edge = 1 / double(p_.strength);
        if (edge < *least - error || edge > *most + error) return 0;
        return worst([&](int, float* from, float* to, int sign) {
            std::fill(from, from + trialWidth, float(edge));
            std::fill(to, to + trialWidth, float(edge + sign * error));
        });
    }

  private:
    static constexpr int exactly = -1;

    const NoiseFog& p_;
    std::vector<Probe> rays_;
    RayFog fog_;
    std::vector<float> noise_;  // of each ray
    Trial trial_;

    float* noiseAt(int tile) { return noise_.data() + size_t(tile) * trialWidth; }
    const float* noiseAt(int tile) const { return noise_.data() + size_t(tile) * trialWidth; }

    // The most visible difference between two noises, one of them to either side of the other.
    template <class Noises>
    double worst(const Noises& noises) const {
        std::vector<double> differences(trial_.tiles() + 1, 0.);
        trial_.each([&](int tile) {
            for (int sign : {-1, 1}) {
                float from[trialWidth], to[trialWidth];
                TrialOutcome a, b;
                noises(tile, from, to, sign);
                fog_.fogOf(tile, from, a), fog_.fogOf(tile, to, b);
                differences[tile] = std::max(differences[tile], trial_.differenceOf(a, b, tile));
            }
        });
        return *std::max_element(differences.begin(), differences.end());
    }
};

}  // namespace brume::noise_fog
