// Methods tried on some of a frame's rays by the CPU half itself: a tile of rays from all over the frame
// costs what a tile of neighbours does, so hundreds of rays are some thousandths of a frame.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <set>
#include <vector>

#include "common/noise.hpp"
#include "effect/plan.hpp"

namespace brume {

constexpr int trialWidth = 64;  // rays a tile
constexpr int trialEdge = 8;    // of them where they are neighbours
static_assert(trialEdge * trialEdge == trialWidth);

/// What fog makes of the colours behind a tile of rays: colour·through + added.
struct TrialOutcome {
    float through[trialWidth], added[3][trialWidth];
};

/// Adds the ray some px beside a direction of the world, if the frame shows it, ending where its tile's fog
/// shows most.
inline void addRay(const PlanInput& in, const cv::Vec3d& way, double right, double down,
                   std::vector<Probe>& rays) {
    const auto& camera = in.scene.camera;
    const auto& m = camera.worldFromCamera;
    cv::Vec3d v;  // as the camera sees it
    for (int n = 0; n < 3; n++) v[n] = m(0, n) * way[0] + m(1, n) * way[1] + m(2, n) * way[2];
    if (!(v[2] < 0)) return;
    const double x = camera.cx - camera.fx * v[0] / v[2] + right,
                 y = camera.cy + camera.fy * v[1] / v[2] + down;
    if (!(x >= 0 && y >= 0 && x < in.scene.size.width && y < in.scene.size.height)) return;
    Probe ray;
    ray.pixel = {int(x), int(y)};
    const cv::Vec3d d = camera.ray(ray.pixel.x, ray.pixel.y);
    for (int n = 0; n < 3; n++)
        ray.direction[n] = (m(n, 0) * d[0] + m(n, 1) * d[1] + m(n, 2) * d[2]) / cv::norm(d);
    const auto hardest = in.frame.hardest.at<cv::Vec4f>(ray.pixel / ImageBounds::tile);
    for (int n = 0; n < 3; n++) ray.low[n] = ray.high[n] = hardest[n];
    ray.distance = hardest[3];
    rays.push_back(ray);
}

/// The frame's extremes and some 600 of its pixels: its first probes.
inline std::vector<Probe> fewProbes(const PlanInput& in) {
    constexpr size_t few = 6 + 4 + 32 * 18;
    const auto& all = in.frame.probes;
    return {all.begin(), all.begin() + long(std::min(few, all.size()))};
}

/// The frame's own pixels, one of each apart × apart (0: none), anywhere in it, lest a pattern of the frame
/// keep time with them: a tile of rays are neighbours, as in a frame.
inline std::vector<Probe> pixelsApart(const PlanInput& in, int apart) {
    constexpr int edge = trialEdge;
    std::vector<cv::Point> pixels;
    const cv::Size size = in.scene.size;
    auto within = [&](int x, int y) {
        const uint32_t hash = latticeHash(uint32_t(x), uint32_t(y), 0, 0);
        return cv::Point(std::min(x + int(hash % apart), size.width - 1),
                         std::min(y + int((hash >> 16) % apart), size.height - 1));
    };
    for (int top = 0; apart && top < size.height; top += edge * apart)
        for (int left = 0; left < size.width; left += edge * apart)
            for (int y = top; y < std::min(top + edge * apart, size.height); y += apart)
                for (int x = left; x < std::min(left + edge * apart, size.width); x += apart)
                    pixels.push_back(within(x, y));
    std::vector<Probe> rays(pixels.size());
    cv::parallel_for_({0, int(pixels.size())}, [&](const cv::Range& range) {
        for (int k = range.start; k < range.end; k++) rays[size_t(k)] = in.probeAt(pixels[size_t(k)]);
    });
    return rays;
}

/// How visible the difference of two outcomes is at a tile's ray x, if more than `least`.
inline double differenceAt(const PlanInput& in, const Probe& ray, const TrialOutcome& a,
                           const TrialOutcome& b, int x, double least = 0) {
    double most = least;
    // The curve is nowhere steeper than at 0: most differences need not be encoded.
    const double steepest = 12.92 * in.gain;
    auto take = [&](double from, double to) {
        if (!(std::abs(from - to) * steepest <= most)) most = std::max(most, in.visible(from, to));
    };
    for (int n = 0; n < 3; n++) {
        const double from = a.added[n][x], to = b.added[n][x];
        take(ray.low[n] * a.through[x] + from, ray.low[n] * b.through[x] + to);
        if (ray.high[n] != ray.low[n])
            take(ray.high[n] * a.through[x] + from, ray.high[n] * b.through[x] + to);
    }
    return most;
}

struct TrialOption {
    int method = 0, steps = 1;
    double cost = 0;
    bool hasFloor = false;  ///< an error that no number of steps takes away
};

class Trial {
  public:
    /// The fog on tile `tile` of the rays; called from several threads.
    using Fog = std::function<void(int tile, int method, int steps, TrialOutcome&)>;

    /// The truth is as many steps of `exact` as still change anything: twice `least`, twice that, up to
    /// `most`.
    Trial(const PlanInput& in, const std::vector<Probe>& rays, const Fog& fog, int exact, int least, int most)
        : in_(in), rays_(rays), fog_(fog), truth_(rays.size() / trialWidth), doubts_(truth_.size()) {
        each([&](int tile) {
            fog_(tile, exact, least, truth_[tile]);
            for (int steps = 2 * least; steps <= most; steps *= 2) {
                const TrialOutcome before = truth_[tile];
                fog_(tile, exact, steps, truth_[tile]);
                // What converges at all is off by less than half of what twice the steps changed.
                doubts_[tile] = differenceOf(before, truth_[tile], tile) / 2;
                if (doubts_[tile] <= in_.tolerance / 8) break;
            }
        });
    }

    /// Rays for whole tiles: the last is repeated.
    static std::vector<Probe> filled(std::vector<Probe> rays) {
        while (!rays.empty() && rays.size() % trialWidth != 0) rays.push_back(rays.back());
        return rays;
    }

    /// The worst visible error of a method over all rays; gives up where it exceeds `enough`.
    double error(int method, int steps, double enough) {
        if (truth_.empty()) return 0;
        // The rays that the last method failed at are likely to fail again.
        std::vector<double> errors(truth_.size(), 0.);
        auto measure = [&](int tile) {
            TrialOutcome got;
            fog_(tile, method, steps, got);
            errors[tile] = differenceOf(truth_[tile], got, tile);
        };
        measure(worst_);
        if (errors[worst_] > enough) return errors[worst_];
        each([&](int tile) {
            if (tile != worst_) measure(tile);
        });
        worst_ = int(std::max_element(errors.begin(), errors.end()) - errors.begin());
        return errors[worst_];
    }
    /// How far the truth itself may be off, as it shows.
    double doubt() const { return doubts_.empty() ? 0 : *std::max_element(doubts_.begin(), doubts_.end()); }

    /// How visible the difference of two outcomes is, at its worst ray.
    double differenceOf(const TrialOutcome& a, const TrialOutcome& b, int tile) const {
        double most = 0;
        for (int x = 0; x < trialWidth; x++)
            most = differenceAt(in_, rays_[size_t(tile) * trialWidth + x], a, b, x, most);
        return most;
    }
    int tiles() const { return int(truth_.size()); }
    /// Calls work(tile) for every tile, from several threads.
    template <class Work>
    void each(const Work& work) const {
        cv::parallel_for_({0, tiles()}, [&](const cv::Range& range) {
            for (int tile = range.start; tile < range.end; tile++) work(tile);
        });
    }

  private:
    const PlanInput& in_;
    const std::vector<Probe>& rays_;
    Fog fog_;
    std::vector<TrialOutcome> truth_;
    std::vector<double> doubts_;  // of each tile
    int worst_ = 0;               // the tile where the last method failed
};

/// Methods tried on the frame's own pixels. The truth of many would take longer than the frame: one in apart
/// × apart is marched by each method and by the exact one in twice the steps, and only around the pixels
/// where the two look farthest apart the truth is asked. A `Rays` is made of rays and has error(method,
/// steps, enough) and doubt().
template <class Rays>
class Screen {
  public:
    using Make = std::function<std::unique_ptr<Rays>(std::vector<Probe>)>;

    /// `first`: rays whose truth is asked whatever methods look like there.
    Screen(const PlanInput& in, int apart, int exact, std::vector<Probe> first, const Make& make,
           const std::function<Trial::Fog(const std::vector<Probe>&)>& fogOn)
        : in_(in),
          exact_(exact),
          make_(make),
          rays_(Trial::filled(pixelsApart(in, apart))),
          fog_(fogOn(rays_)),
          outcomes_(rays_.size() / trialWidth) {
        if (!first.empty()) found_.push_back(make_(std::move(first)));
    }

    double error(int method, int steps, double enough) {
        double worst = 0;
        auto take = [&](Rays& found) { worst = std::max(worst, found.error(method, steps, enough)); };
        for (const auto& found : found_) {
            take(*found);
            if (worst > enough) return worst;
        }
        if (rays_.empty()) return worst;
        // Where fewer steps, and not many fewer, look wrong, these do.
        int& last = screened_[method];
        if (last && steps <= 1.25 * last) return worst;
        last = steps;
        if (auto rays = around(apart(method, steps), std::min(enough, in_.tolerance) / 4); !rays.empty()) {
            found_.push_back(make_(std::move(rays)));
            take(*found_.back());
        }
        return worst;
    }
    /// The first rays asked, if any were.
    const Rays* first() const { return found_.empty() ? nullptr : found_.front().get(); }
    double doubt() const {
        double most = 0;
        for (const auto& found : found_) most = std::max(most, found->doubt());
        return most;
    }

  private:
    static constexpr int edge = trialEdge;  // px: where the truth is asked, it is of blocks

    const PlanInput& in_;
    int exact_;
    Make make_;
    std::vector<Probe> rays_;
    Trial::Fog fog_;
    std::vector<TrialOutcome> outcomes_;  // of the exact method ...
    int steps_ = 0;                       // ... in so many steps
    std::map<int, int> screened_;         // by method, the most steps that were
    std::vector<std::unique_ptr<Rays>> found_;
    std::set<std::pair<int, int>> asked_;  // blocks

    // How far apart the method and the exact one look at every ray.
    std::vector<float> apart(int method, int steps) {
        // One step and two may be alike wrong.
        constexpr int fewest = 8;
        const bool isCoarse = 2 * steps_ < 3 * steps;
        if (isCoarse) steps_ = std::max(2 * steps, fewest);
        std::vector<float> apart(rays_.size());
        cv::parallel_for_({0, int(outcomes_.size())}, [&](const cv::Range& range) {
            for (int tile = range.start; tile < range.end; tile++) {
                TrialOutcome got;
                if (isCoarse) fog_(tile, exact_, steps_, outcomes_[tile]);
                fog_(tile, method, steps, got);
                for (int x = 0; x < trialWidth; x++) {
                    const size_t k = size_t(tile) * trialWidth + x;
                    apart[k] = float(differenceAt(in_, rays_[k], got, outcomes_[tile], x));
                }
            }
        });
        return apart;
    }
    // All pixels of the blocks where it is farthest apart, but of those that were asked already.
    std::vector<Probe> around(const std::vector<float>& apart, double least) {
        const cv::Size size = in_.scene.size;
        const size_t blocks = size_t(std::clamp(size.area() / 14400, 32, 64));
        std::vector<int> order;
        for (int k = 0; k < int(apart.size()); k++)
            if (apart[k] > least) order.push_back(k);
        std::sort(order.begin(), order.end(), [&](int a, int b) { return apart[a] > apart[b]; });
        std::vector<Probe> rays;
        std::set<std::pair<int, int>> farthest;
        for (int k : order) {
            const cv::Point corner = rays_[k].pixel / edge * edge;
            farthest.insert({corner.x, corner.y});
            if (farthest.size() > blocks) break;
            if (!asked_.insert({corner.x, corner.y}).second) continue;
            for (int n = 0; n < edge * edge; n++)
                rays.push_back(in_.probeAt({std::min(corner.x + n % edge, size.width - 1),
                                            std::min(corner.y + n / edge, size.height - 1)}));
        }
        return rays;
    }
};

struct TrialLevel {
    int apart;      ///< one pixel in apart × apart is looked at; 0: the few rays
    double margin;  ///< the worst of all pixels may be so many times the worst of these rays
};

/// Ever more of a frame's rays: most methods are off already on a few, and only what might be off elsewhere
/// is tried on more. A `Trials` has error(method, steps, enough) and doubt().
template <class Trials>
class TrialLevels {
  public:
    using Make = std::function<std::unique_ptr<Trials>(int apart)>;

    TrialLevels(std::vector<TrialLevel> levels, const Make& make)
        : levels_(std::move(levels)), make_(make), trials_(levels_.size()) {}

    Trials& at(int level) {
        if (!trials_[level]) trials_[level] = make_(levels_[level].apart);
        return *trials_[level];
    }
    /// The worst error to be feared of a method; gives up where it exceeds `enough`.
    double error(const TrialOption& option, double enough) {
        double feared = 0, worst = 0, doubt = 0;
        for (int level = 0; level < int(levels_.size()); level++) {
            // More rays can only tell of larger errors.
            const double least = levels_.back().margin;
            doubt = std::max(doubt, at(level).doubt());
            worst = std::max(worst, at(level).error(option.method, option.steps, (enough - doubt) / least));
            doubt = std::max(doubt, at(level).doubt());  // of more rays, maybe
            feared = least * worst + doubt;
            if (feared > enough) break;
            feared = levels_[level].margin * worst + doubt;
            if (feared <= enough && std::isfinite(enough)) break;
        }
        return feared;
    }

  private:
    std::vector<TrialLevel> levels_;
    Make make_;
    std::vector<std::unique_ptr<Trials>> trials_;
};

struct TrialChoice {
    TrialOption option;
    double error = HUGE_VAL;
    bool isUnseen = false;  ///< the error is within the tolerance
};

/// The numbers of steps worth trying, a quarter octave apart.
inline std::vector<int> trialSteps(int most) {
    std::vector<int> numbers;
    for (double steps = 1; steps < most; steps = std::max(steps + 1, steps * std::pow(2., .25)))
        numbers.push_back(int(std::lround(steps)));
    numbers.push_back(most);
    return numbers;
}

/// The cheapest option whose error is within the tolerance; if none is, the most exact of those with most
/// steps. `errorOf(option, enough)` may give up beyond `enough`. Too few steps may hit by luck, and the next
/// number not: where steps are chosen, two numbers of a method in a row have to do.
template <class ErrorOf>
TrialChoice cheapest(std::vector<TrialOption> options, double tolerance, bool choosesSteps,
                     const ErrorOf& errorOf) {
    std::sort(options.begin(), options.end(),
              [](const TrialOption& a, const TrialOption& b) { return a.cost < b.cost; });
    std::map<int, TrialChoice> before;  // by method, what was tried last
    std::map<int, std::vector<double>> errors;
    int most = 0;
    for (const TrialOption& option : options) {
        most = std::max(most, option.steps);
        auto& known = errors[option.method];
        // Five in a row, to twice the steps, are alike: it is the floor.
        if (option.hasFloor && known.size() > 4) {
            const auto [low, high] = std::minmax_element(known.end() - 5, known.end());
            if (*low > .95 * *high) continue;
        }
        const double own = errorOf(option, tolerance);
        known.push_back(own);
        TrialChoice& last = before[option.method];
        const TrialChoice candidate =
            choosesSteps ? TrialChoice{last.option, std::max(own, last.error)} : TrialChoice{option, own};
        if (candidate.error <= tolerance) return {candidate.option, candidate.error, true};
        last = {option, own};
    }
    TrialChoice best;
    for (const TrialOption& option : options) {
        if (option.steps != most) continue;
        const double own = errorOf(option, best.error);
        if (own < best.error) best = {option, own};
    }
    return best;
}

}  // namespace brume
