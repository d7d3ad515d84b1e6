// The true integral: the ray is split wherever density or light is not smooth, and each piece is halved until
// eight Gauss nodes on it agree with eight on each half.
#pragma once

#include <array>
#include <boost/math/special_functions/legendre.hpp>

#include "volume_fog/field.hpp"

namespace volume_fog::truth {

struct Integral {
    double depth = 0;  // τ
    cv::Vec3d scattered;
    double doubt = 0;  // what halving still changed where it had to stop
};

constexpr int pieceNodes = 8;

/// Nodes and weights on 0..1, and ∫ from 0 to node i of the polynomial that is 1 at node j and 0 at the
/// others.
struct GaussRule {
    std::array<double, pieceNodes> at, weight;
    std::array<std::array<double, pieceNodes>, pieceNodes> before;

    GaussRule() {
        const std::vector<double> zeros = boost::math::legendre_p_zeros<double>(pieceNodes);  // those ≥ 0
        for (int k = 0; k < pieceNodes / 2; k++) {
            at[pieceNodes / 2 + k] = .5 + .5 * zeros[k];
            at[pieceNodes / 2 - 1 - k] = .5 - .5 * zeros[k];
        }
        for (int j = 0; j < pieceNodes; j++) {
            std::vector<double> basis = {1};  // coefficients, lowest first
            for (int k = 0; k < pieceNodes; k++) {
                if (k == j) continue;
                std::vector<double> next(basis.size() + 1, 0.);
                for (size_t n = 0; n < basis.size(); n++) {
                    next[n] -= basis[n] * at[k] / (at[j] - at[k]);
                    next[n + 1] += basis[n] / (at[j] - at[k]);
                }
                basis = next;
            }
            auto integral = [&](double x) {
                double sum = 0;
                for (size_t n = 0; n < basis.size(); n++) sum += basis[n] * std::pow(x, n + 1.) / (n + 1.);
                return sum;
            };
            weight[j] = integral(1);
            for (int i = 0; i < pieceNodes; i++) before[i][j] = integral(at[i]);
        }
    }
    static const GaussRule& rule() {
        static const GaussRule instance;
        return instance;
    }
};

class Integrator {
  public:
    explicit Integrator(const Ray& ray) : ray_(ray) {}

    Integral over(std::vector<double> places) {
        std::sort(places.begin(), places.end());
        for (size_t k = 1; k < places.size(); k++) {
            const double a = places[k - 1], b = places[k];
            if (!(b > a)) continue;
            if (sum_.depth > 60) break;
            // What is inside does not change within a piece.
            const double middle = .5 * (a + b);
            walls_.clear();
            lamps_.clear();
            for (const Wall& w : ray_.s.walls) {
                const auto [enter, leave] = ray_.inside(w);
                if (middle > enter && middle < leave) walls_.push_back(&w);
            }
            if (walls_.empty()) continue;
            for (const PointLight& l : ray_.s.p.point_lights) {
                const auto [enter, leave] = ray_.inRange(l);
                if (middle > enter && middle < leave && l.intensity > 0) lamps_.push_back(&l);
            }
            halve(a, b, onPiece(a, b), 0);
        }
        return sum_;
    }

  private:
    struct Piece {
        double depth = 0;
        cv::Vec3d scattered;  // as if nothing were before it
    };

    Piece onPiece(double a, double b) {
        const GaussRule& rule = GaussRule::rule();
        std::array<double, pieceNodes> density;
        std::array<cv::Vec3d, pieceNodes> source;
        for (int j = 0; j < pieceNodes; j++) {
            const double t = a + (b - a) * rule.at[j];
            const double noise = ray_.noise(t);
            cv::Vec3d light = ray_.skyLight(t), tinted;
            for (const PointLight* l : lamps_) {
                const double intensity = ray_.lampLight(*l, t);
                for (int k = 0; k < 3; k++) light[k] += l->color[k] * intensity;
            }
            density[j] = 0;
            for (const Wall* w : walls_) {
                const double one = ray_.insideDensity(*w, t) * noise;
                density[j] += one;
                tinted += w->albedo * one;
            }
            source[j] = tinted.mul(light);
        }
        budget_ -= pieceNodes;
        Piece piece;
        for (int i = 0; i < pieceNodes; i++) {
            double before = 0;
            for (int j = 0; j < pieceNodes; j++) before += rule.before[i][j] * density[j];
            piece.scattered += source[i] * (rule.weight[i] * (b - a) * std::exp(-(b - a) * before));
            piece.depth += rule.weight[i] * density[i] * (b - a);
        }
        return piece;
    }

    void halve(double a, double b, const Piece& whole, int generation) {
        const double middle = .5 * (a + b);
        const Piece left = onPiece(a, middle), right = onPiece(middle, b);
        const double through = std::exp(-sum_.depth);
        const cv::Vec3d both = left.scattered + right.scattered * std::exp(-left.depth);
        double change = std::abs(left.depth + right.depth - whole.depth), size = 1;
        for (int k = 0; k < 3; k++) {
            change = std::max(change, std::abs(both[k] - whole.scattered[k]));
            size = std::max(size, std::abs(sum_.scattered[k]));
        }
        change *= through;
        // All light of a very dense piece comes from its first millimetres, which the nodes would miss.
        const bool isDone = change <= 1e-11 * size && whole.depth * through < 4;
        if (isDone || generation > 40 || budget_ < 0 || !(middle > a) || !(b > middle)) {
            sum_.scattered += both * through;
            sum_.depth += left.depth + right.depth;
            if (!isDone) sum_.doubt += change;
            return;
        }
        halve(a, middle, left, generation + 1);
        halve(middle, b, right, generation + 1);
    }

    const Ray& ray_;
    std::vector<const Wall*> walls_;
    std::vector<const PointLight*> lamps_;
    Integral sum_;
    long budget_ = 40000;  // evaluations
};

/// Where density or light may have a kink or a jump, within [0, far].
inline std::vector<double> breaks(const Ray& ray) {
    const Scene& s = ray.s;
    std::vector<double> places = {0, ray.far};
    auto add = [&](double t) {
        if (t > 0 && t < ray.far) places.push_back(t);
    };
    auto addPlane = [&](int axis, double place) {
        if (ray.d[axis] != 0) add((place - s.eye[axis]) / ray.d[axis]);
    };
    for (const Wall& w : s.walls) {
        const auto [enter, leave] = ray.inside(w);
        add(enter);
        add(leave);
        if (w.heightFalloff != NoFalloff) addPlane(1, w.heightStart);
        if (w.heightFalloff != NoFalloff) addPlane(1, w.heightStart + std::max(w.heightDistance, 0.));
        for (int k = 0; k < 2 && w.edgeFalloff != NoFalloff; k++)
            for (double side : {-1., 0., 1.}) addPlane(2 * k, w.centre[k] + side * w.edgeStart[k]);
    }
    for (const PointLight& l : s.p.point_lights) {
        const auto [enter, leave] = ray.inRange(l);
        add(enter);
        add(leave);
        add(ray.along(l));
    }
    if (s.p.noise != NoNoise) {
        // Its kernels are smooth enough between half cells; where there are very many, halving finds them.
        const double count = std::min(2 * ray.far / s.p.noise_size, 256.);
        for (int k = 1; k < count; k++) add(ray.far * k / count);
    }
    if (s.shadow.exists) {
        const cv::Vec3d from = ray.shadowPlace(0), perMetre = ray.shadowPlace(1) - from;
        const int sizes[2] = {s.shadow.map.cols, s.shadow.map.rows};
        std::vector<double> crossings = {0, ray.far};
        for (int k = 0; k < 2; k++)
            for (int line = 0; line <= sizes[k] && perMetre[k] != 0; line++) {
                const double t = (line - from[k]) / perMetre[k];
                if (t > 0 && t < ray.far) crossings.push_back(t);
            }
        std::sort(crossings.begin(), crossings.end());
        for (size_t k = 1; k < crossings.size(); k++) {
            // Lit or not changes at texels' borders and where the ray passes a texel's depth.
            const cv::Vec3d place = ray.shadowPlace(.5 * (crossings[k - 1] + crossings[k]));
            add(crossings[k]);
            if (place[0] < 0 || place[1] < 0 || place[0] >= sizes[0] || place[1] >= sizes[1] ||
                perMetre[2] == 0)
                continue;
            const double stored = s.shadow.depthAt(int(place[0]), int(place[1]));
            for (double depth : {stored, 1.}) {
                const double t = (depth + s.shadow.bias - from[2]) / perMetre[2];
                if (t > crossings[k - 1] && t < crossings[k]) add(t);
            }
        }
    }
    return places;
}

}  // namespace volume_fog::truth
