// How much of a blur's error shows on a frame, by its tiles (MODELS.md §9).
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "effect/plan.hpp"

namespace blur {

/// The worst image for a kernel's difference is nothing that a camera sees. Of 5600 random blurs of captured
/// and rendered frames the worst came to .23 of the bounds below, a FIR of three taps, and of decimated ones
/// to .15 (`brume check --plan gaussian_blur bessel_blur`). Squares of 16 px drawn by hand, at 10 on black,
/// come to .98 of a FIR's: there a plan may be off by twice what it says.
constexpr double likelihood = .5, likelihoodDecimated = .25;
/// Of a FIR whose error is known to the last tap, not to twice of it: a dark pixel between bright ones comes
/// to .85 of that.
constexpr double likelihoodExact = 1;

/// The difference where it is that of one axis, beside the kernel itself along the other; in px. Empty: it is
/// not, or not known.
struct AxisError {
    std::function<double(double)> largest = {};  ///< its largest value at a distance
    double step = 0;                             ///< what it adds up to at most from any distance on
    std::function<double(double)> beyond = {};   ///< its L1 norm from a distance on
};

/// One way to blur, and what is known of its kernel's difference from the true one.
struct Choice {
    int method = 0;
    const char* name = "";
    double tolerance = 0;  ///< the parameter's value
    double error = 0;      ///< L1 norm of the difference, worst place
    /// The largest value of the difference, in units of error over 2π·variance.
    double peak = 2;
    double cost = 0;  ///< frame copies
    AxisError axis = {};
    double likely = likelihood;  ///< of the bounds
    /// How far from what is wanted it looks at most within a part of the captured picture, where that can be
    /// tried; called by several threads.
    std::function<double(const cv::Rect&)> shows = {};
    double share = -1;  ///< Unseen::share, where it was asked for
};

/// The kernel that is wanted: along either axis the same, and symmetric.
struct Wanted {
    double deviation = 0;                 ///< px of the input image
    double reach = 5;                     ///< deviations beyond which there is less than a millionth of it
    double (*density)(double) = nullptr;  ///< at a distance in deviations, per deviation
};

/// How large a kernel's error (L1) may be without showing. A difference of kernels adds up to 0, so of a
/// place's surroundings only their range counts: error/2·(highest - lowest). Where a few small lights make
/// the range, their sum times the difference's largest value is less. Where the difference is known along the
/// axes, ranges count near the axes alone, and lights by what it is at their distance. All of it tile by
/// tile.
class Unseen {
  public:
    /// Keeps `in`.
    Unseen(const brume::PlanInput& in, const Wanted& wanted) : in_(in), wanted_(wanted) {
        const auto& bounds = in.input;
        double positive = 0, negative = 0;  // parts of the kernel, along one axis
        for (double step = 1. / 64, x = step / 2; x < wanted.reach; x += step) {
            const double density = wanted.density(x);
            (density > 0 ? positive : negative) += 2 * step * std::abs(density);
        }
        const double negativePair = 2 * positive * negative;
        if (bounds.lowest.empty()) {
            const double range = bounds.high - bounds.low;
            add(in.largestUnseen(bounds.low - negativePair * range), range, HUGE_VAL);
            return;
        }
        constexpr int tile = brume::ImageBounds::tile;
        const double deviation = deviation_ =
            wanted.deviation * in.frame.size.width / in.scene.size.width / tile;  // of the frame, in tiles
        const int reach = int(std::ceil(wanted.reach * deviation));
        const cv::Size window(std::min(2 * reach + 1, 2 * bounds.lowest.cols + 1),
                              std::min(2 * reach + 1, 2 * bounds.lowest.rows + 1));
        const cv::Mat box = cv::Mat::ones(window, CV_8U);
        cv::Mat lowest, highest;
        cv::erode(bounds.lowest, lowest, box, {-1, -1}, 1, cv::BORDER_REPLICATE);
        cv::dilate(bounds.highest, highest, box, {-1, -1}, 1, cv::BORDER_REPLICATE);
        cv::Mat sums, floor;
        cv::boxFilter(bounds.greatestMean, sums, CV_32F, window, {-1, -1}, false, cv::BORDER_REPLICATE);
        const double floorOfOne = leastOf(wanted, deviation, reach, bounds, floor);
        for (int j = 1; j + 1 < sums.rows; j++)
            for (int i = 1; i + 1 < sums.cols; i++)
                for (int n = 0; n < 3; n++) {
                    const double low = lowest.at<cv::Vec3f>(j, i)[n], high = highest.at<cv::Vec3f>(j, i)[n];
                    // What is low everywhere stays, and of what is above it the kernel leaves at least this.
                    const double least = low + std::max(floor.at<cv::Vec3f>(j, i)[n] - low * floorOfOne,
                                                        -negativePair * (high - low));
                    const double sum = sums.at<cv::Vec3f>(j, i)[n] - low * window.area();
                    add(in.largestUnseen(least), high - low, sum / (2 * CV_PI * deviation * deviation));
                }
        lowest_ = bounds.lowest, highest_ = bounds.highest, light_ = bounds.greatestMean;
        floor_ = lowest;
        // The curve's slope times the value rises up to 1, and is no larger above.
        relativelyUnseen_ = in.largestUnseen(1);
    }

    /// `peak` as in Choice.
    double error(double peak) const {
        double smallest = HUGE_VAL;
        for (const Place& p : places_) smallest = std::min(smallest, std::max(p.byRange, p.bySum / peak));
        return smallest / likelihood;
    }

    /// How much of what does not show a choice takes: more than 1 may show.
    double share(const Choice& choice) const {
        const double all = choice.likely / likelihood * choice.error / std::max(error(choice.peak), 1e-30);
        if (all <= 1 || lowest_.empty()) return all;
        std::vector<double> shares;
        for (const Place& p : places_)
            shares.push_back(choice.likely * choice.error /
                             std::max({p.byRange, p.bySum / choice.peak, 1e-30}));
        if (choice.axis.beyond) {
            const std::vector<double> ranges = byRangesAlong(choice), lights = byLightsAlong(choice);
            for (size_t k = 0; k < shares.size(); k++)
                shares[k] = std::min({shares[k], ranges[k], lights[k]});
        }
        if (choice.shows) tryWhereItMayShow(choice, shares);
        return *std::max_element(shares.begin(), shares.end());
    }

  private:
    // Replaces the shares above 1 of a few tiles by those of the picture as it is, the worst first, up to the
    // first that does show.
    void tryWhereItMayShow(const Choice& choice, std::vector<double>& shares) const {
        constexpr int tile = brume::ImageBounds::tile, mostTiles = 256, atOnce = 16;
        if (in_.color.size() != in_.scene.size) return;
        struct Doubtful {
            double share;
            size_t place;
        };
        std::vector<Doubtful> doubtful;
        for (size_t k = 0; k + 2 < shares.size(); k += 3)
            if (const double share = std::max({shares[k], shares[k + 1], shares[k + 2]}); share > 1)
                doubtful.push_back({share, k});
        if (doubtful.size() > mostTiles) return;
        std::sort(doubtful.begin(), doubtful.end(),
                  [](const Doubtful& a, const Doubtful& b) { return a.share > b.share; });
        const int columns = lowest_.cols - 2;
        // A few at once, always as many: what is looked at does not hang on the number of threads.
        for (size_t from = 0; from < doubtful.size(); from += atOnce) {
            const int count = int(std::min<size_t>(atOnce, doubtful.size() - from));
            double most = 0;
            cv::parallel_for_({0, count}, [&](const cv::Range& range) {
                for (int k = range.start; k < range.end; k++) {
                    const size_t place = doubtful[from + size_t(k)].place;
                    const int at = int(place / 3);
                    const cv::Rect area = cv::Rect(at % columns * tile, at / columns * tile, tile, tile) &
                                          cv::Rect({0, 0}, in_.color.size());
                    std::fill_n(shares.begin() + ptrdiff_t(place), 3, choice.shows(area) / in_.tolerance);
                }
            });
            for (int k = 0; k < count; k++) most = std::max(most, shares[doubtful[from + size_t(k)].place]);
            if (most > 1) return;
        }
    }

    // Where the error is E = e⊗k + k⊗e, e along one axis beside the wanted k along the other, at each place:
    // e adds up to 0, so of the pixels along its axis only their range counts; nearby half of it, farther
    // off, against the middle of what is near, all of it. Of these ranges k then takes its mean.
    std::vector<double> byRangesAlong(const Choice& choice) const {
        constexpr int tile = brume::ImageBounds::tile;
        const double inTiles = wanted_.deviation / deviation_ / tile;  // the frame's tiles, in the scene's px
        const int reach = int(std::ceil(wanted_.reach * deviation_));
        cv::Mat sum = cv::Mat::zeros(lowest_.size(), CV_32FC3);
        for (bool isColumns : {false, true}) {
            cv::Mat ranges = cv::Mat::zeros(lowest_.size(), CV_32FC3);
            for (int near = 0, far = 1; near < reach; near = far, far = std::min(2 * far, reach)) {
                const int length = 2 * std::min(far, std::max(lowest_.cols, lowest_.rows)) + 1;
                const cv::Mat line =
                    cv::Mat::ones(isColumns ? cv::Size(1, length) : cv::Size(length, 1), CV_8U);
                cv::Mat low, high;
                cv::erode(lowest_, low, line, {-1, -1}, 1, cv::BORDER_REPLICATE);
                cv::dilate(highest_, high, line, {-1, -1}, 1, cv::BORDER_REPLICATE);
                const double from = choice.axis.beyond(near * tile * inTiles),
                             to = far < reach ? choice.axis.beyond(far * tile * inTiles) : 0;
                ranges += (high - low) * ((near == 0 ? .5 : 1) * (from - to));
            }
            cv::Mat most;  // of where in its tile a pixel lies
            for (double within : {0., .5, 1.}) {
                std::vector<float> weights;
                for (int t = -reach; t <= reach; t++) weights.push_back(float(weightOfTile(t - within)));
                const cv::Mat across(weights), none = cv::Mat::ones(1, 1, CV_32F);
                cv::Mat mean;
                cv::sepFilter2D(ranges, mean, CV_32F, isColumns ? across : none, isColumns ? none : across,
                                {-1, -1}, 0, cv::BORDER_REPLICATE);
                most = most.empty() ? mean : cv::Mat(cv::max(most, mean));
            }
            sum += most;
        }
        std::vector<double> shares;
        for (int j = 1; j + 1 < sum.rows; j++)
            for (int i = 1; i + 1 < sum.cols; i++)
                for (int n = 0; n < 3; n++)
                    shares.push_back(choice.likely * sum.at<cv::Vec3f>(j, i)[n] /
                                     places_[shares.size()].unseen);
        return shares;
    }
    // What |k| is along one axis of a tile that begins at a distance in tiles.
    double weightOfTile(double from) const {
        constexpr int parts = 16;
        double sum = 0;
        for (int k = 0; k < parts; k++)
            sum += std::abs(wanted_.density(std::abs(from + (k + .5) / parts) / deviation_)) / deviation_ /
                   parts;
        return sum;
    }

    // The same by lights: where |e| ≤ ridge, |E| ≤ ridge⊗|k| + |k|⊗ridge. With k⁺ and k⁻ the parts of k above
    // and below 0, and K = k⊗k,
    //   k⁺⊗|k| + |k|⊗k⁺ = 2·k⁺⊗k⁺ + (k⁺⊗k⁻ + k⁻⊗k⁺) ≤ 2·K + 3·(k⁺⊗k⁻ + k⁻⊗k⁺):
    // so where ridge ≤ ρ·k⁺ the error is 2ρ of what the place comes out at, which takes `relative` of what
    // does not show whatever the lights are; what is left is (ridge - ρ·k⁺)⁺ + 3ρ·k⁻ along the axis.
    std::vector<double> byLightsAlong(const Choice& choice) const {
        const double tile = wanted_.deviation / deviation_,  // px
            rho = choice.axis.largest(0) * tile * deviation_ / wanted_.density(0),
                     relative = 2 * rho / relativelyUnseen_;
        auto left = [rho](double ridge, double wanted) {
            return std::max(0., ridge - rho * std::max(0., wanted)) + 3 * rho * std::max(0., -wanted);
        };
        std::vector<double> beyond(size_t(wanted_.reach * 64) + 1, 0.);  // sums from a distance on
        for (size_t k = beyond.size() - 1; k > 0; k--)
            beyond[k - 1] = beyond[k] + wanted_.density((double(k) - .5) / 64) / 64;
        const Axis kernel{[&](double x) { return wanted_.density(x / deviation_) / deviation_; },
                          [&](double x) {
                              const auto k = size_t(x / deviation_ * 64);
                              return k < beyond.size() ? beyond[k] : 0;
                          }},
            ridge{[&](double x) { return left(choice.axis.largest(x * tile) * tile, kernel.density(x)); },
                  [&](double x) { return left(choice.axis.step, kernel.beyond(x)); }};
        const cv::Size tiles = light_.size();
        const cv::Mat x[] = {kernel.weights(tiles.width), ridge.weights(tiles.width)},
                      y[] = {ridge.weights(tiles.height), kernel.weights(tiles.height)};
        cv::Mat channels[3];
        cv::split(light_, channels);
        std::vector<double> shares(places_.size());
        for (int n = 0; n < 3; n++) {
            cv::Mat sums, ones;  // of the image, and of a constant 1
            for (int k = 0; k < 2; k++) {
                const cv::Mat across = x[k].t(), all = cv::Mat::ones(tiles, CV_32F);
                cv::Mat sum = y[k] * channels[n] * across, one = y[k] * all * across;
                sums = k ? cv::Mat(sums + sum) : sum, ones = k ? cv::Mat(ones + one) : one;
            }
            for (int j = 0; j < sums.rows; j++)
                for (int i = 0; i < sums.cols; i++) {
                    const size_t k = size_t(j * sums.cols + i) * 3 + n;
                    const double low = floor_.at<cv::Vec3f>(j + 1, i + 1)[n],
                                 sum = sums.at<float>(j, i) - low * double(ones.at<float>(j, i)) +
                                       2 * rho * std::max(0., -low);
                    shares[k] = std::min(choice.likely * choice.error / places_[k].byRange,
                                         relative + choice.likely * sum / places_[k].unseen);
                }
        }
        return shares;
    }

    struct Place {
        double unseen, byRange, bySum;
    };
    // What any pixel of a tile may weigh for any pixel of another, times the tile's pixels, along one axis:
    // largest values of a function of the distance in tiles, and, of what edges repeat, of its sums.
    struct Axis {
        std::function<double(double)> density, beyond;
        // Of all tiles, with the ring, for each tile within it.
        cv::Mat weights(int count) const {
            const int inside = count - 2;
            std::vector<float> near(inside), far(inside);
            for (int d = 0; d < inside; d++) {
                const double from = std::max(0, d - 1), to = d + 1;
                for (int k = 0; k <= 32; k++) {
                    const double distance = from + (to - from) * k / 32;
                    near[d] = std::max(near[d], float(std::abs(density(distance))));
                    far[d] = std::max(far[d], float(std::abs(beyond(distance))));
                }
            }
            cv::Mat weights(inside, count, CV_32F);
            for (int to = 0; to < inside; to++) {
                weights.at<float>(to, 0) = far[to], weights.at<float>(to, count - 1) = far[inside - 1 - to];
                for (int at = 0; at < inside; at++) weights.at<float>(to, at + 1) = near[std::abs(to - at)];
            }
            return weights;
        }
    };
    const brume::PlanInput& in_;
    std::vector<Place> places_;  // of tiles by rows, three channels each; or one for all
    Wanted wanted_;
    double deviation_ = 0;              // of the wanted kernel, in tiles
    double relativelyUnseen_ = 0;       // share of a value that its error may be
    cv::Mat lowest_, highest_, light_;  // of the tiles
    cv::Mat floor_;                     // lowest_ as far as the kernel reaches

    // What the kernel makes of an image at least: of tiles' means, as much as any pixel of a tile may weigh
    // for any pixel of another. The means are above 0, and between `dark` and `light`. Returns what it is of
    // a constant 1.
    static double leastOf(const Wanted& wanted, double deviation, int reach, const brume::ImageBounds& bounds,
                          cv::Mat& floor) {
        const cv::Mat &dark = bounds.leastMean, &light = bounds.greatestMean;
        // Along one axis the density lies between sure - shade and bright - shade.
        std::vector<float> sure, bright, shade;
        for (int d = -reach; d <= reach; d++) {
            const double from = std::min(wanted.reach, std::max(0, std::abs(d) - 1) / deviation),
                         to = std::min(wanted.reach, (std::abs(d) + 1) / deviation);
            const int parts = 1 + int((to - from) * 32);
            double least = HUGE_VAL, most = -HUGE_VAL;
            for (int k = 0; k <= parts; k++) {
                const double x = wanted.density(from + (to - from) * k / parts) / deviation;
                least = std::min(least, x), most = std::max(most, x);
            }
            sure.push_back(float(std::max(0., least)));
            bright.push_back(float(std::max(0., most)));
            shade.push_back(float(std::max(0., -least)));
        }
        auto filtered = [](const cv::Mat& image, const std::vector<float>& x, const std::vector<float>& y) {
            cv::Mat result;
            cv::sepFilter2D(image, result, CV_32F, x, y, {-1, -1}, 0, cv::BORDER_REPLICATE);
            return result;
        };
        floor = filtered(dark, sure, sure) - filtered(light, bright, shade) - filtered(light, shade, bright);
        double sums[3] = {};
        for (size_t k = 0; k < sure.size(); k++)
            sums[0] += sure[k], sums[1] += bright[k], sums[2] += shade[k];
        return sums[0] * sums[0] - 2 * sums[1] * sums[2];
    }

    void add(double unseen, double range, double sum) {
        places_.push_back({unseen, 2 * unseen / std::max(range, 1e-30), unseen / std::max(sum, 1e-30)});
    }
};

}  // namespace blur
