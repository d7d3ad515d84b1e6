// How a depth file's numbers become planar view Z in metres (MODELS.md §0).
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "frame/camera.hpp"

namespace brume {

struct DepthEncoding {
    enum class Kind { Linear, Device };
    Kind kind = Kind::Linear;
    double scaleToMetres = 1;           ///< Linear: stored × scale = metres
    double nearPlane = .1;              ///< Device: stored units
    double farPlane = 1000;             ///< Device: stored units; +inf for an infinite far plane
    double rangeMin = 0, rangeMax = 1;  ///< Device: stored values at the near and far plane's δ = 0, 1
    bool reversed = false;              ///< Device: δ = 1 at the near plane
    double metresPerUnit = 1;           ///< Device
    bool alongRay = false;              ///< stored distance is along the ray, not planar
    double skyAtOrAbove = 1e9;          ///< Linear: such values (before scaling) are sky
    bool zeroIsSky = false;             ///< Linear: 0 of a rendered Z channel
    std::vector<double> unknown;        ///< Linear: stored values that mean "not known"

    std::string describe() const;
};

/// Planar Z in metres of a stored CV_32F image: +inf sky, NaN unknown, otherwise finite and ≥ 0.
cv::Mat decodeDepth(const cv::Mat& stored, const DepthEncoding& encoding, const Camera& camera);

}  // namespace brume
