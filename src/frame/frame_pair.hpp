// One captured frame as every part of brume sees it: colour, depth, camera.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "frame/camera.hpp"

namespace brume {

struct FramePair {
    std::string name;  ///< the file's stem, for messages and output names
    cv::Mat color;     ///< CV_32FC4, RGBA, scene-linear Rec. 709, alpha unassociated
    cv::Mat depth;     ///< CV_32F, planar view Z in metres; +inf is sky, NaN unknown
    Camera camera;
    bool cameraIsStated = true;
    double time = 0;    ///< s
    int index = 0;      ///< place in its sequence, from 0
    uint32_t seed = 0;  ///< of all random numbers
    /// What the sidecar knew besides (lights, a light's depth map): an object, or null. Shared, never
    /// changed.
    std::shared_ptr<const nlohmann::json> extras;
    /// Further images of the capture (a light's depth map), which steps may read by name: CV_32FC4, or CV_32F
    /// where there is one channel, which then stands for grey.
    std::map<std::string, cv::Mat> images;
    /// Every file that was read for it, as named: the colour image first, then depth, sidecar and light
    /// maps if there are.
    std::vector<std::string> files;
    /// What the reader understood and assumed, one sentence each ("depth: OpenGL device depth, near .1 m").
    std::vector<std::string> notes;
    /// Where the images are a smaller version of the frame, for a quick look: the size that the camera and
    /// every radius in px refer to. Empty: the images' own.
    cv::Size fullSize;

    cv::Size size() const { return color.size(); }
    cv::Size statedSize() const { return fullSize.empty() ? size() : fullSize; }
};

}  // namespace brume
