// Theorems of distance_veil: what must hold for any picture. The argument is the folder of the built effect.
#include <cmath>
#include <cstdio>

#include "cpu/cpu_runner.hpp"
#include "effect/preset.hpp"

using namespace brume;

static int failures = 0;

static void expectNear(const char* what, double got, double wanted, double tolerance) {
    if (std::abs(got - wanted) <= tolerance) return;
    std::printf("%s: %.9g, not %.9g\n", what, got, wanted);
    failures++;
}

// Red of one grey pixel, seen straight ahead at a distance in m.
static double shown(const std::string& effect, double distance, const std::string& halving) {
    FramePair frame;
    frame.color = cv::Mat(1, 1, CV_32FC4, cv::Scalar(.25, .25, .25, 1));
    frame.depth = cv::Mat(1, 1, CV_32F, cv::Scalar(distance));
    frame.camera = Camera::withHorizontalView({1, 1}, 60);
    Chain chain = readPreset(effect, EffectRegistry::standard());
    setParameter(chain, "distance_veil.halving", halving);
    setParameter(chain, "distance_veil.color", "#ffffff");
    return makeCpuRunner()->run(chain, frame, {}).images.at("color").at<cv::Vec4f>(0, 0)[0];
}

int main(int, char** arguments) {
    const std::string effect = arguments[1];
    expectNear("at the eye nothing changes", shown(effect, 0, "50"), .25, 0);
    expectNear("the sky has the whole veil", shown(effect, HUGE_VAL, "50"), 1.25, 0);
    for (int halvings = 1; halvings <= 8; halvings++)
        expectNear("each halving distance leaves half", shown(effect, 50 * halvings, "50"),
                   1.25 - std::exp2(-halvings), 2e-7);
    return failures;
}
