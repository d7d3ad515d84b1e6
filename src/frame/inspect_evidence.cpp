#include "frame/inspect_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "frame/color_encoding.hpp"

namespace brume {

FramePair thinned(const FramePair& frame, const cv::Mat& depth) {
    const int step = std::max(1, depth.cols / 640);
    const cv::Size size(depth.cols / step, depth.rows / step);
    FramePair thin = frame;
    thin.color = cv::Mat();
    cv::resize(frame.color, thin.color, size, 0, 0, cv::INTER_AREA);
    thin.depth = cv::Mat(size, CV_32F);
    for (int j = 0; j < size.height; ++j)
        for (int i = 0; i < size.width; ++i)
            thin.depth.at<float>(j, i) = depth.at<float>(j * step + step / 2, i * step + step / 2);
    thin.camera = frame.camera.resized(frame.size(), size);
    return thin;
}

FramePair thinnedReading(const Capture& capture, const DepthEncoding& encoding) {
    const FramePair& frame = capture.frame;
    return thinned(frame, decodeDepth(capture.stored, encoding,
                                      frame.camera.resized(frame.size(), capture.stored.size())));
}

namespace {

/// Where depth jumps by a tenth between neighbours; sky counts as far away.
cv::Mat depthEdges(const cv::Mat& depth) {
    cv::Mat edges = cv::Mat::zeros(depth.size(), CV_8U);
    const auto jump = [](float a, float b) {
        if (std::isnan(a) || std::isnan(b)) return false;
        return std::abs(std::log(std::min(a, 1e5f) / std::min(b, 1e5f))) > .1f;
    };
    for (int j = 0; j + 1 < depth.rows; ++j)
        for (int i = 0; i + 1 < depth.cols; ++i) {
            const float z = depth.at<float>(j, i);
            if (jump(z, depth.at<float>(j, i + 1)) || jump(z, depth.at<float>(j + 1, i)))
                edges.at<uchar>(j, i) = 255;
        }
    return edges;
}

/// Strength of colour edges as a rank, 0 to 1.
cv::Mat rankedGradient(const cv::Mat& color) {
    cv::Mat grey, x, y, gradient;
    cv::cvtColor(toSrgb8(color, false, 0, 0), grey, cv::COLOR_RGB2GRAY);
    grey.convertTo(grey, CV_32F);
    cv::GaussianBlur(grey, grey, {5, 5}, 1);
    cv::Sobel(grey, x, CV_32F, 1, 0);
    cv::Sobel(grey, y, CV_32F, 0, 1);
    cv::magnitude(x, y, gradient);
    cv::dilate(gradient, gradient, cv::Mat::ones(3, 3, CV_8U));  // a pixel's play between the two images
    std::vector<int> order(gradient.total());
    std::iota(order.begin(), order.end(), 0);
    const float* g = gradient.ptr<float>();
    std::stable_sort(order.begin(), order.end(), [g](int a, int b) { return g[a] < g[b]; });
    cv::Mat rank(gradient.size(), CV_32F);
    for (size_t k = 0; k < order.size(); ++k) rank.ptr<float>()[order[k]] = float(k) / float(order.size());
    return rank;
}

}  // namespace

EdgeFit edgeFit(const FramePair& frame) {
    const cv::Mat edges = depthEdges(frame.depth), rank = rankedGradient(frame.color);
    EdgeFit fit;
    fit.edges = size_t(cv::countNonZero(edges));
    if (fit.edges == 0) return fit;
    constexpr int asIs = 2;
    const auto meanAt = [&](int code) {
        if (code == asIs) return cv::mean(rank, edges)[0];
        cv::Mat turned;
        cv::flip(edges, turned, code);
        return cv::mean(rank, turned)[0];
    };
    fit.asIs = meanAt(asIs);
    fit.mirrored = meanAt(1);
    fit.flipped = meanAt(0);
    fit.both = meanAt(-1);
    return fit;
}

namespace {

/// Root mean square distance of values on a square grid from their best plane, over their deviation.
double planeResidual(const std::vector<double>& v, int side) {
    const double centre = (side - 1) / 2.;
    double mean = 0, x = 0, y = 0, square = 0, gridSquare = 0;
    for (int k = 0; k < side * side; ++k) mean += v[k];
    mean /= side * side;
    for (int k = 0; k < side * side; ++k) {
        const double i = k % side - centre, j = k / side - centre, d = v[k] - mean;
        x += i * d;
        y += j * d;
        square += d * d;
        gridSquare += i * i;
    }
    const double explained = (x * x + y * y) / gridSquare;
    return square > 0 ? std::sqrt(std::max(0., square - explained) / square) : 1;
}

}  // namespace

static Flatness flatness(const cv::Mat& depth, int side) {
    size_t inverse = 0, decided = 0;
    std::vector<double> z(side * side), q(side * side);
    for (int top = 0; top + side <= depth.rows; top += side / 2)
        for (int left = 0; left + side <= depth.cols; left += side / 2) {
            bool finite = true;
            for (int k = 0; k < side * side && finite; ++k) {
                z[k] = depth.at<float>(top + k / side, left + k % side);
                q[k] = 1 / z[k];
                finite = std::isfinite(z[k]);
            }
            if (!finite) continue;
            const auto [low, high] = std::minmax_element(z.begin(), z.end());
            if (*high < 1.04 * *low || *high > 4 * *low) continue;  // no slope, or an edge
            const double inZ = planeResidual(z, side), inQ = planeResidual(q, side);
            if (std::min(inZ, inQ) > .15 || std::min(inZ, inQ) > .5 * std::max(inZ, inQ)) continue;
            ++decided;
            inverse += inQ < inZ;
        }
    return {decided ? double(inverse) / double(decided) : 1, decided};
}

Flatness flatness(const cv::Mat& depth) {
    const Flatness small = flatness(depth, 24);
    // A sensor's noise hides the curve of small patches.
    return small.patches >= 12 ? small : flatness(depth, 64);
}

GroundOrder groundOrder(const cv::Mat& depth) {
    const int reach = std::max(1, depth.rows / 20);
    size_t nearer = 0, pairs = 0, places = 0;
    for (int j = depth.rows / 2; j + reach < depth.rows; j += 2)
        for (int i = 0; i < depth.cols; i += 2) {
            ++places;
            const float above = depth.at<float>(j, i), below = depth.at<float>(j + reach, i);
            if (!std::isfinite(above) || !std::isfinite(below)) continue;
            const float ratio = below / above;
            if (ratio > .99f && ratio < 1.01f) continue;
            ++pairs;
            nearer += ratio < 1;
        }
    return {pairs ? double(nearer) / double(pairs) : 1, pairs, places ? double(pairs) / double(places) : 0};
}

std::optional<Floor> findFloor(const FramePair& frame) {
    struct Point {
        double slope, inverse;
    };
    std::vector<Point> points;
    const cv::Matx44d& pose = frame.camera.worldFromCamera;
    for (int j = frame.depth.rows / 2; j < frame.depth.rows; j += 2)
        for (int i = 0; i < frame.depth.cols; i += 2) {
            const float z = frame.depth.at<float>(j, i);
            if (!std::isfinite(z)) continue;
            const cv::Vec3d r = frame.camera.ray(i, j);
            points.push_back({-(pose(1, 0) * r[0] + pose(1, 1) * r[1] + pose(1, 2) * r[2]), 1. / z});
        }
    if (points.size() < 500) return std::nullopt;
    uint32_t state = 1;
    const auto draw = [&] {
        state = state * 1664525u + 1013904223u;
        return size_t((uint64_t(state) * points.size()) >> 32);
    };
    const auto inliers = [&](double perSlope, double offset, size_t stride) {
        size_t count = 0;
        for (size_t k = 0; k < points.size(); k += stride)
            count +=
                std::abs(points[k].inverse - (points[k].slope * perSlope + offset)) < .02 * points[k].inverse;
        return count;
    };
    double bestSlope = 0, bestOffset = 0;
    size_t best = 0;
    const size_t stride = std::max<size_t>(1, points.size() / 2000);
    for (int trial = 0; trial < 600; ++trial) {
        const Point a = points[draw()], b = points[draw()];
        if (std::abs(a.slope - b.slope) < .1) continue;
        const double perSlope = (a.inverse - b.inverse) / (a.slope - b.slope);
        // Walls hardly change with the slope; a floor's inverse depth does, by a height.
        if (!(perSlope > 0) || perSlope * a.slope < .3 * a.inverse) continue;
        const double offset = a.inverse - perSlope * a.slope;
        const size_t count = inliers(perSlope, offset, stride);
        if (count > best) best = count, bestSlope = perSlope, bestOffset = offset;
    }
    if (best == 0) return std::nullopt;
    const double share = double(inliers(bestSlope, bestOffset, 1)) / double(points.size());
    if (share < 1 / 6.) return std::nullopt;
    return Floor{1 / bestSlope, bestOffset, share};
}

NearCluster nearCluster(const cv::Mat& depth) {
    std::vector<float> z;
    for (int j = 0; j < depth.rows; ++j)
        for (int i = 0; i < depth.cols; ++i)
            if (std::isfinite(depth.at<float>(j, i))) z.push_back(depth.at<float>(j, i));
    std::sort(z.begin(), z.end());
    NearCluster cluster;
    const double total = double(depth.total());
    for (size_t k = size_t(total * .002); k + 1 < z.size() && double(k) < .3 * total; ++k) {
        const double gap = z[k + 1] / z[k];
        if (gap > cluster.gap) cluster = {double(k + 1) / total, gap, z[k], 0};
    }
    size_t lower = 0, all = 0;
    for (int j = 0; j < depth.rows; ++j)
        for (int i = 0; i < depth.cols; ++i)
            if (depth.at<float>(j, i) <= cluster.farthest) {
                ++all;
                lower += j >= depth.rows / 2;
            }
    if (all) cluster.lowerShare = double(lower) / double(all);
    return cluster;
}

}  // namespace brume
