// Measurements on a colour and depth image that doubts and readings rest on.
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

#include "frame/capture.hpp"

namespace brume {

/// The frame with `depth` (of any size of its shape) at no more than 640 px wide: depth by samples, so that
/// it stays what it is, colour averaged.
FramePair thinned(const FramePair& frame, const cv::Mat& depth);
/// The same for one reading of a capture's numbers.
FramePair thinnedReading(const Capture& capture, const DepthEncoding& encoding);

/// How well depth's edges fall on colour's: the probability that colour's gradient is stronger at a depth
/// edge than at a random pixel (.5 by chance), for depth as it is, mirrored left-right, flipped top-bottom,
/// both.
struct EdgeFit {
    double asIs = .5, mirrored = .5, flipped = .5, both = .5;
    size_t edges = 0;
};
EdgeFit edgeFit(const FramePair& frame);

/// Perspective makes 1/Z of a flat surface an affine function of the pixel. Of the sloping patches that are
/// flat in 1/Z or in Z itself, the share in which 1/Z is the flatter.
struct Flatness {
    double inverseShare = 1;
    size_t patches = 0;
};
Flatness flatness(const cv::Mat& depth);

/// Below the horizon, how often the lower of two pixels is the nearer.
struct GroundOrder {
    double share = 1;
    size_t pairs = 0;
    double covered = 0;  ///< share of the places looked at where depth changes
};
GroundOrder groundOrder(const cv::Mat& depth);

/// A floor under a level camera: 1/Z = s/height + offset, s being the downward slope of the ray; offset is 0
/// where depth is right. Found by RANSAC among slopes; nothing where no such line holds a sixth of the lower
/// half.
struct Floor {
    double height = 0;  ///< m below the eye
    double offset = 0;  ///< 1/m
    double share = 0;   ///< of the lower half
};
std::optional<Floor> findFloor(const FramePair& frame);

/// The nearest pixels, apart from all others by a gap in depth.
struct NearCluster {
    double share = 0;       ///< of all pixels
    double gap = 1;         ///< nearest other depth over the cluster's farthest
    double farthest = 0;    ///< m, of the cluster
    double lowerShare = 0;  ///< of the cluster, in the lower half
};
NearCluster nearCluster(const cv::Mat& depth);

}  // namespace brume
