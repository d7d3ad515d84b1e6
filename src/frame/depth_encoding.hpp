// How a depth file's numbers become planar view Z in metres (MODELS.md §0).
#pragma once

#include <array>
#include <limits>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "frame/camera.hpp"

namespace brume {

/// What a stored number v means. All arithmetic is fp64; classes come first: NaN and the values in `unknown`
/// are unknown, then sky, then the formula.
struct DepthEncoding {
    enum class Kind {
        Linear,     ///< Z = v·scaleToMetres
        Device,     ///< a depth buffer: δ = (v - range[0])/(range[1] - range[0]), Z from near and far plane
        Reshade,    ///< likewise, but what is stored is δ/(F - δ(F - 1)), F = reshadeFar
        Disparity,  ///< Z = focalBaseline/(v·disparityScale + disparityOffset)
        Inverse,    ///< Z = 1/(v·disparityScale + disparityOffset)
    };
    static constexpr double infinity = std::numeric_limits<double>::infinity();

    Kind kind = Kind::Linear;
    double scaleToMetres = 1;
    double nearPlane = .1;     ///< Device, Reshade: in stored units
    double farPlane = 1000;    ///< Device, Reshade: in stored units; +inf for an infinite far plane
    double metresPerUnit = 1;  ///< Device, Reshade
    bool reversed = false;     ///< Device, Reshade: δ = 1 at the near plane
    /// Device, Reshade: the numbers stored for 0 and 1. Unstated: 0 and 1; of integers 0 and the most they
    /// hold.
    std::optional<std::array<double, 2>> range;
    double reshadeFar = 1000;       ///< Reshade: RESHADE_DEPTH_LINEARIZATION_FAR_PLANE
    double focalBaseline = 1;       ///< Disparity: px·m
    double disparityScale = 1;      ///< Disparity, Inverse: px (1/m) per stored number
    double disparityOffset = 0;     ///< Disparity, Inverse: px (1/m)
    bool alongRay = false;          ///< the distance is along the ray, not planar
    double skyAtOrAbove = 1e9;      ///< Linear: such stored numbers are sky
    double skyBeyond = infinity;    ///< m: whatever decodes to this or more is sky
    bool zeroIsSky = false;         ///< Linear: 0 is sky (a renderer's Z), not unknown (a sensor's)
    std::vector<double> unknown;    ///< stored numbers that mean "not known"; may hold +inf
    double sensorReach = infinity;  ///< m: no sensor whose ready-made name this is measures farther

    /// "OpenGL-like device depth, near .1 m, far 70 m": for messages.
    std::string describe() const;
    bool operator==(const DepthEncoding&) const = default;
};

/// The numbers that an image of CV_8U, CV_16U or CV_32F stores for 0 and 1 of a depth buffer.
std::array<double, 2> storedRange(const DepthEncoding& encoding, int depth);

/// Planar Z in metres of a stored CV_8U, CV_16U or CV_32F image: +inf sky, NaN unknown, otherwise finite and
/// > 0. Zero and negative distances never mean near: they are unknown (or sky, see zeroIsSky).
cv::Mat decodeDepth(const cv::Mat& stored, const DepthEncoding& encoding, const Camera& camera);

/// The floating-point number that decodes to planar depth `z` (m), in fp64; +inf gives the encoding's number
/// for sky. For tests and for making captures.
double encodeDepth(double z, const DepthEncoding& encoding);

/// An encoding as the command line states it: a ready-made name, then the sidecar's keys (docs/FRAMES.md):
/// "tum", "opengl:near=.1,far=100", "linear:scale_to_metres=.001,unknown=0,unknown=65535". Throws Error
/// (Usage) with the offending key or the nearest name.
DepthEncoding parseDepthEncoding(const std::string& text);
/// linear, device, disparity, inverse, blender, tum, kitti, sintel, middlebury, realsense, opengl, ...
std::vector<std::string> depthEncodingNames();
/// Those of them that have a sensorReach: tum, kitti, kinect, realsense.
std::vector<std::string> sensorEncodingNames();

}  // namespace brume
