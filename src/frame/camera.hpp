// The pinhole camera of a frame, and the geometry of its pixels.
#pragma once

#include <opencv2/core/matx.hpp>
#include <opencv2/core/types.hpp>

namespace brume {

/// Intrinsics in px, pixel (column i, row j from the top) having its centre at (i + .5, j + .5); pose in
/// metres, right-handed, +y up, looking along -z.
struct Camera {
    double fx = 0, fy = 0;
    double cx = 0, cy = 0;
    cv::Matx44d worldFromCamera = cv::Matx44d::eye();

    /// At (0, height, 0), level but for `pitch` (degrees, positive looks up).
    static cv::Matx44d standing(double height = 1.6, double pitchDegrees = 0);
    /// Principal point in the middle, square pixels, standing at 1.6 m.
    static Camera withHorizontalView(cv::Size size, double degrees);
    /// The camera of the same view resampled from one size to another.
    Camera resized(cv::Size from, cv::Size to) const;

    cv::Vec3d eye() const { return {worldFromCamera(0, 3), worldFromCamera(1, 3), worldFromCamera(2, 3)}; }
    /// Camera-space ray of a pixel: ((i + .5 - cx)/fx, -(j + .5 - cy)/fy, -1). A surface at planar depth Z
    /// lies at Z·ray, at the distance Z·|ray| from the eye (MODELS.md §0).
    cv::Vec3d ray(double i, double j) const { return {(i + .5 - cx) / fx, -(j + .5 - cy) / fy, -1}; }
};

}  // namespace brume
