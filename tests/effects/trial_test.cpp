// How plans try methods on a frame's pixels.
#include "common/trial.hpp"

#include <gtest/gtest.h>

namespace brume {
namespace {

constexpr int exactly = -1;
const cv::Size size(96, 64);

// Method 0 adds a spot of light that is not there.
struct Spot {
    cv::Point middle;
    double radius = 8;

    double at(cv::Point pixel) const { return 1e-3 * std::max(0., 1 - cv::norm(pixel - middle) / radius); }
    Trial::Fog on(const std::vector<Probe>& rays) const {
        return [this, &rays](int tile, int method, int, TrialOutcome& outcome) {
            for (int x = 0; x < trialWidth; x++) {
                outcome.through[x] = 1;
                const double wrong = method == exactly ? 0 : at(rays[size_t(tile) * trialWidth + x].pixel);
                for (auto& channel : outcome.added) channel[x] = float(wrong);
            }
        };
    }
};

class Rays {
  public:
    Rays(const Spot& spot, const PlanInput& in, std::vector<Probe> rays)
        : rays_(std::move(rays)), trial_(in, rays_, spot.on(rays_), exactly, 1, 1) {}
    double error(int method, int steps, double enough) { return trial_.error(method, steps, enough); }
    double doubt() const { return trial_.doubt(); }
    size_t count() const { return rays_.size(); }

  private:
    std::vector<Probe> rays_;
    Trial trial_;
};

// Wherever it is, the brightest pixel of a spot two cells in radius is found, though one pixel of each 4 × 4
// is looked at, anywhere in it, and no ray that was asked first is near; the truth is asked of few pixels.
TEST(Trial, AScreenAsksTheTruthWhereAMethodLooksWrong) {
    PlanInput in;
    in.scene.size = size;
    in.scene.camera = Camera::withHorizontalView(size, 60);
    in.depth = cv::Mat(size, CV_32F, cv::Scalar(10));
    in.color = cv::Mat(size, CV_32FC4, cv::Scalar(.1, .1, .1, 1));
    std::vector<Probe> first(trialWidth, in.probeAt({0, 0}));
    for (int y = 8; y < size.height; y += 5)
        for (int x = 8; x < size.width; x += 7) {
            const Spot spot{{x, y}};
            size_t asked = 0;
            Screen<Rays> screen(
                in, 4, exactly, first,
                [&](std::vector<Probe> rays) {
                    asked += rays.size();
                    return std::make_unique<Rays>(spot, in, std::move(rays));
                },
                [&](const std::vector<Probe>& rays) { return spot.on(rays); });
            EXPECT_EQ(screen.first()->count(), first.size());
            EXPECT_NEAR(screen.error(0, 1, 1), in.visible(.1, .1 + spot.at(spot.middle)), 1e-6)
                << spot.middle;
            EXPECT_EQ(screen.error(exactly, 1, 1), 0);
            EXPECT_LE(asked, size_t(size.area() / 4));
        }
}

}  // namespace
}  // namespace brume
