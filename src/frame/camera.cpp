#include "frame/camera.hpp"

#include <cmath>

namespace brume {

cv::Matx44d Camera::standing(double height, double pitchDegrees) {
    const double pitch = pitchDegrees * CV_PI / 180, c = std::cos(pitch), s = std::sin(pitch);
    return {1, 0, 0,  0,       //
            0, c, -s, height,  //
            0, s, c,  0,       //
            0, 0, 0,  1};
}

Camera Camera::withHorizontalView(cv::Size size, double degrees) {
    Camera camera;
    camera.fx = camera.fy = size.width / 2. / std::tan(degrees * CV_PI / 360);
    camera.cx = size.width / 2.;
    camera.cy = size.height / 2.;
    camera.worldFromCamera = standing();
    return camera;
}

Camera Camera::resized(cv::Size from, cv::Size to) const {
    const double x = double(to.width) / from.width, y = double(to.height) / from.height;
    Camera camera = *this;
    camera.fx *= x;
    camera.cx *= x;
    camera.fy *= y;
    camera.cy *= y;
    return camera;
}

}  // namespace brume
