// Somebody else's program for an effect's job, timed by itself in a process of its own.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "effect/header.hpp"
#include "frame/frame_pair.hpp"
#include "measure/timer.hpp"

namespace brume {

struct PeerResult {
    std::string device;  ///< what the peer says it is: name, version, threads
    Timing timing;       ///< of the work alone, without reading and writing
    cv::Mat output;      ///< CV_32FC4, the frame's size
};

/// Runs `program FOLDER`. In the folder are job.json ("width", "height", "camera": {"fx", "fy", "cx", "cy"},
/// "parameters", "repetitions"), color.f32 (RGBA) and depth.f32 (Z in m), both float32 by rows from the top;
/// the program leaves output.f32 (RGBA) and result.json ("device", "milliseconds": [..]) there. Throws Error
/// (Io) with the last line it printed to stderr if it fails, or with a sentence saying what is not installed
/// if it ends with status 69.
PeerResult runPeer(const std::string& program, const EffectHeader& header, const ParameterValues& values,
                   const FramePair& frame, int repetitions);

}  // namespace brume
