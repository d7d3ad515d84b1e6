// Writes captures as pairs that brume reads: NAME.exr (colour), NAME.depth.exr (device depth), NAME.json.
#pragma once

#include <string>

#include "renderer.hpp"

namespace scenes {

class PairWriter {
  public:
    /// Makes the folder and writes the sun's depth map. Throws brume::Error (Io).
    PairWriter(const std::string& folder, const Scene& scene, const ShadowMap& shadow, int frames);
    /// Returns the colour file's path.
    std::string write(const Capture& capture, int index) const;

  private:
    std::string folder_;
    const Scene& scene_;
    cv::Matx44d worldToShadow_;
    int frames_;
};

}  // namespace scenes
