// noise_fog's truth, fp64: noise measured from the world's origin, means by Gauss quadrature between lattice
// planes.
#pragma once

#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <limits>
#include <vector>

#include "common/noise_reference.hpp"
#include "common/noise_volume.hpp"
#include "effect/plugin.hpp"
#include "noise_fog/params.hpp"

namespace brume::noise_fog {

/// The noise of one frame.
struct ReferenceNoise {
    const NoiseFog& p;
    cv::Vec3d eye;
    double time;

    cv::Vec3d cells(const cv::Vec3d& way) const {
        cv::Vec3d q = (eye + way - cv::Vec3d(p.wind) * time) * (1. / p.size);
        if (p.isGround()) q[1] = 0;
        return q;
    }
    double at(const cv::Vec3d& q) const {
        return reference::noise(NoiseKind(p.noise), q, p.octaves, p.tile, uint32_t(p.seed));
    }
    // P5's blur: binomial weights at the texels round a place.
    double smoothed(const cv::Vec3d& q) const {
        const int s = p.smoothingRow();
        if (s == 0) return at(q);
        const std::vector<double> row =
            s == 1 ? std::vector<double>{.25, .5, .25} : std::vector<double>{.0625, .25, .375, .25, .0625};
        const double texel = double(p.tile) / p.edge();
        double sum = 0;
        for (int k = -s; k <= s; k++)
            for (int j = -s; j <= s; j++)
                for (int i = -s; i <= s; i++)
                    sum += row[i + s] * row[j + s] * row[k + s] * at(q + cv::Vec3d(i, j, k) * texel);
        return sum;
    }
    // What trilinear interpolation of exact texels gives.
    double interpolated(const cv::Vec3d& q) const {
        const double texel = double(p.tile) / p.edge();
        const cv::Vec3d u = q * (1 / texel);
        const cv::Vec3d whole(std::floor(u[0]), std::floor(u[1]), std::floor(u[2]));
        double sum = 0;
        for (int corner = 0; corner < 8; corner++) {
            const cv::Vec3d c = whole + cv::Vec3d(corner & 1, corner >> 1 & 1, corner >> 2);
            double weight = 1;
            for (int a = 0; a < 3; a++) weight *= 1 - std::abs(u[a] - c[a]);
            sum += weight * smoothed(c * texel);
        }
        return sum;
    }
    double byMethod(const cv::Vec3d& q) const { return p.isBaked() ? interpolated(q) : smoothed(q); }

    // The mean over the first `reach` metres: Perlin's between the lattice planes of the finest octave (there
    // noise along a line is one polynomial), in at most 128 pieces; simplex in 128.
    double meanAlong(const cv::Vec3d& d, double reach) const {
        if (reach <= 0) return at(cells({}));
        std::vector<double> cuts = {0, 1};
        const cv::Vec3d a = cells({}), b = cells(d * reach);
        const double scale = std::pow(2., p.octaves - 1);
        double crossings = 0;
        for (int n = 0; n < 3; n++) crossings += std::abs(b[n] - a[n]) * scale;
        if (crossings <= 128 && p.noise == int(NoiseKind::Perlin)) {
            for (int n = 0; n < 3; n++) {
                const double from = a[n] * scale, to = b[n] * scale;
                for (double plane = std::ceil(std::min(from, to)); plane < std::max(from, to); plane++)
                    if (to != from) cuts.push_back((plane - from) / (to - from));
            }
        } else {
            for (int k = 1; k < 128; k++) cuts.push_back(k / 128.);
        }
        std::sort(cuts.begin(), cuts.end());
        double sum = 0;
        for (size_t k = 0; k + 1 < cuts.size(); k++)
            if (cuts[k + 1] > cuts[k])
                sum += boost::math::quadrature::gauss<double, 7>::integrate(
                    [&](double t) { return at(a + (b - a) * t); }, cuts[k], cuts[k + 1]);
        return sum;
    }
    double middleMean(const cv::Vec3d& d, double reach) const {
        double sum = 0;
        for (int k = 0; k < p.steps; k++) sum += byMethod(cells(d * (reach * (k + .5) / p.steps)));
        return sum / p.steps;
    }
};

/// P3's product, each axis by quadrature.
struct ReferenceProduct {
    const NoiseFog& p;
    cv::Vec3d eye;
    double time;
    // by axis and octave: the noise integrated from 0 to each lattice point of one period
    std::vector<std::vector<double>> integrals[3];

    ReferenceProduct(const NoiseFog& params, const cv::Vec3d& eyeAt, double timeAt)
        : p(params), eye(eyeAt), time(timeAt) {
        for (int axis = 0; axis < 3; axis++)
            for (int octave = 0; octave < p.octaves && p.axis(axis).profile == noiseAxis; octave++) {
                std::vector<double> sums = {0};
                for (int cell = 0; cell < p.tile << octave; cell++)
                    sums.push_back(sums.back() + cellIntegral(axis, octave, cell, cell + 1));
                integrals[axis].push_back(sums);
            }
    }
    double cellIntegral(int axis, int octave, double begin, double end) const {
        auto noise = [&](double x) {
            return reference::lineNoise(x, uint32_t(axis), int64_t(p.tile) << octave,
                                        uint32_t(p.seed) + uint32_t(octave) * 0x9e3779b9u);
        };
        return end > begin ? boost::math::quadrature::gauss<double, 7>::integrate(noise, begin, end) : 0;
    }

    std::vector<Point> pointsOf(int axis) const {
        std::vector<Point> points;
        for (const auto& point : p.points)
            if (point.axis == axis) points.push_back(point);
        return points;
    }
    double pointDensity(const std::vector<cv::Vec2d>& points, double y) const {
        double below = -HUGE_VAL, above = HUGE_VAL, densityBelow = 0, densityAbove = 0;
        for (const auto& q : points) {
            if (q[0] <= y && q[0] >= below) below = q[0], densityBelow = q[1];
            if (q[0] > y && q[0] < above) above = q[0], densityAbove = q[1];
        }
        if (below == -HUGE_VAL) return densityAbove;
        if (above == HUGE_VAL) return densityBelow;
        return densityBelow + (densityAbove - densityBelow) * (y - below) / (above - below);
    }
    template <class F>
    static double integrate(const F& f, std::vector<double> cuts) {
        std::sort(cuts.begin(), cuts.end());
        double sum = 0;
        for (size_t k = 0; k + 1 < cuts.size(); k++)
            if (cuts[k + 1] > cuts[k])
                sum +=
                    boost::math::quadrature::gauss_kronrod<double, 15>::integrate(f, cuts[k], cuts[k + 1], 0);
        return sum;
    }

    double exponentialMean(const Axis& axis, double from, double to) const {
        // from the denser end on, as shares of it; beyond 60 falloffs nothing is left
        const double k = std::abs(double(axis.falloff)), length = to - from;
        const double dense = axis.falloff >= 0 ? from : to;
        std::vector<double> cuts = {0};
        const double end = k > 0 ? std::min(length, 60 / k) : length;
        for (int e = 1; k > 0 && e < 30; e++)
            if (2 * e / k < end) cuts.push_back(2 * e / k);
        cuts.push_back(end);
        const double share = integrate([&](double t) { return std::exp(-k * t); }, cuts) / length;
        return std::exp(std::min(60., -double(axis.falloff) * (dense - axis.origin) + std::log(share)));
    }
    double pointsMean(int axis, double from, double to) const {
        const auto listed = pointsOf(axis);
        if (listed.empty()) return 0;
        std::vector<cv::Vec2d> points;
        for (size_t k = 0; k < listed.size(); k++) {
            double position = listed[k].position;
            if (p.axis(axis).profile == tableAxis && listed.size() > 1) {
                const double first = listed.front().position, last = listed.back().position;
                position = first + (last - first) * double(k) / double(listed.size() - 1);
            }
            points.push_back({position, listed[k].density});
        }
        std::vector<double> cuts = {from, to};
        for (const auto& q : points)
            if (q[0] > from && q[0] < to) cuts.push_back(q[0]);
        return to > from ? integrate([&](double y) { return pointDensity(points, y); }, cuts) / (to - from)
                         : pointDensity(points, from);
    }
    double noiseMean(int axis, double from, double to) const {
        double sum = 0, total = 0;
        for (int octave = 0; octave < p.octaves; octave++) {
            const auto& sums = integrals[axis][octave];
            const int period = p.tile << octave;
            const double scale = std::pow(2., octave) / p.size, way = (to - from) * scale;
            double a = (from - double(p.wind[axis]) * time) * scale;
            a -= period * std::floor(a / period);
            const double b = a + way;
            double mean;
            if (way > 1e9) {
                mean = sums.back() / period;
            } else if (b <= std::floor(a) + 1) {
                mean = way > 1e-9 ? cellIntegral(axis, octave, a, b) / way
                                  : reference::lineNoise(a, uint32_t(axis), period,
                                                         uint32_t(p.seed) + uint32_t(octave) * 0x9e3779b9u);
            } else {
                const double first = std::floor(a) + 1, last = std::floor(b);
                auto upTo = [&](double cell) {
                    const double periods = std::floor(cell / period);
                    return periods * sums.back() + sums[size_t(cell - periods * period)];
                };
                mean = (cellIntegral(axis, octave, a, first) + upTo(last) - upTo(first) +
                        cellIntegral(axis, octave, last, b)) /
                       way;
            }
            sum += std::pow(.5, octave) * mean;
            total += std::pow(.5, octave);
        }
        return .5 + .5 * sum / total;
    }
    double axisMean(int a, double eyeAt, double way) const {
        const Axis axis = p.axis(a);
        const double from = std::min(eyeAt, eyeAt + way), to = std::max(eyeAt, eyeAt + way);
        double mean = 1;
        if (axis.profile == exponentialAxis)
            mean = to - from > 1e-9 * std::max(1., std::abs(eyeAt))
                       ? exponentialMean(axis, from, to)
                       : std::exp(std::min(60., -double(axis.falloff) * (.5 * (from + to) - axis.origin)));
        if (axis.profile == noiseAxis) mean = p.low + (double(p.high) - p.low) * noiseMean(a, from, to);
        if (axis.profile == rampAxis || axis.profile == tableAxis) mean = pointsMean(a, from, to);
        return std::min(axis.density * mean, 1e12);
    }
    double mean(const cv::Vec3d& d, double L) const {
        double product = 1;
        for (int a = 0; a < 3; a++) product *= axisMean(a, eye[a], d[a] * std::min(L, 1e30));
        return product;
    }
    // How much the product may move under 4 ulp of each axis' direction, place and exponent.
    double uncertainty(const cv::Vec3d& d, double L) const {
        const double e = 4. * std::numeric_limits<float>::epsilon(), far = std::min(L, 1e30);
        double means[3], changes[3], sum = 0;
        for (int a = 0; a < 3; a++) {
            const double way = d[a] * far;
            means[a] = axisMean(a, eye[a], way);
            const double exponent = p.axis(a).profile == exponentialAxis
                                        ? std::abs(p.axis(a).falloff) *
                                              std::max(std::abs(eye[a] - p.axis(a).origin), std::abs(way))
                                        : 0;
            changes[a] = means[a] * e * (1 + std::min(exponent, 1e6));
            for (int sign : {-1, 1}) {
                changes[a] += std::abs(axisMean(a, eye[a], way + sign * e * far) - means[a]);
                const double place = e * (std::abs(way) + p.size);
                changes[a] += std::abs(axisMean(a, eye[a] + sign * place, way) - means[a]);
            }
        }
        for (int a = 0; a < 3; a++) sum += changes[a] * means[(a + 1) % 3] * means[(a + 2) % 3];
        return sum;
    }
};

struct Outcome {
    cv::Vec3d color;
    double transmittance = 1;
    bool hidesAll = false;  ///< not even an infinite scene shows
};

inline double relativeDensity(const NoiseFog& p, double n, double dy) {
    switch (p.mode) {
        case modulate:
            return p.low * (1 - n) + p.high * n;
        case ocean:
            return n * dy * dy / 2 + .001;
        case additive:
            return 1 + p.strength * n;
        default:
            return std::max(0., 1 - p.strength * n);
    }
}

inline Outcome outcomeOf(const NoiseFog& p, const cv::Vec4f& scene, double L, double relative, double n,
                         double cosine) {
    Outcome out;
    const double x = std::min(std::max(0., L - p.start), 1e30);
    double opacity, T;
    if (p.model == exponential) {
        const double depth = double(p.density) * x * relative;
        opacity = -std::expm1(-depth), T = std::exp(-depth);
        out.hidesAll = depth >= 87;
    } else {
        const double u = x > 0 ? std::min(1e30, std::pow(x / p.powerDistance, double(p.powerExponent))) : 0;
        opacity = std::min(relative * u, double(p.maxOpacity)), T = 1 - opacity;
        out.hidesAll = T == 0;
    }
    if (opacity > p.maxOpacity) opacity = p.maxOpacity, T = 1 - opacity, out.hidesAll = T == 0;
    for (int c = 0; c < 3; c++) {
        double airlight = p.color[c] * (1 - n) + p.colorHigh[c] * n;
        if (p.hasSun() && cosine > 0) airlight += p.sunColor[c] * std::pow(cosine, double(p.sunExponent));
        out.color[c] = (out.hidesAll ? 0 : scene[c] * T) + airlight * opacity;
    }
    out.transmittance = T;
    return out;
}

inline ReferencePixel referencePixel(const NoiseFog& p, const ReferenceProduct& product,
                                     const ReferenceContext& c, cv::Point at) {
    const cv::Vec4f scene = c.input.at<cv::Vec4f>(at);
    const cv::Vec3d ray = c.camera.ray(at.x, at.y), eye = c.camera.eye();
    const double L = double(c.depth.at<float>(at)) * cv::norm(ray);
    const auto& m = c.camera.worldFromCamera;
    cv::Vec3d d;
    for (int n = 0; n < 3; n++)
        d[n] = (m(n, 0) * ray[0] + m(n, 1) * ray[1] + m(n, 2) * ray[2]) / cv::norm(ray);
    cv::Vec3d towards = d;
    double turn = 1;  // by how much more than a unit vector's rounding does the sum's turn it
    if (p.sunOffset > 0 && L < 1e15) {
        towards = d * L + cv::Vec3d::all(p.sunOffset);
        turn = (L + p.sunOffset) / cv::norm(towards);
        towards /= cv::norm(towards);
    }
    const cv::Vec3d sun(p.sunDirection);
    const double cosine = cv::norm(sun) > 0 ? towards.dot(sun) / cv::norm(sun) : 0;

    // The noise, and how far each method, and 4 ulp of its coordinates, may be off. Perlin noise rises by
    // less than 3/2 a cell; simplex by up to 3.4 beside lattice points, but is granted no more.
    const double epsilon = 4. * std::numeric_limits<float>::epsilon();
    const ReferenceNoise noise{p, eye, c.time};
    const double octaveSlope = 1.5 * p.octaves / (2 - std::pow(2., 1 - p.octaves));
    ReferencePixel pixel;
    double n = .5, methodNoise = .5, noiseChange = 0, relativeChange = 0;
    const double dy = std::min(L, 1e15) * d[1];
    double relative, methodRelative;
    if (p.where == asAProduct) {
        n = methodNoise = 0;
        relative = methodRelative = product.mean(d, L);
        relativeChange = product.uncertainty(d, L);
    } else {
        double way = std::min(L / p.size, 4096.);
        if (p.where == atTheSurface) {
            if (std::abs(L / p.size - 4096) < .01) pixel.ambiguous = true;
            if (L / p.size <= 4096) {
                const cv::Vec3d q = noise.cells(d * L);
                n = noise.smoothed(q);
                methodNoise = noise.byMethod(q);
            }
        } else {
            const double reach = std::min(L, double(p.range)), share = L > p.range ? p.range / L : 1;
            n = .5 + share * (noise.meanAlong(d, reach) - .5);
            methodNoise = .5 + share * (noise.middleMean(d, reach) - .5);
            way = reach / p.size;
        }
        noiseChange = 1e-6 + octaveSlope * epsilon * (way + 1);
        relative = relativeDensity(p, n, dy);
        methodRelative = relativeDensity(p, methodNoise, dy);
    }

    const Outcome truth = outcomeOf(p, scene, L, relative, n, cosine);
    for (int k = 0; k < 3; k++) {
        pixel.color[k] = truth.color[k];
        pixel.transmittance[k] = truth.transmittance;
        const double A = std::max(p.color[k], p.where == asAProduct ? p.color[k] : p.colorHigh[k]) +
                         (p.hasSun() ? p.sunColor[k] : 0.);
        pixel.scale = std::max({pixel.scale, std::isfinite(scene[k]) ? std::abs(double(scene[k])) : 0, A});
    }
    pixel.color[3] = scene[3];

    struct Change {
        double color = 0, transmittance = 0;
        void take(const Change& other) {
            color = std::max(color, other.color);
            transmittance = std::max(transmittance, other.transmittance);
        }
    };
    auto between = [&](const Outcome& a, const Outcome& b) {
        Change largest;
        largest.transmittance = std::abs(a.transmittance - b.transmittance);
        for (int k = 0; k < 3; k++) {
            const double difference = a.color[k] - b.color[k];
            if (std::isfinite(difference)) largest.color = std::max(largest.color, std::abs(difference));
            if (!std::isfinite(scene[k]) && a.hidesAll != b.hidesAll) pixel.ambiguous = true;
        }
        return largest;
    };
    // Roundings show as they do where the method is, which may be another side of a density's or an opacity's
    // limit than the truth's.
    const Outcome exact = outcomeOf(p, scene, L, methodRelative, methodNoise, cosine);
    auto change = [&](double l, double r, double noiseAt, double cos) {
        return between(outcomeOf(p, scene, l, r, noiseAt, cos), exact);
    };
    Change lengthwise, noisewise, densitywise, sunwise;
    for (int sign : {-1, 1}) {
        const double l =
            std::isfinite(L) ? std::max(0., L + sign * epsilon * std::max(L, double(p.start))) : L;
        lengthwise.take(change(l, methodRelative, methodNoise, cosine));
        const double around = std::clamp(methodNoise + sign * noiseChange, 0., 1.);
        if (p.where != asAProduct) {
            noisewise.take(change(L, relativeDensity(p, around, dy), around, cosine));
            const double climbed = relativeDensity(p, methodNoise, dy + sign * epsilon * std::min(L, 1e15));
            densitywise.take(change(L, climbed, methodNoise, cosine));
        } else {
            densitywise.take(change(L, std::max(0., relative + sign * relativeChange), n, cosine));
        }
        sunwise.take(change(L, methodRelative, methodNoise, std::min(1., cosine + sign * epsilon * turn)));
    }
    for (const Change& c : {lengthwise, noisewise, densitywise, sunwise}) {
        pixel.allowance += c.color;
        pixel.transmittanceAllowance += c.transmittance;
    }
    const Change method = between(exact, truth);
    pixel.methodError = method.color;
    pixel.transmittanceMethodError = method.transmittance;
    return pixel;
}

inline void reference(const NoiseFog& p, const ReferenceContext& c, std::span<const cv::Point> pixels,
                      std::span<ReferencePixel> truth) {
    const ReferenceProduct product(p, c.camera.eye(), c.time);
    for (size_t k = 0; k < pixels.size(); k++) truth[k] = referencePixel(p, product, c, pixels[k]);
}

}  // namespace brume::noise_fog
