#include "preview/probe.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace brume::preview {

namespace {

cv::Point scaled(cv::Point pixel, cv::Size from, cv::Size to) {
    return {std::min(pixel.x * to.width / from.width, to.width - 1),
            std::min(pixel.y * to.height / from.height, to.height - 1)};
}

std::string formatted(const char* format, double a) {
    char words[64];
    std::snprintf(words, sizeof words, format, a);
    return words;
}

double unsignedZero(double a) { return std::abs(a) < .005 ? 0 : a; }

std::string three(const cv::Vec4f& c) {
    char words[96];
    std::snprintf(words, sizeof words, "%.4f  %.4f  %.4f", c[0], c[1], c[2]);
    return words;
}

std::string metres(double m) {
    if (std::isnan(m)) return "unknown";
    if (std::isinf(m)) return "sky";
    return formatted(m < 100 ? "%.3f m" : "%.1f m", m);
}

}  // namespace

Probe probeAt(const LoadedFrame& loaded, const Rendered* rendered, cv::Point pixel) {
    const FramePair& frame = loaded.frame;
    Probe probe;
    probe.pixel = pixel;
    probe.before = frame.color.at<cv::Vec4f>(pixel);
    probe.captured = probe.depth = frame.depth.at<float>(pixel);
    if (rendered && rendered->job.frame.get() == &frame) {
        auto sample = [&](const char* name) -> std::optional<cv::Vec4f> {
            auto found = rendered->images.find(name);
            if (found == rendered->images.end()) return {};
            return found->second.at<cv::Vec4f>(scaled(pixel, frame.size(), found->second.size()));
        };
        probe.after = sample("color");
        probe.transmittance = sample("transmittance");
        if (!rendered->depth.empty())
            probe.depth = rendered->depth.at<float>(scaled(pixel, frame.size(), rendered->depth.size()));
    }
    const cv::Vec3d ray = frame.camera.ray(pixel.x, pixel.y);
    probe.distance = double(probe.depth) * cv::norm(ray);
    const cv::Matx44d& pose = frame.camera.worldFromCamera;
    const cv::Vec3d turned = pose.get_minor<3, 3>(0, 0) * ray;
    probe.direction = turned * (1 / cv::norm(turned));
    if (std::isfinite(probe.depth)) probe.position = frame.camera.eye() + double(probe.depth) * turned;
    return probe;
}

std::vector<std::pair<std::string, std::string>> probeLines(const Probe& p) {
    std::vector<std::pair<std::string, std::string>> lines;
    lines.emplace_back("pixel", std::to_string(p.pixel.x) + ", " + std::to_string(p.pixel.y));
    lines.emplace_back("before", three(p.before));
    lines.emplace_back("after", p.after ? three(*p.after) : "…");
    std::string depth = metres(p.depth);
    if (std::isnan(p.captured) && !std::isnan(p.depth)) depth += " (filled)";
    lines.emplace_back("depth", depth);
    lines.emplace_back("distance", metres(p.distance));
    if (p.position) {
        char words[96];
        const cv::Vec3d& w = *p.position;
        std::snprintf(words, sizeof words, "%.2f  %.2f  %.2f m", unsignedZero(w[0]), unsignedZero(w[1]),
                      unsignedZero(w[2]));
        lines.emplace_back("world", words);
    } else {
        char words[96];
        std::snprintf(words, sizeof words, "towards %.3f  %.3f  %.3f", p.direction[0], p.direction[1],
                      p.direction[2]);
        lines.emplace_back("world", words);
    }
    lines.emplace_back("transmittance", p.transmittance ? three(*p.transmittance) : "…");
    return lines;
}

}  // namespace brume::preview
