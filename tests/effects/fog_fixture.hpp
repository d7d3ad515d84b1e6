// What the tests of layered and heterogeneous fog share: frames, effects run on the CPU, fitted slopes.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "apply/apply.hpp"
#include "cpu/cpu_runner.hpp"
#include "effect/preset.hpp"

namespace brume {

inline FramePair fogFrame(cv::Size size = {48, 27}, double depth = 0) {
    FramePair frame;
    frame.name = "frame";
    frame.color.create(size, CV_32FC4);
    frame.depth.create(size, CV_32F);
    cv::RNG random(3);
    random.fill(frame.color, cv::RNG::UNIFORM, 0, 1);
    random.fill(frame.depth, cv::RNG::UNIFORM, 1, 300);
    if (depth > 0) frame.depth.setTo(depth);
    frame.camera = Camera::withHorizontalView(size, 90);
    return frame;
}

inline RunResult runFog(const FramePair& frame, const std::string& steps) {
    Chain chain = parsePreset("{\"effects\": [" + steps + "]}", "test", EffectRegistry::standard());
    return makeCpuRunner()->run(planChain(chain, frame, Backend::Cpu, {"transmittance"}), frame,
                                {"transmittance"});
}
inline cv::Mat transmittanceOf(const FramePair& frame, const std::string& steps) {
    return runFog(frame, steps).images.at("transmittance");
}
inline double apart(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF); }

/// Slope of log(error) over log(size of a step), least squares.
inline double fittedOrder(const std::vector<double>& sizes, const std::vector<double>& errors) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    const double n = double(sizes.size());
    for (size_t k = 0; k < sizes.size(); k++) {
        const double x = std::log(sizes[k]), y = std::log(errors[k]);
        sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

/// The camera turned about its eye.
inline void turn(Camera& camera, double yaw, double pitch) {
    const double a = yaw * CV_PI / 180, b = pitch * CV_PI / 180;
    const cv::Matx44d aside(std::cos(a), 0, std::sin(a), 0, 0, 1, 0, 0, -std::sin(a), 0, std::cos(a), 0, 0, 0,
                            0, 1);
    const cv::Matx44d up(1, 0, 0, 0, 0, std::cos(b), -std::sin(b), 0, 0, std::sin(b), std::cos(b), 0, 0, 0, 0,
                         1);
    const cv::Vec3d eye = camera.eye();
    camera.worldFromCamera = aside * up;
    for (int k = 0; k < 3; k++) camera.worldFromCamera(k, 3) = eye[k];
}

}  // namespace brume
