// From what people name (files, folders, patterns, lists) to the frames meant, in order.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "frame/read.hpp"

namespace brume {

struct FrameFiles {
    std::string color;
    std::string depth;           ///< empty: in the colour file, named by its sidecar, or beside it
    std::optional<double> time;  ///< s, where the names or the list hold timestamps; the first frame is at 0
    std::string missing;         ///< why it has no depth though `depth` should have given one, or empty
};

/// Each of `frames` is a file; a folder of images; a pattern with one run of # or a %d ("shot.####.exr",
/// "%04d.png"); a shell pattern with * or ?; or a list (.txt): lines of "color", "color depth", "time color"
/// or "time color time depth", # starting a comment (TUM's rgb.txt and associations).
///
/// `depth` (may be empty) is a file, for a single frame; a pattern with {stem}, with * or ?, or with the same
/// # or %d; a folder; noDepth; or a list of "time depth" (TUM's depth.txt). Files of a folder or list pair by
/// equal stem, else by the last number in it ("rgb_0012" and "depth_0012"), else by nearest timestamp, at
/// most .02 s apart: frames without a depth that near are left out, as TUM's own tool does. A frame for which
/// there is no depth otherwise says so in `missing`; reading it throws that sentence.
///
/// Throws Error (Io): nothing matches, no frame has a depth.
std::vector<FrameFiles> expandFrames(const std::vector<std::string>& frames, const std::string& depth = "");

/// Reads one of them; `index` is its place in the sequence. Safe to call from several threads.
FramePair readFrame(const FrameFiles& files, int index, const ReadOptions& options = {});

}  // namespace brume
