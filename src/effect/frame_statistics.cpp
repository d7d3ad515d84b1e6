// What plans know of the captured frame, measured once.
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "effect/chain.hpp"
#include "effect/kit/math.hpp"
#include "effect/kit/view.hpp"

namespace brume {
namespace {

constexpr int tile = ImageBounds::tile;

// The pixel where something is greatest; of equals the first.
struct Extreme {
    double value = -HUGE_VAL;
    cv::Point pixel;
    void take(double v, int i, int j) {
        if (v > value) value = v, pixel = {i, j};
    }
    void take(const Extreme& other) {
        if (other.value > value) *this = other;
    }
};

// Of one row of tiles.
struct Part {
    size_t sky = 0;
    Extreme nearest, farthest, lowest, highest, brightest, darkestFar;
};

BRUME_INLINE float bounded(float x) { return isNan(x) ? 0.0f : std::clamp(x, -65504.0f, 65504.0f); }

void measureColor(const cv::Mat& color, int tileRow, ImageBounds& bounds, Part& part) {
    const int first = tileRow * tile, last = std::min(first + tile, color.rows);
    for (int column = 0; column < bounds.mean.cols; column++) {
        const int begin = column * tile, count = std::min(tile, color.cols - begin);
        cv::Vec4f low = cv::Vec4f::all(HUGE_VALF), high = -low, sum;
        for (int j = first; j < last; j++) {
            const float* row = color.ptr<float>(j) + 4 * begin;
            for (int i = 0; i < count; i++)
                for (int n = 0; n < 4; n++) {
                    const float x = bounded(row[4 * i + n]);
                    low[n] = std::min(low[n], x), high[n] = std::max(high[n], x), sum[n] += x;
                }
        }
        const float share = 1.0f / float(count * (last - first));
        for (int n = 0; n < 3; n++) {
            bounds.lowest.at<cv::Vec3f>(tileRow, column)[n] = low[n];
            bounds.highest.at<cv::Vec3f>(tileRow, column)[n] = high[n];
            bounds.mean.at<cv::Vec3f>(tileRow, column)[n] = sum[n] * share;
        }
        // The tile's brightest pixel is looked for only where it may be the frame's.
        if (std::max({high[0], high[1], high[2]}) <= part.brightest.value) continue;
        for (int j = first; j < last; j++)
            for (int i = begin; i < begin + count; i++) {
                const auto& c = color.at<cv::Vec4f>(j, i);
                part.brightest.take(std::max({bounded(c[0]), bounded(c[1]), bounded(c[2])}), i, j);
            }
    }
}

void measureGeometry(const FramePair& frame, const View& view, int row, double eyeHeight, Part& part,
                     float* farthest) {
    const float* depth = frame.depth.ptr<float>(row);
    const float y = view.rayY(row);
    const auto& r = view.worldFromView;
    for (int i = 0; i < frame.depth.cols; i++) {
        const float x = view.rayX(i), length = View::rayLength(x, y);
        const float up = (r(1, 0) * x + r(1, 1) * y - r(1, 2)) / length;
        if (!(depth[i] < HUGE_VALF)) {
            part.sky += depth[i] > 0;
            farthest[i / tile] = HUGE_VALF;
            continue;
        }
        const float distance = depth[i] * length;
        farthest[i / tile] = std::max(farthest[i / tile], distance);
        part.nearest.take(-distance, i, row);
        part.farthest.take(distance, i, row);
        const double height = eyeHeight + double(distance) * up;
        part.highest.take(height, i, row);
        part.lowest.take(-height, i, row);
        // far and dark: where fog shows most
        const auto& c = frame.color.at<cv::Vec4f>(row, i);
        part.darkestFar.take(distance / (.02f + std::max({c[0], c[1], c[2], 0.0f})), i, row);
    }
}

// Everywhere evenly: one pixel in each of 32 × 18 cells, by a sequence of low discrepancy.
std::vector<cv::Point> spread(cv::Size size) {
    std::vector<cv::Point> pixels;
    const int columns = std::min(32, size.width), rows = std::min(18, size.height);
    for (int k = 0; k < columns * rows; k++) {
        const double u = std::fmod(.5 + (k + 1) * .7548776662466927, 1.),
                     v = std::fmod(.5 + (k + 1) * .5698402909980532, 1.);
        pixels.emplace_back(int((k % columns + u) * size.width / columns),
                            int((k / columns + v) * size.height / rows));
    }
    for (int x : {0, size.width - 1})
        for (int y : {0, size.height - 1}) pixels.emplace_back(x, y);
    return pixels;
}

Probe probeAt(const FramePair& frame, const Camera& camera, cv::Point pixel) {
    Probe probe;
    probe.pixel = pixel;
    const cv::Vec3d ray = camera.ray(pixel.x, pixel.y);
    const auto& m = frame.camera.worldFromCamera;
    for (int n = 0; n < 3; n++) {
        probe.direction[n] = (m(n, 0) * ray[0] + m(n, 1) * ray[1] + m(n, 2) * ray[2]) / cv::norm(ray);
        probe.low[n] = probe.high[n] = bounded(frame.color.at<cv::Vec4f>(pixel)[n]);
    }
    const float depth = frame.depth.at<float>(pixel);
    probe.distance = depth < HUGE_VALF ? depth * cv::norm(ray) : HUGE_VAL;
    return probe;
}

}  // namespace

FrameStatistics measureFrame(const FramePair& frame) {
    FrameStatistics s;
    s.size = frame.size();
    s.eyeHeight = frame.camera.eye()[1];
    const cv::Size stated = frame.statedSize();
    const Camera camera = frame.camera.resized(stated, s.size);
    s.radiansPerPixel = 1 / std::max(camera.fx, camera.fy);
    const auto view = View::of(frame.camera, s.size.width, s.size.height, stated.width, stated.height);
    const cv::Size tiles((s.size.width + tile - 1) / tile, (s.size.height + tile - 1) / tile);
    for (cv::Mat* image : {&s.color.lowest, &s.color.highest, &s.color.mean}) image->create(tiles, CV_32FC3);

    s.farthest = cv::Mat::zeros(tiles, CV_32F);
    std::vector<Part> parts(tiles.height);
    cv::parallel_for_({0, tiles.height}, [&](const cv::Range& range) {
        for (int k = range.start; k < range.end; k++) {
            measureColor(frame.color, k, s.color, parts[k]);
            for (int j = k * tile; j < std::min((k + 1) * tile, s.size.height); j++)
                measureGeometry(frame, view, j, s.eyeHeight, parts[k], s.farthest.ptr<float>(k));
        }
    });
    Part all;
    for (const Part& part : parts) {
        for (auto extreme : {&Part::nearest, &Part::farthest, &Part::lowest, &Part::highest, &Part::brightest,
                             &Part::darkestFar})
            (all.*extreme).take(part.*extreme);
        all.sky += part.sky;
    }
    s.skyShare = double(all.sky) / std::max(1., double(s.size.area()));
    if (all.farthest.value >= 0) {
        s.minDistance = -all.nearest.value, s.maxDistance = all.farthest.value;
        s.minHeight = -all.lowest.value, s.maxHeight = all.highest.value;
    }
    double low, high;
    cv::minMaxLoc(s.color.lowest.reshape(1), &low, nullptr);
    cv::minMaxLoc(s.color.highest.reshape(1), nullptr, &high);
    s.color.low = low, s.color.high = high;

    for (const Extreme* extreme :
         {&all.nearest, &all.farthest, &all.lowest, &all.highest, &all.brightest, &all.darkestFar})
        s.probes.push_back(probeAt(frame, camera, extreme->pixel));
    for (cv::Point pixel : spread(s.size)) s.probes.push_back(probeAt(frame, camera, pixel));
    return s;
}

}  // namespace brume
