// What plans know of the captured frame, measured once.
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "effect/chain.hpp"
#include "effect/kit/math.hpp"
#include "effect/kit/view.hpp"
#include "effect/runner.hpp"

namespace brume {
namespace {

constexpr int tile = ImageBounds::tile;

// The pixel where something is greatest; of equals the first.
struct Extreme {
    double value = -HUGE_VAL;
    cv::Point pixel;
    void take(const Extreme& other) {
        if (other.value > value) *this = other;
    }
};

// Of one row of tiles.
struct Part {
    size_t sky = 0;
    Extreme nearest, farthest, lowest, highest, brightest, darkestFar;
};

BRUME_INLINE float bounded(float x) {
    x = isNan(x) ? 0.0f : x;
    x = x < 65504.0f ? x : 65504.0f;
    return x > -65504.0f ? x : -65504.0f;
}

// One tile's pixels, plane by plane, row by row; to the right of and below the frame its last ones are
// repeated.
struct Pixels {
    alignas(64) float color[3][tile * tile];
    alignas(64) float distance[tile * tile];  // m along the ray; less than nothing: sky
    alignas(64) float rise[tile * tile];      // m, of the surface above the eye
    alignas(64) float hard[tile * tile];      // how easily fog shows there: far and dark
};

constexpr float skyDistance = 2000;  // m: what sky counts as where places are compared by how far they are

BRUME_VECTORISE void fetchTile(const FramePair& frame, const View& view, int column, int row, Pixels& p) {
    const auto& r = view.worldFromView;
    const int count = std::min(tile, frame.color.cols - column), last = frame.color.rows - 1;
    for (int j = 0; j < tile; j++) {
        const int from = std::min(row + j, last), at = j * tile;
        const float* color = frame.color.ptr<float>(from) + 4 * column;
        const float* depth = frame.depth.ptr<float>(from) + column;
        float pixels[4 * tile], planar[tile];
        for (int k = 0; k < 4 * count; k++) pixels[k] = color[k];
        for (int k = 4 * count; k < 4 * tile; k++) pixels[k] = pixels[k - 4];
        for (int i = 0; i < tile; i++) planar[i] = depth[std::min(i, count - 1)];
        for (int n = 0; n < 3; n++)
            for (int i = 0; i < tile; i++) p.color[n][at + i] = bounded(pixels[4 * i + n]);
        const float y = view.rayY(from);
        for (int i = 0; i < tile; i++) {
            const float x = view.rayX(column + std::min(i, count - 1)), length = View::rayLength(x, y);
            const bool isSurface = planar[i] < HUGE_VALF;
            const float distance = isSurface ? planar[i] * length : skyDistance;
            p.distance[at + i] = isSurface ? distance : -1.0f;
            p.rise[at + i] = planar[i] * (r(1, 0) * x + r(1, 1) * y - r(1, 2));
            float brightest =
                p.color[0][at + i] > p.color[1][at + i] ? p.color[0][at + i] : p.color[1][at + i];
            brightest = brightest > p.color[2][at + i] ? brightest : p.color[2][at + i];
            p.hard[at + i] = distance / (0.02f + (brightest > 0.0f ? brightest : 0.0f));
        }
    }
}

struct TileSums {
    float low[3], high[3], sum[3];
    float nearest = HUGE_VALF, farthest = -1, lowest = HUGE_VALF, highest = -HUGE_VALF, hardest = 0;
    int sky = 0;
};

BRUME_VECTORISE void sumTile(const Pixels& p, TileSums& s) {
    for (int n = 0; n < 3; n++) {
        float low[tile], high[tile], sum[tile];
        for (int i = 0; i < tile; i++) low[i] = high[i] = sum[i] = p.color[n][i];
        for (int j = tile; j < tile * tile; j += tile)
            for (int i = 0; i < tile; i++) {
                const float x = p.color[n][j + i];
                low[i] = x < low[i] ? x : low[i];
                high[i] = x > high[i] ? x : high[i];
                sum[i] += x;
            }
        s.low[n] = *std::min_element(low, low + tile), s.high[n] = *std::max_element(high, high + tile);
        s.sum[n] = 0;
        for (float x : sum) s.sum[n] += x;
    }
    float nearest[tile], farthest[tile], lowest[tile], highest[tile], hardest[tile];
    int sky[tile];
    for (int i = 0; i < tile; i++) {
        nearest[i] = lowest[i] = HUGE_VALF, highest[i] = -HUGE_VALF, farthest[i] = -1, hardest[i] = 0,
        sky[i] = 0;
    }
    for (int j = 0; j < tile * tile; j += tile)
        for (int i = 0; i < tile; i++) {
            const float distance = p.distance[j + i], rise = p.rise[j + i];
            const bool isSurface = distance >= 0.0f;
            const float near = isSurface ? distance : HUGE_VALF, down = isSurface ? rise : HUGE_VALF,
                        up = isSurface ? rise : -HUGE_VALF;
            nearest[i] = near < nearest[i] ? near : nearest[i];
            farthest[i] = distance > farthest[i] ? distance : farthest[i];
            lowest[i] = down < lowest[i] ? down : lowest[i];
            highest[i] = up > highest[i] ? up : highest[i];
            hardest[i] = p.hard[j + i] > hardest[i] ? p.hard[j + i] : hardest[i];
            sky[i] += isSurface ? 0 : 1;
        }
    s.nearest = *std::min_element(nearest, nearest + tile);
    s.farthest = *std::max_element(farthest, farthest + tile);
    s.lowest = *std::min_element(lowest, lowest + tile);
    s.highest = *std::max_element(highest, highest + tile);
    s.hardest = *std::max_element(hardest, hardest + tile);
    for (int n : sky) s.sky += n;
}

// `value` is one of `values`: at which pixel?
cv::Point placeOf(const float* values, float value, cv::Point corner) {
    const int k = int(std::find(values, values + tile * tile - 1, value) - values);
    return corner + cv::Point(k % tile, k / tile);
}

void measureTile(const FramePair& frame, const View& view, cv::Point at, FrameStatistics& s, Part& part) {
    const cv::Point corner = at * tile;
    Pixels p;
    fetchTile(frame, view, corner.x, corner.y, p);
    TileSums sums;
    sumTile(p, sums);
    const int columns = std::min(tile, frame.color.cols - corner.x),
              rows = std::min(tile, frame.color.rows - corner.y);
    if (columns * rows < tile * tile) {  // what is repeated does not count
        sums.sky = 0;
        for (int n = 0; n < 3; n++) sums.sum[n] = 0;
        for (int j = 0; j < rows; j++)
            for (int i = 0; i < columns; i++) {
                sums.sky += p.distance[j * tile + i] < 0;
                for (int n = 0; n < 3; n++) sums.sum[n] += p.color[n][j * tile + i];
            }
    }
    for (int n = 0; n < 3; n++) {
        const cv::Point place = ImageBounds::placeOf(corner);
        s.color.lowest.at<cv::Vec3f>(place)[n] = sums.low[n];
        s.color.highest.at<cv::Vec3f>(place)[n] = sums.high[n];
        s.color.leastMean.at<cv::Vec3f>(place)[n] = sums.sum[n] / float(columns * rows);
    }
    part.sky += size_t(sums.sky);
    auto take = [&](Extreme& extreme, float value, const float* values, float sign) {
        if (sign * value > extreme.value) extreme = {sign * value, placeOf(values, value, corner)};
    };
    if (sums.farthest >= 0) {
        take(part.nearest, sums.nearest, p.distance, -1);
        take(part.farthest, sums.farthest, p.distance, 1);
        take(part.lowest, sums.lowest, p.rise, -1);
        take(part.highest, sums.highest, p.rise, 1);
    }
    const int brightest = int(std::max_element(sums.high, sums.high + 3) - sums.high);
    take(part.brightest, sums.high[brightest], p.color[brightest], 1);
    take(part.darkestFar, sums.hardest, p.hard, 1);
    const int hardest = int(std::find(p.hard, p.hard + tile * tile - 1, sums.hardest) - p.hard);
    s.hardest.at<cv::Vec4f>(at) = {p.color[0][hardest], p.color[1][hardest], p.color[2][hardest],
                                   p.distance[hardest] < 0 ? HUGE_VALF : p.distance[hardest]};
}

// What the edges repeat beyond them.
void measureRing(const cv::Mat& color, ImageBounds& bounds) {
    auto measure = [&](int row, int column) {
        auto of = [](int place, int places, int length) {  // the pixels whose values are there
            const int first = place == 0 ? 0 : place == places - 1 ? length - 1 : (place - 1) * tile;
            const bool isBeyond = place == 0 || place == places - 1;
            return cv::Range(first, isBeyond ? first + 1 : std::min(first + tile, length));
        };
        const cv::Mat part =
            color(of(row, bounds.lowest.rows, color.rows), of(column, bounds.lowest.cols, color.cols));
        auto &low = bounds.lowest.at<cv::Vec3f>(row, column),
             &high = bounds.highest.at<cv::Vec3f>(row, column),
             &mean = bounds.leastMean.at<cv::Vec3f>(row, column);
        for (int n = 0; n < 3; n++) {
            low[n] = HUGE_VALF, high[n] = -HUGE_VALF, mean[n] = 0;
            for (int j = 0; j < part.rows; j++)
                for (int i = 0; i < part.cols; i++) {
                    const float x = bounded(part.at<cv::Vec4f>(j, i)[n]);
                    low[n] = std::min(low[n], x), high[n] = std::max(high[n], x);
                    mean[n] += x / float(part.total());
                }
        }
    };
    for (int row = 0; row < bounds.lowest.rows; row++)
        for (int column : {0, bounds.lowest.cols - 1}) measure(row, column);
    for (int column = 0; column < bounds.lowest.cols; column++)
        for (int row : {0, bounds.lowest.rows - 1}) measure(row, column);
}

// Everywhere evenly: one pixel in each of columns × rows cells, by a sequence of low discrepancy.
void spread(cv::Size size, int columns, int rows, std::vector<cv::Point>& pixels) {
    columns = std::min(columns, size.width), rows = std::min(rows, size.height);
    for (int k = 0; k < columns * rows; k++) {
        const double u = std::fmod(.5 + (k + 1) * .7548776662466927, 1.),
                     v = std::fmod(.5 + (k + 1) * .5698402909980532, 1.);
        pixels.emplace_back(int((k % columns + u) * size.width / columns),
                            int((k / columns + v) * size.height / rows));
    }
}

}  // namespace

Probe PlanInput::probeAt(cv::Point pixel) const {
    Probe probe;
    probe.pixel = pixel;
    const cv::Vec3d ray = scene.camera.ray(pixel.x, pixel.y);
    const double length = cv::norm(ray);
    const auto& m = scene.camera.worldFromCamera;
    const cv::Point place = ImageBounds::placeOf(pixel);
    for (int n = 0; n < 3; n++) {
        probe.direction[n] = (m(n, 0) * ray[0] + m(n, 1) * ray[1] + m(n, 2) * ray[2]) / length;
        if (!color.empty())
            probe.low[n] = probe.high[n] = bounded(color.at<cv::Vec4f>(pixel)[n]);
        else if (!input.lowest.empty())
            probe.low[n] = input.lowest.at<cv::Vec3f>(place)[n],
            probe.high[n] = input.highest.at<cv::Vec3f>(place)[n];
        else
            probe.low[n] = input.low, probe.high[n] = input.high;
    }
    const float planar = depth.at<float>(pixel);
    probe.distance = planar < HUGE_VALF ? planar * length : HUGE_VAL;
    return probe;
}

FrameStatistics measureFrame(const FramePair& frame) {
    FrameStatistics s;
    s.size = frame.size();
    s.eyeHeight = frame.camera.eye()[1];
    const cv::Size stated = frame.statedSize();
    const Camera camera = frame.camera.resized(stated, s.size);
    s.radiansPerPixel = 1 / std::max(camera.fx, camera.fy);
    const auto view = View::of(frame.camera, s.size.width, s.size.height, stated.width, stated.height);
    const cv::Size tiles((s.size.width + tile - 1) / tile, (s.size.height + tile - 1) / tile);
    for (cv::Mat* image : {&s.color.lowest, &s.color.highest, &s.color.leastMean})
        image->create(tiles + cv::Size(2, 2), CV_32FC3);
    s.color.greatestMean = s.color.leastMean;  // it is known

    s.hardest.create(tiles, CV_32FC4);
    std::vector<Part> parts(tiles.height);
    cv::parallel_for_({0, tiles.height}, [&](const cv::Range& range) {
        for (int j = range.start; j < range.end; j++)
            for (int i = 0; i < tiles.width; i++) measureTile(frame, view, {i, j}, s, parts[j]);
    });
    measureRing(frame.color, s.color);
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
        s.minHeight = s.eyeHeight - all.lowest.value, s.maxHeight = s.eyeHeight + all.highest.value;
    }
    double low, high;
    cv::minMaxLoc(s.color.lowest.reshape(1), &low, nullptr);
    cv::minMaxLoc(s.color.highest.reshape(1), nullptr, &high);
    s.color.low = low, s.color.high = high;

    PlanInput seen;
    seen.scene = deriveContextFor(frame, s.size);
    seen.depth = frame.depth, seen.color = frame.color;
    for (const Extreme* extreme :
         {&all.nearest, &all.farthest, &all.lowest, &all.highest, &all.brightest, &all.darkestFar})
        s.probes.push_back(seen.probeAt(extreme->pixel));
    const int right = s.size.width - 1, bottom = s.size.height - 1;
    std::vector<cv::Point> pixels = {{0, 0}, {0, bottom}, {right, 0}, {right, bottom}};
    spread(s.size, 32, 18, pixels);
    spread(s.size, 80, 45, pixels);
    for (cv::Point pixel : pixels) s.probes.push_back(seen.probeAt(pixel));
    return s;
}

}  // namespace brume
