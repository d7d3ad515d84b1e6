// A frame's camera in an EXR header: the one-file form (docs/FRAMES.md).
#pragma once

#include <ImfForward.h>

#include <optional>

#include "frame/camera.hpp"

namespace brume {

struct ExrCamera {
    Camera camera;
    double time = 0;
};

void putCamera(Imf::Header& header, const Camera& camera, double time);
/// What putCamera wrote, to the bit; nothing where there is no such camera.
std::optional<ExrCamera> getCamera(const Imf::Header& header);

}  // namespace brume
