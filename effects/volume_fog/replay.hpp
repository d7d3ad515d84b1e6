// Each method in fp64, one ray at a time: what the fp32 halves would give without rounding. Tells the
// reference how far a method may be from the truth, and where a comparison within rounding decides.
#pragma once

#include "volume_fog/field.hpp"

namespace volume_fog::truth {

struct Replayed {
    double depth = 0;
    cv::Vec3d scattered;
    double transmittance = 1;
    double lightRounding = 0, depthRounding = 0;  ///< what fp32 may round away of the sums
    bool ambiguous = false;
};

class Replay {
  public:
    Replay(const Ray& ray, const cv::Vec4f& scene, cv::Point pixel, int frameIndex, uint32_t seed)
        : ray_(ray), p_(ray.s.p), pixel_(pixel), key_(seed ^ (uint32_t(frameIndex) * 0x9e3779b9u)) {
        for (const Wall& w : ray.s.walls) {
            auto [enter, leave] = ray.inside(w);
            const bool isHit = enter < leave;
            if (isHit) begin_ = std::min(begin_, enter), end_ = std::max(end_, leave);
            inside_.emplace_back(isHit ? enter : 1, isHit ? leave : -1);
            // Along a face, within rounding of it: inside or not.
            for (int k = 0; k < 3; k++)
                for (double face : {w.low[k] - ray.s.eye[k], w.high[k] - ray.s.eye[k]})
                    if (std::abs(ray.d[k]) < 1e-6 && std::abs(face) < 1e-6 * ray.far)
                        result_.ambiguous = true;
        }
        stop_ = stoppingDepth(scene);
    }

    Replayed run() {
        if (p_.method == P2) return runP2();
        if (end_ <= begin_) return result_;
        if (p_.method == GaussLegendre)
            runPanels();
        else
            runSteps();
        result_.transmittance = std::exp(-result_.depth);
        return result_;
    }

  private:
    struct Sample {
        double depth = 0;  // of the step
        cv::Vec3d light;   // times the mixture's albedo
    };

    double stoppingDepth(const cv::Vec4f& scene) const {
        if (!p_.early_stop) return HUGE_VAL;
        cv::Vec3d light;
        const double strongest = p_.phase == HenyeyGreenstein ? .25 * (1 - p_.anisotropy * p_.anisotropy) /
                                                                    std::pow(1 - std::abs(p_.anisotropy), 3.)
                                                              : share(p_, 1);
        for (int k = 0; k < 3; k++) {
            light[k] = double(p_.ambient[k]) * p_.ambient_intensity +
                       double(p_.sun_color[k]) * p_.sun_intensity * share(p_, ray_.d.dot(ray_.s.sun));
            for (const PointLight& l : p_.point_lights) {
                const auto [enter, leave] = ray_.inRange(l);
                const double apart = cv::norm(cv::Vec3d(l.position) - ray_.at(ray_.along(l)));
                if (enter < leave && leave > 0)
                    light[k] += l.color[k] * l.intensity * strongest / Ray::attenuation(l, apart);
            }
        }
        double brightest = std::max({light[0], light[1], light[2], 1e-30});
        for (int k = 0; k < 3; k++)
            brightest = std::isfinite(scene[k]) ? std::max(brightest, std::abs(double(scene[k]))) : HUGE_VAL;
        if (std::isinf(brightest)) return 97;
        // log2 linear between powers of two, raised by its largest lack
        int exponent;
        const double mantissa = std::frexp(brightest, &exponent);
        return std::max(0., ((exponent - 1) + (2 * mantissa - 1) + .0861 + std::log2(26356.)) * std::log(2.));
    }

    double placeIn(int step) const {
        if (p_.method == Left || p_.method == P2) return 0;
        if (p_.method != Jittered) return .5;
        return (brume::latticeHash(uint32_t(pixel_.x), uint32_t(pixel_.y), uint32_t(step), key_) >> 8) /
               16777216.;
    }

    // Steps between knots of the noise: on short rays noise_every times a power of two, so that they are no
    // farther apart than on one of a quarter of max_distance.
    double knotsEvery(double stride) {
        const double ratio = .485 * p_.max_distance / (stride * p_.steps);
        constexpr double most = 1 << mostDoublings;
        double times = 1;
        for (; times < most && ratio >= 2 * times; times *= 2)
            ;
        for (double threshold : {times, 2 * times})
            if (threshold > 1 && threshold <= most && std::abs(ratio / threshold - 1) < 1e-6)
                result_.ambiguous = true;
        return p_.noise_every * times;
    }

    double noise(int step, double u, double at, double stride) {
        if (p_.noise == NoNoise) return 1;
        if (p_.method == SharedNoise) return ray_.noise(begin_ + stride * (step / 2 * 2 + 1));
        if (p_.noise_every == 1 || p_.method == GaussLegendre || p_.method == P2) return ray_.noise(at);
        const double every = knotsEvery(stride), place = (step + u) / every;
        const int knot = int(std::floor(place));
        const double sign = p_.noise == Additive ? p_.noise_strength : -double(p_.noise_strength);
        double sum = 0;
        for (int i = -1; i <= 2; i++) {
            double weight = 1;
            for (int j = -1; j <= 2; j++)
                if (j != i) weight *= (place - knot - j) / (i - j);
            sum += weight * ray_.noise(begin_ + stride * every * (knot + i));
        }
        // Interpolated as n of 0..1, which the factor 1 + sign·n is linear in.
        const double n = sign != 0 ? std::clamp((sum - 1) / sign, 0., 1.) : 0;
        return 1 + sign * n;
    }

    // Light and optical depth of the step [t0, t1], sampled at the fraction u of each part of it.
    Sample sample(double t0, double t1, double u, double noiseFactor) {
        Sample s;
        cv::Vec3d tint;
        for (size_t k = 0; k < inside_.size(); k++) {
            const double a = std::max(t0, inside_[k].first), b = std::min(t1, inside_[k].second);
            if (b <= a) continue;
            const double depth = (b - a) * ray_.insideDensity(ray_.s.walls[k], a + u * (b - a)) * noiseFactor;
            s.depth += depth;
            tint += ray_.s.walls[k].albedo * depth;
        }
        if (s.depth <= 0) return s;
        const double at = t0 + u * (t1 - t0);
        s.light = ray_.skyLight(at);
        noteShadow(at);
        for (const PointLight& l : p_.point_lights) {
            const auto [enter, leave] = ray_.inRange(l);
            const double a = std::max(t0, enter), b = std::min(t1, leave);
            if (b <= a) continue;
            const double mean =
                (p_.method == Equiangular ? equiangular(l, a, b) : ray_.lampLight(l, a + u * (b - a))) *
                (b - a) / (t1 - t0);
            for (int k = 0; k < 3; k++) s.light[k] += l.color[k] * mean;
        }
        s.light = s.light.mul(tint) * (1 / s.depth);
        return s;
    }

    // Mean of a lamp over [a, b]: 1/(distance² + constant/quadratic) exactly, the rest at the middle of the
    // angle.
    double equiangular(const PointLight& l, double a, double b) const {
        const double along = ray_.along(l);
        const cv::Vec3d apart = cv::Vec3d(l.position) - ray_.at(along);
        const double core =
            std::sqrt(apart.dot(apart) + std::min(std::max(double(l.attenuation[0]), 1e-4) /
                                                      std::max(double(l.attenuation[2]), 1e-12),
                                                  1e12));
        const double from = std::atan((a - along) / core), to = std::atan((b - along) / core);
        const double beyond = core * std::tan(.5 * (from + to));
        return ray_.lampLight(l, along + beyond) * (core * core + beyond * beyond) * (to - from) / core /
               (b - a);
    }

    // Would a place that rounding may have moved be lit otherwise?
    void noteShadow(double t) {
        const Shadow& shadow = ray_.s.shadow;
        if (!shadow.exists) return;
        const cv::Vec3d place = ray_.shadowPlace(t);
        const double size = cv::norm(ray_.s.eye) * 1e-12 + 1;
        cv::Vec3d reach;
        for (int k = 0; k < 3; k++) {
            const double* r = shadow.fromWorld.val + 4 * k;
            const double scale = k == 0 ? shadow.map.cols : k == 1 ? shadow.map.rows : 1;
            reach[k] = 5e-7 * scale * size * (std::hypot(r[0], r[1], r[2]) * t + 1);
        }
        const bool isShadowed = Ray::isShadowed(shadow, place);
        for (int corner = 0; corner < 8; corner++) {
            cv::Vec3d moved = place;
            for (int k = 0; k < 3; k++) moved[k] += corner >> k & 1 ? reach[k] : -reach[k];
            if (Ray::isShadowed(shadow, moved) != isShadowed) result_.ambiguous = true;
        }
    }

    void runSteps() {
        const double stride = (end_ - begin_) / p_.steps;
        for (int i = 0; i < p_.steps && result_.depth < stop_; i++) {
            const double t0 = begin_ + stride * i, u = placeIn(i);
            const Sample s = sample(t0, t0 + stride, u, noise(i, u, t0 + u * stride, stride));
            const double depth = std::min(s.depth, stop_ - result_.depth);
            const double opacity = -std::expm1(-depth);
            result_.scattered += s.light * (std::exp(-result_.depth) * opacity);
            noteRounding(s.light, opacity);
            result_.depth += depth;
        }
    }

    // Equal steps are rounded alike, so that errors add up: each addition's is at most 2^-24 of the sum so
    // far, of light, of optical depth and of what is taken from 1 to tell what passes.
    void noteRounding(const cv::Vec3d& light, double opacity) {
        constexpr double half = 1 / 16777216.;
        const double scattered = *std::max_element(result_.scattered.val, result_.scattered.val + 3);
        result_.lightRounding +=
            half * scattered + *std::max_element(light.val, light.val + 3) * opacity * passingRounding_;
        result_.depthRounding += half * result_.depth;
        passingRounding_ += half * std::exp(-result_.depth);
    }

    // Four Gauss nodes a panel; the optical depth before node i by the integral of the cubic through the
    // densities.
    void runPanels() {
        const double inner = std::sqrt(3. / 7 - 2. / 7 * std::sqrt(6. / 5)),
                     outer = std::sqrt(3. / 7 + 2. / 7 * std::sqrt(6. / 5));
        const double at[4] = {.5 - .5 * outer, .5 - .5 * inner, .5 + .5 * inner, .5 + .5 * outer};
        const double weight[4] = {(18 - std::sqrt(30.)) / 72, (18 + std::sqrt(30.)) / 72,
                                  (18 + std::sqrt(30.)) / 72, (18 - std::sqrt(30.)) / 72};
        auto lagrange = [&](int j, double x) {
            double value = 1;
            for (int k = 0; k < 4; k++)
                if (k != j) value *= (x - at[k]) / (at[j] - at[k]);
            return value;
        };
        const int panels = (p_.steps + 3) / 4;
        const double stride = (end_ - begin_) / panels;
        for (int i = 0; i < panels && result_.depth < stop_; i++) {
            Sample s[4];
            double depth = 0, total = 0, share[4];
            for (int j = 0; j < 4; j++) {
                const double t0 = begin_ + stride * i;
                s[j] = sample(t0, t0 + stride, at[j], noise(i, at[j], t0 + at[j] * stride, stride));
                depth += weight[j] * s[j].depth;
            }
            double before[4] = {};
            for (int n = 0; n < 4; n++) {  // ∫ of the cubic from 0 to at[n], by the same rule, exact for it
                for (int k = 0; k < 4; k++)
                    for (int j = 0; j < 4; j++)
                        before[n] += at[n] * weight[k] * s[j].depth * lagrange(j, at[n] * at[k]);
                before[n] = std::max(before[n], 0.);
            }
            for (int n = 0; n < 4; n++) {
                share[n] =
                    weight[n] * s[n].depth * std::exp(*std::min_element(before, before + 4) - before[n]);
                total += share[n];
            }
            depth = std::min(depth, stop_ - result_.depth);
            const double whole = std::exp(-result_.depth) * -std::expm1(-depth);
            cv::Vec3d light;
            for (int n = 0; n < 4 && total > 0; n++) light += s[n].light * (share[n] / total);
            result_.scattered += light * whole;
            noteRounding(light, -std::expm1(-depth));
            result_.depth += depth;
        }
    }

    Replayed runP2() {
        const double stride = ray_.far / p_.steps, mixed = std::clamp(double(p_.ambient_intensity), 0., 1.);
        begin_ = 0;
        for (int i = 0; i < p_.steps; i++) {
            const double t = stride * i, noiseFactor = noise(i, 0, t, stride);
            double density = 0;
            for (size_t k = 0; k < inside_.size(); k++) {
                const Wall& w = ray_.s.walls[k];
                for (double face : {inside_[k].first, inside_[k].second})
                    if (i > 0 && std::abs(t - face) < 6e-7 * t) result_.ambiguous = true;
                if (t >= inside_[k].first && t < inside_[k].second)
                    density += stride * ray_.insideDensity(w, t) * noiseFactor / -std::log(.05);
            }
            const double sun = p_.sun_intensity * ray_.sunShare(t);
            noteShadow(t);
            cv::Vec3d light;
            for (int k = 0; k < 3; k++)
                light[k] = p_.sun_color[k] * sun + mixed * (p_.ambient[k] - p_.sun_color[k] * sun);
            for (const PointLight& l : p_.point_lights) {
                const cv::Vec3d apart = cv::Vec3d(l.position) - ray_.at(t);
                const double r = cv::norm(apart);
                const double place2 = cv::norm(cv::Vec3d(l.position) - ray_.s.eye, cv::NORM_L2SQR);
                if (std::abs(r * r - double(l.range) * l.range) < 4e-7 * place2) result_.ambiguous = true;
                if (r >= l.range) continue;
                const double amount = std::min(1., l.intensity / Ray::attenuation(l, r));
                for (int k = 0; k < 3; k++) light[k] += amount * (l.color[k] - light[k]);
            }
            density = std::min(density, result_.transmittance);
            result_.scattered += light * density;
            result_.transmittance -= density;
        }
        result_.scattered *= 1 - result_.transmittance;
        return result_;
    }

    const Ray& ray_;
    const Params& p_;
    cv::Point pixel_;
    uint32_t key_;
    double begin_ = HUGE_VAL, end_ = 0, stop_ = HUGE_VAL, passingRounding_ = 0;
    std::vector<std::pair<double, double>> inside_;
    Replayed result_;
};

}  // namespace volume_fog::truth
