// depth_fog in fp64, slow and obvious; judges both halves.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "depth_fog/params.hpp"
#include "effect/plugin.hpp"

namespace depthFog {

using namespace brume;

inline double srgb(double x) {
    double a = std::abs(x);
    return std::copysign(a <= .0031308 ? 12.92 * a : 1.055 * std::pow(a, 1 / 2.4) - .055, x);
}
inline double linearOf(double x) {
    double a = std::abs(x);
    return std::copysign(a <= .04045 ? a / 12.92 : std::pow((a + .055) / 1.055, 2.4), x);
}

// Everything from the one intermediate that fp32 must round, the distance, and the sun's cosine.
struct Truth {
    cv::Vec3d color, transmittance;
};
inline Truth fogTruth(const DepthFog& p, const cv::Vec4f& scene, double planar, double distance,
                      double cosine) {
    Truth truth;
    double x = std::max(0., (p.cutoff > 0 ? std::min(distance, double(p.cutoff)) : distance) - p.start);
    for (int n = 0; n < 3; n++) {
        double opacity, transmittance;
        if (p.model == linear) {
            double l = p.far > p.near    ? (planar - p.near) / (double(p.far) - p.near)
                       : planar > p.near ? 1
                                         : 0;
            l = std::clamp(l, 0., 1.);
            opacity = std::clamp(std::clamp(l - p.linearStart, 0., 1.) * p.curve, 0., double(p.maxOpacity));
            transmittance = 1 - opacity;
        } else if (p.model == power) {
            double u = x / p.powerDistance;
            opacity = std::min(u > 0 ? std::pow(u, double(p.powerExponent)) : 0., double(p.maxOpacity));
            transmittance = 1 - opacity;
        } else {
            double contrast = p.measure == 0 ? .05 : .02;
            double extinction = p.measure == 2 ? double(p.extinction) : -std::log(contrast) / p.visibility;
            extinction *= p.tint[n];
            double depth = extinction == 0 ? 0 : extinction * x;
            if (p.model == exponentialSquared) depth *= depth;
            opacity = -std::expm1(-depth);
            transmittance = std::exp(-depth);
            if (opacity > p.maxOpacity) opacity = p.maxOpacity, transmittance = 1 - opacity;
        }
        double airlight = p.color[n];
        if (p.sun == powerSun && cv::norm(p.sunDirection) > 0)
            airlight += p.sunColor[n] * (cosine > 0 ? std::pow(cosine, double(p.sunExponent)) : 0);
        if (p.sun == henyeyGreenstein && cv::norm(p.sunDirection) > 0) {
            double g = p.sunAnisotropy;
            airlight += p.sunColor[n] * (1 - g * g) / (4 * CV_PI * std::pow(1 + g * g - 2 * g * cosine, 1.5));
        }
        double left = scene[n];
        if (p.mixing == 1) left = srgb(left), airlight = srgb(airlight);
        double mixed = (transmittance > 1e-37 ? left * transmittance : 0) + airlight * opacity;
        truth.color[n] = p.mixing == 1 ? linearOf(mixed) : mixed;
        truth.transmittance[n] = transmittance;
    }
    return truth;
}

inline ReferencePixel reference(const DepthFog& p, const ReferenceContext& c, cv::Point at) {
    cv::Vec4f scene = c.input.at<cv::Vec4f>(at);
    double planar = c.depth.at<float>(at);
    cv::Vec3d ray = c.camera.ray(at.x, at.y);
    double alongRay = planar * cv::norm(ray);
    double distance = p.distanceAlong == 0 ? alongRay : planar;

    const auto& m = c.camera.worldFromCamera;
    cv::Vec3d direction;
    for (int n = 0; n < 3; n++)
        direction[n] = (m(n, 0) * ray[0] + m(n, 1) * ray[1] + m(n, 2) * ray[2]) / cv::norm(ray);
    double turn = 1;  // by how much more than a unit vector's rounding does the sum's turn it
    if (p.sunOffset > 0 && std::isfinite(alongRay)) {
        direction = direction * alongRay + cv::Vec3d::all(p.sunOffset);
        turn = (alongRay + p.sunOffset) / cv::norm(direction);
        direction /= cv::norm(direction);
    }
    cv::Vec3d toSun(p.sunDirection);
    double cosine = cv::norm(toSun) > 0 ? direction.dot(toSun) / cv::norm(toSun) : 0;

    Truth truth = fogTruth(p, scene, planar, distance, cosine);
    ReferencePixel pixel;
    for (int n = 0; n < 3; n++) {
        pixel.color[n] = truth.color[n];
        pixel.transmittance[n] = truth.transmittance[n];
        double airlight = p.color[n] + (p.sun == noSun ? 0 : std::abs(truth.color[n]));
        for (double term : {std::abs(double(scene[n])), airlight})
            if (std::isfinite(term)) pixel.scale = std::max(pixel.scale, term);
    }
    pixel.color[3] = scene[3];

    // 4 ulp of the distance (of its larger operand, before the start is subtracted) and of the cosine.
    const double epsilon = std::numeric_limits<float>::epsilon();
    double distanceUlps = 4 * epsilon * std::max(std::isfinite(distance) ? distance : 0., double(p.start));
    double planarUlps = 4 * epsilon * std::max(std::isfinite(planar) ? planar : 0., double(p.near));
    for (int sign : {-1, 1}) {
        Truth nearby = fogTruth(p, scene, planar + sign * planarUlps, distance + sign * distanceUlps, cosine);
        const double aside = std::clamp(cosine + sign * 4 * epsilon * turn, -1., 1.);
        Truth turned = fogTruth(p, scene, planar, distance, aside);
        for (int n = 0; n < 3; n++) {
            for (const Truth& other : {nearby, turned}) {
                const double difference = std::abs(other.color[n] - truth.color[n]);
                if (std::isfinite(difference)) pixel.allowance = std::max(pixel.allowance, difference);
            }
            pixel.transmittanceAllowance = std::max(
                pixel.transmittanceAllowance, std::abs(nearby.transmittance[n] - truth.transmittance[n]));
        }
    }
    return pixel;
}

}  // namespace depthFog
