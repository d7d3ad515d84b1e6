// fog_blur's ladders tried on the picture that arrives: whole, since a ladder costs what its frame does, and
// against the definition where they look farthest apart.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <vector>

#include "effect/plan.hpp"
#include "effect/plugin.hpp"
#include "fog_blur/methods.hpp"

namespace fog_blur {

/// How visible a small difference is: PlanInput::visible, quickly, and a few hundredths more.
class Slope {
  public:
    explicit Slope(const brume::PlanInput& in) : gain_(float(in.gain)), isLast_(in.isLast) {
        for (int k = 0; k < int(table_.size()); k++) {
            const double x = std::bit_cast<float>(k << shift);  // the least of these
            table_[k] = float(x < .0031308 ? 12.92
                              : x < 1      ? 1.055 / 2.4 * std::pow(x, 1 / 2.4 - 1)
                                           : 1.055 / 2.4 / x);
        }
    }
    float shows(float a, float b) const {
        a *= gain_, b *= gain_;
        if (isLast_) a = std::clamp(a, 0.0f, 1.0f), b = std::clamp(b, 0.0f, 1.0f);
        const float least = std::min(std::fabs(a), std::fabs(b));
        return std::fabs(a - b) * table_[std::bit_cast<uint32_t>(least) >> shift];
    }

  private:
    static constexpr int shift = 18;  // five bits of the mantissa
    float gain_;
    bool isLast_;
    std::array<float, (1u << 31 >> shift)> table_;
};

class LadderTrial {
  public:
    LadderTrial(const FogBlur& p, const brume::PlanInput& in) : p_(p), in_(in) {
        p_.method = ladderMethod;
        context_.input = in.arriving ? in.arriving("inputImage") : cv::Mat();
        for (const char* name : {"transmittance", "clear"})
            context_.images[name] = context_.input.empty() ? cv::Mat() : in.arriving(name);
    }
    /// False where the picture is not to be had, or is of another size than plans reckon with.
    bool isPossible() const {
        return context_.input.size() == in_.scene.size &&
               context_.image("transmittance").size() == context_.input.size() &&
               context_.image("clear").size() == context_.input.size();
    }
    /// Worst visible error of a ladder, of the pixels tried: those where it differs most from a finer one,
    /// and those that coarser ladders were tried at. The finer one is of four rungs at least: two ladders
    /// that share rungs may be wrong alike, one and two were, by 1.4 of the tolerance.
    double errorOf(int rungs) {
        const cv::Mat picture = blurredBy(rungs), finer = blurredBy(std::max(4, 2 * rungs));
        pictures_.erase(pictures_.begin(), pictures_.upper_bound(rungs));
        const std::vector<cv::Point> apart = farthestApart(picture, finer);
        const std::vector<cv::Vec4f> truth = gatheredAt(apart, exactDeviations);
        pixels_.insert(pixels_.end(), apart.begin(), apart.end());
        truth_.insert(truth_.end(), truth.begin(), truth.end());
        std::vector<cv::Vec4f> tried;
        for (const cv::Point pixel : pixels_) tried.push_back(picture.at<cv::Vec4f>(pixel));
        return worstOf(tried);
    }
    /// And of gather, at the pixels tried.
    double gatherError() { return worstOf(gatheredAt(pixels_, gatherDeviations)); }

  private:
    static constexpr int blocks = 4096, most = 128;  // of the frame; pixels tried
    // The truth's Gaussian is cut there: beyond lies 1.5e-8 of it.
    static constexpr float exactDeviations = 6;

    FogBlur p_;
    const brume::PlanInput& in_;
    brume::CpuContext context_;
    brume::DerivedValues derived_;
    std::map<int, cv::Mat> pictures_;  // by rungs
    std::vector<cv::Point> pixels_;
    std::vector<cv::Vec4f> truth_;

    void derive(int rungs) {
        p_.rungs = rungs;
        const std::pair<const char*, std::vector<double> (*)(const FogBlur&, const brume::DeriveContext&)>
            constants[] = {{"largestSigma", largestSigma}, {"levels", levels},
                           {"levelTables", levelTables},   {"levelTaps", levelTaps},
                           {"prefilters", prefilters},     {"phases", phases},
                           {"nodeWeights", nodeWeights}};
        for (const auto& [name, constant] : constants) {
            const std::vector<double> numbers = constant(p_, in_.scene);
            derived_[name].assign(numbers.begin(), numbers.end());
        }
        context_.derivedValues = &derived_;
    }
    cv::Mat blurredBy(int rungs) {
        cv::Mat& picture = pictures_[rungs];
        if (!picture.empty()) return picture;
        derive(rungs);
        picture.create(context_.input.size(), CV_32FC4);
        context_.output = picture;
        run(p_, context_);
        return picture;
    }
    double worstOf(const std::vector<cv::Vec4f>& values) const {
        double worst = 0;
        for (size_t k = 0; k < values.size(); k++)
            for (int n = 0; n < 3; n++) worst = std::max(worst, in_.visible(values[k][n], truth_[k][n]));
        return worst;
    }
    std::vector<cv::Vec4f> gatheredAt(const std::vector<cv::Point>& pixels, float deviations) {
        Work work(p_, context_);
        work.sigmaEverywhere();
        std::vector<cv::Vec4f> result(pixels.size());
        cv::parallel_for_(
            {0, int(pixels.size())},
            [&](const cv::Range& range) {
                GatherRoom room;
                for (int k = range.start; k < range.end; k++) {
                    result[k] = gathered(p_, work.source, pixels[k].y, pixels[k].x, room, deviations);
                    work.finish(pixels[k].y, pixels[k].x, 1, result[k].val);
                }
            },
            double(pixels.size()));
        return result;
    }
    // Of every block the pixel where two pictures differ most, and of those the worst.
    std::vector<cv::Point> farthestApart(const cv::Mat& a, const cv::Mat& b) const {
        const Slope slope(in_);
        struct Place {
            float shows = -1;
            cv::Point pixel;
        };
        const int block = std::max(1, int(std::sqrt(a.total() / double(blocks))));
        const int columns = (a.cols + block - 1) / block, rows = (a.rows + block - 1) / block;
        std::vector<Place> places(size_t(columns) * rows);
        cv::parallel_for_({0, rows}, [&](const cv::Range& range) {
            for (int y = range.start * block; y < std::min(range.end * block, a.rows); y++)
                for (int x = 0; x < a.cols; x++) {
                    const auto &from = a.at<cv::Vec4f>(y, x), &to = b.at<cv::Vec4f>(y, x);
                    float shows = 0;
                    for (int n = 0; n < 3; n++) shows = std::max(shows, slope.shows(from[n], to[n]));
                    Place& place = places[size_t(y / block) * columns + x / block];
                    if (shows > place.shows) place = {shows, {x, y}};
                }
        });
        const size_t count = std::min(places.size(), size_t(most));
        std::partial_sort(places.begin(), places.begin() + long(count), places.end(),
                          [](const Place& x, const Place& y) { return x.shows > y.shows; });
        std::vector<cv::Point> pixels;
        for (size_t k = 0; k < count; k++) pixels.push_back(places[k].pixel);
        return pixels;
    }
};

}  // namespace fog_blur
