// What a 4×4 matrix that a program hands to OpenGL says about its camera.
#pragma once

#include <optional>

namespace capture {

/// A perspective in normalised device coordinates: x = focalX·X/Z + centreX, and likewise y (up).
struct Projection {
    double focalX = 0, focalY = 0;
    double centreX = 0, centreY = 0;
    double nearPlane = 0, farPlane = 0;  ///< in the program's units; farPlane may be +inf
    bool reversed = false;               ///< the near plane has the larger depth
    bool isPure = false;                 ///< the matrix was a projection alone, not times a view
};

/// From 16 numbers, column by column as OpenGL stores them: a projection, or a projection times a view that
/// turns, moves and scales evenly. `lowestDepth` is -1, or 0 where the program chose the zero-to-one clip
/// volume. Nothing if it is no perspective, or one with an oblique near plane.
std::optional<Projection> perspectiveOf(const float* matrix, double lowestDepth = -1);

/// True for a projection without perspective (a HUD's, say).
bool isOrthographic(const float* matrix);

}  // namespace capture
