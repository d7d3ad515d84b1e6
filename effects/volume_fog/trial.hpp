// Methods of volume_fog tried on some of a frame's rays.
#pragma once

#include <memory>
#include <vector>

#include "common/trial.hpp"
#include "effect/plan.hpp"
#include "volume_fog/derive.hpp"
#include "volume_fog/methods.hpp"

namespace volume_fog {

static_assert(brume::trialWidth == tileWidth);

// The rays that tell most: the frame's probes, one of every tile, and more beside lamps and through boxes.
class Rays {
  public:
    Rays(const Params& p, const brume::PlanInput& in) : in_(in), rays_(brume::fewProbes(in)) {
        // A window in a wall may be all that shows the fog.
        const auto& camera = in.scene.camera;
        const auto& m = camera.worldFromCamera;
        const cv::Vec3d ahead(-m(0, 2), -m(1, 2), -m(2, 2));
        constexpr int tile = brume::ImageBounds::tile;
        for (int y = tile / 2; y < in.scene.size.height; y += tile)
            for (int x = tile / 2; x < in.scene.size.width; x += tile)
                brume::addRay(in_, ahead, x - camera.cx, y - camera.cy, rays_);
        // There steps count most.
        for (const PointLight& lamp : p.point_lights)
            for (double beside : {.5, 2., 6., 18., 54.})
                for (int turn = 0; turn < 4; turn++)
                    add(cv::Vec3d(lamp.position), turn % 2 ? 0 : (1 - turn) * beside,
                        turn % 2 ? (2 - turn) * beside : 0);
        // Boxes may be small on the frame.
        for (const Box& box : p.boxes) {
            add(box.center);
            for (int corner = 0; corner < 8; corner++) {
                cv::Vec3d place = box.center;
                for (int k = 0; k < 3; k++) place[k] += (corner >> k & 1 ? .4 : -.4) * double(box.size[k]);
                add(place);
            }
        }
        if (!rays_.empty()) rays_ = brume::Trial::filled(rays_);
    }
    const std::vector<brume::Probe>& all() const { return rays_; }

  private:
    const brume::PlanInput& in_;
    std::vector<brume::Probe> rays_;

    void add(const cv::Vec3d& place, double right = 0, double down = 0) {
        brume::addRay(in_, place - in_.scene.camera.eye(), right, down, rays_);
    }
};

// The march over tiles of rays.
class RayMarch {
  public:
    RayMarch(const Params& p, const brume::PlanInput& in, const std::vector<brume::Probe>& rays)
        : p_(p), rays_(rays) {
        const std::pair<const char*, std::vector<double> (*)(const Params&, const brume::DeriveContext&)>
            constants[] = {{"volume_count", deriveVolumeCount},
                           {"volumes", deriveVolumes},
                           {"lamps", deriveLamps},
                           {"towards_sun", deriveTowardsSun},
                           {"shadow", deriveShadow},
                           {"noise_cell", deriveNoiseCell},
                           {"noise_fraction", deriveNoiseFraction}};
        for (const auto& [name, derive] : constants) {
            const std::vector<double> numbers = derive(p, in.scene);
            derived_[name].assign(numbers.begin(), numbers.end());
        }
        context_.derivedValues = &derived_;
        context_.view.width = int(rays.size());
        context_.view.frameIndex = in.scene.frameIndex;
        context_.view.seed = in.scene.seed;
        context_.images["shadow_map"] = cv::Mat::zeros(1, 1, CV_32FC4);
        for (const auto& [name, image] : in.captured) context_.images[name] = image;
        // What the marches' own stopping looks at: the brighter of what each ray may arrive with.
        context_.input.create(1, int(rays.size()), CV_32FC4);
        for (int x = 0; x < context_.input.cols; x++)
            for (int n = 0; n < 3; n++)
                context_.input.at<cv::Vec4f>(0, x)[n] =
                    float(std::max(std::abs(rays_[x].low[n]), std::abs(rays_[x].high[n])));
    }

    void operator()(int tile, const Params& p, brume::TrialOutcome& outcome) const {
        const auto m = std::make_unique<March>(p, context_);
        const int strides = stridesOf(p);
        prepare(*m, tile, strides);
        passLamps(*m);
        startMarch(*m);
        marchTile(*m, strides);
        const cv::Vec3f albedo = commonAlbedo(*m);
        for (int x = 0; x < tileWidth; x++) {
            outcome.through[x] = brume::extinctionOf(m->tile.depth[x]).transmittance;
            outcome.added[0][x] = m->tile.red[x] * albedo[0];
            outcome.added[1][x] = m->tile.green[x] * albedo[1];
            outcome.added[2][x] = m->tile.blue[x] * albedo[2];
        }
    }
    /// Share of the rays' fogged length that is within the range of lamps, summed over lamps.
    double lampShare() const {
        const auto m = std::make_unique<March>(p_, context_);
        double within = 0, whole = 1e-30;
        for (int tile = 0; tile < int(rays_.size()) / tileWidth; tile++) {
            prepare(*m, tile, 1);
            passLamps(*m);
            for (int x = 0; x < tileWidth; x++) {
                const double begin = m->tile.begin[x], end = begin + m->tile.stride[x];
                whole += end - begin;
                for (int k = 0; k < m->lampCount; k++)
                    within += std::max(0., std::min(end, double(m->lamps[k].leave[x])) -
                                               std::max(begin, double(m->lamps[k].enter[x])));
            }
        }
        return within / whole;
    }

  private:
    const Params& p_;
    const std::vector<brume::Probe>& rays_;
    brume::DerivedValues derived_;
    brume::CpuContext context_;

    void prepare(March& m, int tile, int strides) const {
        m.tile.column = tile * tileWidth, m.tile.row = 0;
        takeTile<4>(m, m.c.input, m.tile.scene);
        for (int x = 0; x < tileWidth; x++) {
            const brume::Probe& ray = rays_[size_t(tile) * tileWidth + x];
            m.tile.dx[x] = float(ray.direction[0]);
            m.tile.dy[x] = float(ray.direction[1]);
            m.tile.dz[x] = float(ray.direction[2]);
            m.tile.far[x] = float(std::min(ray.distance, double(m.p.max_distance)));
        }
        clipVolumes(m, strides);
    }
};

}  // namespace volume_fog
