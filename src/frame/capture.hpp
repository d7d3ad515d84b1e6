// A frame as it was captured: colour decoded, depth still as stored, and what was said about it.
#pragma once

#include <optional>

#include "frame/read.hpp"

namespace brume {

struct Capture {
    FramePair frame;  ///< all but depth
    cv::Mat stored;   ///< one channel, CV_8U, CV_16U or CV_32F, of any size of the colour's shape
    std::string depthPath;
    std::optional<DepthEncoding> stated;  ///< by options, sidecar, or the file
    std::optional<DepthEncoding> habit;   ///< what such files usually mean; nothing for integers
    bool poseIsStated = false;
};

/// As readFrame, but integers of unstated meaning pass. Throws Error (Io). Safe to call from several threads.
Capture readCapture(const std::string& path, const ReadOptions& options = {});

/// The frame under one reading of its depth. Throws Error (Io) where that leaves depth unknown everywhere.
FramePair decodeCapture(const Capture& capture, const DepthEncoding& encoding);

}  // namespace brume
