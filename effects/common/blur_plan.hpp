// Which way of blurring is the cheapest that nobody can tell from the truth on this frame (MODELS.md §9).
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "effect/plan.hpp"
#include "error.hpp"

namespace blur {

/// The worst image for a kernel's difference is nothing that a camera sees: of a thousand random blurs of
/// captured frames none came to more than .12 of the bounds below (`brume check --plan gaussian_blur
/// bessel_blur`).
constexpr double likelihood = .5;

/// One way to blur, and what is known of its kernel's difference from the true one.
struct Choice {
    int method = 0;
    const char* name = "";
    double tolerance = 0;  ///< the parameter's value
    double error = 0;      ///< L1 norm of the difference, worst place
    /// The largest value of the difference, in units of error over 2π·variance.
    double peak = 2;
    double cost = 0;  ///< frame copies
};

/// The kernel that is wanted.
struct Wanted {
    double deviation = 0;     ///< px of the input image
    double reach = 5;         ///< deviations beyond which there is less than a millionth of it
    bool isGaussian = false;  ///< nowhere negative
};

/// How large a kernel's error (L1) may be without showing. A difference of kernels adds up to 0, so of a
/// place's surroundings only their range counts: error/2·(highest - lowest). Where a few small lights make
/// the range, their sum times the difference's largest value is less. Both tile by tile.
class Unseen {
  public:
    Unseen(const brume::PlanInput& in, const Wanted& wanted) {
        const auto& bounds = in.input;
        if (bounds.mean.empty()) {
            const double lowest = wanted.isGaussian ? bounds.low : -HUGE_VAL;
            add(in.largestUnseen(lowest), bounds.high - bounds.low, HUGE_VAL);
            return;
        }
        constexpr int tile = brume::ImageBounds::tile;
        const double deviation =
            wanted.deviation * in.frame.size.width / in.scene.size.width / tile;  // of the frame, in tiles
        const int reach = int(std::ceil(wanted.reach * deviation));
        const cv::Size window(std::min(2 * reach + 1, 2 * bounds.mean.cols + 1),
                              std::min(2 * reach + 1, 2 * bounds.mean.rows + 1));
        const cv::Mat box = cv::Mat::ones(window, CV_8U);
        cv::Mat lowest, highest, light = bounds.mean.clone(), near;
        cv::erode(bounds.lowest, lowest, box, {-1, -1}, 1, cv::BORDER_REPLICATE);
        cv::dilate(bounds.highest, highest, box, {-1, -1}, 1, cv::BORDER_REPLICATE);
        // Replicated edges repeat a tile's last pixels, which may be its brightest.
        for (int row : {0, light.rows - 1}) bounds.highest.row(row).copyTo(light.row(row));
        for (int column : {0, light.cols - 1}) bounds.highest.col(column).copyTo(light.col(column));
        cv::boxFilter(light, light, CV_32F, window, {-1, -1}, false, cv::BORDER_REPLICATE);
        // What a Gaussian surely leaves of the light within about one deviation.
        const int close = std::max(0, int(std::lround(.75 * deviation - .5)));
        const double share = std::exp(-std::pow((close + 1) / deviation, 2)) *
                             std::pow((2 * close + 1) / deviation, 2) / (2 * CV_PI);
        cv::boxFilter(bounds.mean, near, CV_32F, {2 * close + 1, 2 * close + 1}, {-1, -1}, true,
                      cv::BORDER_REPLICATE);
        for (int j = 0; j < light.rows; j++)
            for (int i = 0; i < light.cols; i++)
                for (int n = 0; n < 3; n++) {
                    const double low = lowest.at<cv::Vec3f>(j, i)[n], high = highest.at<cv::Vec3f>(j, i)[n];
                    double least = wanted.isGaussian ? low : -HUGE_VAL;
                    if (wanted.isGaussian && low >= 0)
                        least = std::max(least, share * near.at<cv::Vec3f>(j, i)[n]);
                    const double sum = light.at<cv::Vec3f>(j, i)[n] - low * window.area();
                    add(in.largestUnseen(least), high - low, sum / (2 * CV_PI * deviation * deviation));
                }
    }

    /// `peak` as in Choice.
    double error(double peak) const {
        double smallest = HUGE_VAL;
        for (const Place& p : places_) smallest = std::min(smallest, std::max(p.byRange, p.bySum / peak));
        return smallest / likelihood;
    }

  private:
    struct Place {
        double byRange, bySum;
    };
    std::vector<Place> places_;

    void add(double unseen, double range, double sum) {
        places_.push_back({2 * unseen / std::max(range, 1e-30), unseen / std::max(sum, 1e-30)});
    }
};

/// Fills choice, prediction and reason: the cheapest of `choices` whose error does not show, or else the most
/// exact.
inline void choose(brume::Plan& plan, const brume::PlanInput& in, const Unseen& unseen,
                   const std::vector<Choice>& choices) {
    const Choice *best = nullptr, *safest = nullptr;
    double bestShare = 0, safestShare = HUGE_VAL;
    for (const Choice& choice : choices) {
        const double share = choice.error / std::max(unseen.error(choice.peak), 1e-30);
        if (!safest || share < safestShare) safest = &choice, safestShare = share;
        if (share <= 1 && (!best || choice.cost < best->cost)) best = &choice, bestShare = share;
    }
    const bool isUnseen = best;
    if (!best) best = safest, bestShare = safestShare;
    plan.chosen["method"] = best->method;
    plan.chosen["tolerance"] = best->tolerance;
    plan.predictedError = bestShare * in.tolerance;
    plan.predictedCost = best->cost;
    plan.why = brume::text(best->name,
                           isUnseen ? " is the cheapest whose error, " : " is the most exact; its error, ",
                           best->error, " of the kernel, ",
                           isUnseen ? "does not show among this frame's lights"
                                    : "may show beside this frame's brightest lights");
}

}  // namespace blur
