#include "frame/camera_limits.hpp"

#include <cmath>

#include "error.hpp"

namespace brume {

std::string problemOf(const Camera& c) {
    const auto isFocal = [](double x) { return x >= 1e-6 && x <= 1e9; };
    if (!(c.fx > 0 && c.fy > 0)) return text("the focal lengths ", c.fx, ", ", c.fy, " px are not above 0");
    if (!isFocal(c.fx) || !isFocal(c.fy))
        return text("the focal lengths ", c.fx, ", ", c.fy, " px are not within 1e-6 to 1e9");
    if (!(std::abs(c.cx) <= 1e9 && std::abs(c.cy) <= 1e9))
        return text("the principal point ", c.cx, ", ", c.cy, " px is not within 1e9");
    for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column) {
            const double limit = column == 3 ? 1e15 : 1e3, number = c.worldFromCamera(row, column);
            if (!(std::abs(number) <= limit))
                return text("the pose holds ", number, ", not within ", limit,
                            column == 3 ? " m of the origin" : "");
        }
    return "";
}

}  // namespace brume
