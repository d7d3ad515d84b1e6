// The reference: the true integral in fp64. A method may be as far from it as it would be without rounding.
#pragma once

#include <opencv2/core/utility.hpp>

#include "volume_fog/integral.hpp"
#include "volume_fog/replay.hpp"

namespace volume_fog {

/// What fp32 may round away of the optical depth of one box, as far as the eye sees it: 4 ulp of where the
/// ray enters and leaves it, in the density there, which no method averages, and of the metres that its
/// falloffs are counted by, which begin as far from the eye as they do.
inline double wallRounding(const truth::Ray& ray, const truth::Wall& w, double transmittance) {
    constexpr double ulps = 2.4e-7;
    constexpr int parts = 64;
    const auto [enter, leave] = ray.inside(w);
    if (!(enter < leave)) return 0;
    const cv::Vec3d& eye = ray.s.eye;
    const cv::Vec3d moved =
        ulps * cv::Vec3d(std::abs(w.centre[0] - eye[0]) + w.edgeStart[0], std::abs(w.heightStart - eye[1]),
                         std::abs(w.centre[1] - eye[2]) + w.edgeStart[1]);
    const double atEnds = enter * ray.insideDensity(w, enter, -moved) +
                          leave * ray.insideDensity(w, leave, -moved) * transmittance;
    const double step = (leave - enter) / parts;
    double within = 0, passing = 1;
    for (int k = 0; k < parts; k++) {
        const double t = enter + (k + .5) * step, density = ray.insideDensity(w, t), depth = density * step;
        const double change = .5 * (ray.insideDensity(w, t, -moved) - ray.insideDensity(w, t, moved));
        within += change * passing * (depth > 1e-6 ? -std::expm1(-depth) / density : step);
        passing *= std::exp(-depth);
    }
    return ulps * std::min(atEnds, 1e6 * w.density) + within;
}

inline brume::ReferencePixel referencePixel(const truth::Scene& scene, const brume::ReferenceContext& c,
                                            cv::Point at) {
    const cv::Vec3d r = c.camera.ray(at.x, at.y);
    const cv::Matx44d& pose = c.camera.worldFromCamera;
    cv::Vec3d d;
    for (int k = 0; k < 3; k++)
        d[k] = (pose(k, 0) * r[0] + pose(k, 1) * r[1] + pose(k, 2) * r[2]) / cv::norm(r);
    const double distance = c.depth.at<float>(at) * cv::norm(r);
    const truth::Ray ray{scene, d, std::min(distance, double(scene.p.max_distance))};
    const cv::Vec4f color = c.input.at<cv::Vec4f>(at);

    const truth::Integral integral = truth::Integrator(ray).over(truth::breaks(ray));
    const truth::Replayed replayed = truth::Replay(ray, color, at, c.frameIndex, c.seed).run();
    const double transmittance = integral.depth < 87 ? std::exp(-integral.depth) : 0;

    brume::ReferencePixel pixel;
    pixel.ambiguous = replayed.ambiguous;
    const double least = std::exp(-87.);  // less transmittance counts as none in fp32
    const double passingRounding = replayed.transmittance * replayed.depthRounding;
    const double opacity = -std::expm1(-integral.depth);
    double largest = 0, light = 0, difference = 0;
    pixel.color[3] = color[3];
    for (int k = 0; k < 3; k++) {
        pixel.color[k] = (transmittance > 0 ? color[k] * transmittance : 0) + integral.scattered[k];
        pixel.transmittance[k] = transmittance;
        const double replayedColor =
            (replayed.transmittance > least ? color[k] * replayed.transmittance : 0) + replayed.scattered[k];
        if (std::isfinite(pixel.color[k]) && std::isfinite(replayedColor))
            difference = std::max(difference, std::abs(pixel.color[k] - replayedColor));
        if (std::isfinite(color[k])) largest = std::max(largest, std::abs(double(color[k])));
        largest = std::max(largest, integral.scattered[k]);
        if (opacity > 0) light = std::max(light, integral.scattered[k] / opacity);
        pixel.scale = std::max(pixel.scale, std::max(std::abs(double(color[k])), integral.scattered[k]));
    }
    // Whether anything at all is left decides whether a NaN or infinite colour shows.
    for (int k = 0; k < 3; k++)
        if (!std::isfinite(color[k]) && (transmittance > least) != (replayed.transmittance > 1.001 * least))
            pixel.ambiguous = true;
    const double mostNoise = scene.p.noise == Additive ? 1. + scene.p.noise_strength : 1.;
    double rounding = 0;
    for (const truth::Wall& w : scene.walls) rounding += mostNoise * wallRounding(ray, w, transmittance);
    // 4 ulp of a place in the noise, whose slope is at most about 4 a cell.
    if (scene.p.noise != NoNoise)
        rounding += 2.4e-7 * 4 * std::min(integral.depth, 1.) * scene.p.noise_strength *
                    (1 + ray.far / scene.p.noise_size);
    // 4 ulp of a lamp's place: of its distance² where the ray is near it, of where its range begins and ends.
    double lamps = 0;
    for (const PointLight& l : scene.p.point_lights) {
        const auto [enter, leave] = ray.inRange(l);
        const double middle = ray.along(l),
                     place2 = cv::norm(cv::Vec3d(l.position) - scene.eye, cv::NORM_L2SQR);
        const double nearest2 =
            cv::norm(cv::Vec3d(l.position) - ray.at(std::clamp(middle, 0., ray.far)), cv::NORM_L2SQR);
        const double core2 = nearest2 + 1e-4 / std::max(double(l.attenuation[2]), 1e-12);
        const double brightest = std::max({l.color[0], l.color[1], l.color[2]}) * l.intensity *
                                 truth::share(scene.p, 1) / truth::Ray::attenuation(l, std::sqrt(nearest2));
        if (nearest2 < double(l.range) * l.range)
            lamps += brightest * opacity * std::min(1., 5e-7 * place2 / core2);
        const double half = std::max(.5 * (leave - enter), std::sqrt(2.4e-7 * place2));
        double density = 0;
        for (const truth::Wall& w : scene.walls) density += w.density;
        const double edge = std::max(l.color[0], std::max(l.color[1], l.color[2])) * l.intensity *
                            truth::share(scene.p, 1) / truth::Ray::attenuation(l, l.range);
        lamps += edge * std::min(opacity, density * 2.4e-7 * place2 / std::max(half, 1e-6));
    }
    // A little more depth adds as much of the light there is, however little of it there was.
    pixel.allowance = lamps + rounding * std::max(largest, light);
    pixel.methodError =
        1.01 * difference + integral.doubt + replayed.lightRounding + passingRounding * largest;
    pixel.transmittanceAllowance = rounding;
    pixel.transmittanceMethodError =
        1.01 * std::abs(transmittance - replayed.transmittance) + integral.doubt + passingRounding;
    return pixel;
}

inline void reference(const Params& p, const brume::ReferenceContext& c, std::span<const cv::Point> pixels,
                      std::span<brume::ReferencePixel> truth) {
    const truth::Scene scene(p, c);
    cv::parallel_for_(cv::Range(0, int(pixels.size())), [&](const cv::Range& range) {
        for (int k = range.start; k < range.end; k++) truth[k] = referencePixel(scene, c, pixels[k]);
    });
}

}  // namespace volume_fog
