// What a capture is, and what looks wrong with its depth.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "frame/capture.hpp"

namespace brume {

struct DepthStatistics {
    double unknown = 0, sky = 0;  ///< shares of all pixels
    /// m, of finite depth: least, 1 %, 10 %, median, 90 %, 99 %, greatest; 0 if there is none.
    double least = 0, p1 = 0, p10 = 0, median = 0, p90 = 0, p99 = 0, greatest = 0;
    size_t distinct = 0;  ///< different finite numbers
    double step = 0;      ///< from the median to the next, relative
    bool even = false;    ///< the steps at 10 % and 90 % are as wide, in metres: quantised as distance
};

DepthStatistics depthStatistics(const cv::Mat& depth);

/// Something to look at, not a proof: a name of doubtNames() and the measurement behind it.
struct Doubt {
    std::string name, evidence;
};

/// range, polarity, disparity, mirrored, flipped, far plane, scale, quantised, overlay, ceiling, holes,
/// camera.
const std::vector<std::string>& doubtNames();

/// A way to read the stored numbers, likeliest first; score 0..1.
struct Reading {
    std::string name;  ///< what --depth-encoding takes
    double score = 0;
    std::string evidence;
    DepthEncoding encoding;
};

/// Doubts about a capture read as `encoding`. Thread-safe, deterministic; about .1 s.
std::vector<Doubt> findDoubts(const Capture& capture, const DepthEncoding& encoding);

/// What the numbers of a capture could mean, ranked by the geometry each would give.
std::vector<Reading> rankReadings(const Capture& capture);

/// Depth as log colours: near pale, far dark, sky white, unknown black. CV_8UC3 RGB.
cv::Mat depthColors(const cv::Mat& depth);
/// Colour, depth (depthColors) and the histogram of log depth side by
/// side: CV_32FC4 scene-linear.
cv::Mat inspectionPicture(const FramePair& frame);
/// A thumbnail of the depth of each reading, likeliest first, `width` px each; at most eight.
cv::Mat readingsPicture(const Capture& capture, const std::vector<Reading>& readings, int width);

}  // namespace brume
