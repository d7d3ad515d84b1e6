// Methods of volume_fog tried on some of a frame's rays by the CPU half itself: a tile of 64 rays from all
// over the frame costs what a tile of neighbours does, so hundreds of rays are some thousandths of a frame.
#pragma once

#include <memory>
#include <vector>

#include "effect/plan.hpp"
#include "volume_fog/derive.hpp"
#include "volume_fog/methods.hpp"

namespace volume_fog {

class Trial {
  public:
    Trial(const Params& p, const brume::PlanInput& in) : p_(p), in_(in), rays_(in.frame.probes) {
        addLamps();
        addBoxes();
        count_ = int(rays_.size() + tileWidth - 1) / tileWidth;
        while (!rays_.empty() && int(rays_.size()) < count_ * tileWidth) rays_.push_back(rays_.back());
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
        context_.view.width = count_ * tileWidth;
        context_.view.frameIndex = in.scene.frameIndex;
        context_.view.seed = in.scene.seed;
        context_.images["shadow_map"] = cv::Mat::zeros(1, 1, CV_32FC4);
        for (const auto& [name, image] : in.captured) context_.images[name] = image;
        // What the marches' own stopping looks at: the brighter of what each ray may arrive with.
        context_.input.create(1, count_ * tileWidth, CV_32FC4);
        for (int x = 0; x < context_.input.cols; x++)
            for (int n = 0; n < 3; n++)
                context_.input.at<cv::Vec4f>(0, x)[n] =
                    float(std::max(std::abs(rays_[x].low[n]), std::abs(rays_[x].high[n])));
        truth_.resize(count_);
        doubt_.resize(count_);
        each([&](int tile) { findTruth(tile); });
    }

    /// The worst visible error of a method over all rays; gives up where it exceeds `enough`.
    double error(int method, int steps, double enough) {
        Params p = p_;
        p.method = method, p.steps = steps;
        if (count_ == 0) return 0;
        // The rays that the last method failed at are likely to fail again.
        const double first = errorOf(outcomeOf(p, worst_), worst_);
        if (first > enough) return first;
        std::vector<double> errors(count_, first);
        each([&](int tile) {
            if (tile != worst_) errors[tile] = errorOf(outcomeOf(p, tile), tile);
        });
        worst_ = int(std::max_element(errors.begin(), errors.end()) - errors.begin());
        return errors[worst_];
    }
    /// How far the truth itself may be off, as it shows.
    double doubt() const { return doubt_.empty() ? 0 : *std::max_element(doubt_.begin(), doubt_.end()); }
    /// Share of the rays' fogged length that is within the range of lamps, summed over lamps.
    double lampShare() const {
        const auto m = std::make_unique<March>(p_, context_);
        double within = 0, whole = 1e-30;
        for (int tile = 0; tile < count_; tile++) {
            prepare(*m, tile, 1);
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
    struct Outcome {
        float depth[tileWidth], color[3][tileWidth];
    };

    const Params& p_;
    const brume::PlanInput& in_;
    std::vector<brume::Probe> rays_;
    int count_ = 0, worst_ = 0;  // tiles; the one where the last method failed
    brume::DerivedValues derived_;
    brume::CpuContext context_;
    std::vector<Outcome> truth_;
    std::vector<double> doubt_;

    template <class Work>
    void each(const Work& work) const {
        cv::parallel_for_({0, count_}, [&](const cv::Range& range) {
            for (int tile = range.start; tile < range.end; tile++) work(tile);
        });
    }

    void prepare(March& m, int tile, int strides) const {
        m.tile.column = tile * tileWidth, m.tile.row = 0;
        for (int x = 0; x < tileWidth; x++) {
            const brume::Probe& ray = rays_[size_t(tile) * tileWidth + x];
            m.tile.dx[x] = float(ray.direction[0]);
            m.tile.dy[x] = float(ray.direction[1]);
            m.tile.dz[x] = float(ray.direction[2]);
            m.tile.far[x] = float(std::min(ray.distance, double(m.p.max_distance)));
        }
        clipVolumes(m, strides);
    }
    Outcome outcomeOf(const Params& p, int tile) const {
        const auto m = std::make_unique<March>(p, context_);
        const int strides = stridesOf(p);
        prepare(*m, tile, strides);
        passLamps(*m);
        startMarch(*m);
        marchTile(*m, strides);
        Outcome outcome;
        const cv::Vec3f albedo = commonAlbedo(*m);
        for (int x = 0; x < tileWidth; x++) {
            outcome.depth[x] = m->tile.depth[x];
            outcome.color[0][x] = m->tile.red[x] * albedo[0];
            outcome.color[1][x] = m->tile.green[x] * albedo[1];
            outcome.color[2][x] = m->tile.blue[x] * albedo[2];
        }
        return outcome;
    }

    double differenceOf(const Outcome& a, const Outcome& b, int tile) const {
        double most = 0;
        // The curve is nowhere steeper than at 0: most differences need not be encoded.
        const double steepest = 12.92 * in_.gain;
        auto take = [&](double x, double y) {
            if (!(std::abs(x - y) * steepest <= most)) most = std::max(most, in_.visible(x, y));
        };
        for (int x = 0; x < tileWidth; x++) {
            const brume::Probe& ray = rays_[size_t(tile) * tileWidth + x];
            const double through = std::exp(-double(a.depth[x])), other = std::exp(-double(b.depth[x]));
            for (int n = 0; n < 3; n++) {
                take(ray.low[n] * through + a.color[n][x], ray.low[n] * other + b.color[n][x]);
                if (ray.high[n] != ray.low[n])
                    take(ray.high[n] * through + a.color[n][x], ray.high[n] * other + b.color[n][x]);
            }
        }
        return most;
    }
    double errorOf(const Outcome& got, int tile) const { return differenceOf(truth_[tile], got, tile); }

    // A ray through a place of the world, if the frame shows it.
    void addRay(const cv::Vec3d& place, double right = 0, double down = 0) {
        const auto& camera = in_.scene.camera;
        const auto& m = camera.worldFromCamera;
        const cv::Vec3d way = place - camera.eye();
        cv::Vec3d v;  // as the camera sees it
        for (int n = 0; n < 3; n++) v[n] = m(0, n) * way[0] + m(1, n) * way[1] + m(2, n) * way[2];
        if (!(v[2] < 0)) return;
        const double x = camera.cx - camera.fx * v[0] / v[2] + right,
                     y = camera.cy + camera.fy * v[1] / v[2] + down;
        if (!(x >= 0 && y >= 0 && x < in_.scene.size.width && y < in_.scene.size.height)) return;
        brume::Probe ray;
        ray.pixel = {int(x), int(y)};
        const cv::Vec3d d = camera.ray(ray.pixel.x, ray.pixel.y);
        for (int n = 0; n < 3; n++)
            ray.direction[n] = (m(n, 0) * d[0] + m(n, 1) * d[1] + m(n, 2) * d[2]) / cv::norm(d);
        // As far and as dark as anything there is.
        const cv::Point tile = ray.pixel / brume::ImageBounds::tile;
        ray.distance = in_.frame.farthest.at<float>(tile);
        for (int n = 0; n < 3; n++)
            ray.low[n] = ray.high[n] =
                in_.input.mean.empty() ? in_.input.low : in_.input.lowest.at<cv::Vec3f>(tile)[n];
        rays_.push_back(ray);
    }
    // Rays that pass lamps at some px: there steps count most.
    void addLamps() {
        for (const PointLight& lamp : p_.point_lights)
            for (double beside : {.5, 2., 6., 18., 54.})
                for (int turn = 0; turn < 4; turn++)
                    addRay(cv::Vec3d(lamp.position), turn % 2 ? 0 : (1 - turn) * beside,
                           turn % 2 ? (2 - turn) * beside : 0);
    }
    // Rays through boxes, which may be small on the frame.
    void addBoxes() {
        for (const Box& box : p_.boxes) {
            addRay(cv::Vec3d(box.center));
            for (int corner = 0; corner < 8; corner++) {
                cv::Vec3d place = box.center;
                for (int k = 0; k < 3; k++) place[k] += (corner >> k & 1 ? .4 : -.4) * double(box.size[k]);
                addRay(place);
            }
        }
    }

    // Twice the steps until that no longer shows, lamps by angle.
    void findTruth(int tile) {
        Params p = p_;
        p.method = p.point_lights.empty() ? Midpoint : Equiangular;
        p.early_stop = false, p.noise_every = 1;
        p.steps = 64;
        Outcome before = outcomeOf(p, tile);
        double change = 0;
        do {
            p.steps *= 2;
            truth_[tile] = outcomeOf(p, tile);
            change = differenceOf(before, truth_[tile], tile);
            before = truth_[tile];
        } while (p.steps < 4096 && change > in_.tolerance / 8);
        doubt_[tile] = change;
    }
};

}  // namespace volume_fog
