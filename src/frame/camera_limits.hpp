// Which cameras effects can work with.
#pragma once

#include <string>

#include "frame/camera.hpp"

namespace brume {

/// Why effects cannot work with this camera, as the rest of a sentence about it, or "". They compute in
/// float32, whose range the squares of rays and places must not leave: focal lengths are 1e-6 to 1e9 px, the
/// principal point is within 1e9 px, the eye within 1e15 m, the pose's directions within 1e3.
std::string problemOf(const Camera& camera);

}  // namespace brume
