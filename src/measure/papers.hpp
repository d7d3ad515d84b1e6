// The papers' experiments run again: chains beside what was printed of them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "effect/runner.hpp"

namespace brume {

struct PaperExperiment {
    struct Row {
        std::string name, paper;  ///< what the paper printed, or empty
        Chain chain;
        cv::Size size;  ///< the frame is brought to it; empty: as it is
    };
    std::string paper, title, measured;
    std::string against;   ///< the row that all are compared with, or empty
    double seconds = 0;    ///< of an animation whose motion is compared too, 24 frames each; 0: one picture
    bool isShown = false;  ///< with the middle of each row's picture
    std::vector<Row> rows;
};

/// The experiments that ship, or those of a file like samples/papers.json. Throws Error (Usage) naming file,
/// experiment and key.
std::vector<PaperExperiment> readPapers(const std::string& path, const EffectRegistry& registry);
std::string shippedPapers();

/// One row of an experiment on one frame and runner.
struct PaperResult {
    std::string paper, title, measured, row, printed, against;
    std::string backend, device, frame;
    cv::Size size;
    double milliseconds = 0, low = 0, high = 0;  ///< as ChartRow's
    /// From the row it is compared with, over all pixels, in 8-bit steps after encoding: the largest, the
    /// root mean square, and that of means over 16×16 pixels, which bands keep and fine noise loses.
    double worst = 0, rms = 0, coarse = 0;
    bool hasDifference = false;
    /// Of an animation, over all frames and pixels: what changes from one frame to the next, root mean square
    /// in 8-bit steps; and how much of that goes with what changes in the row it is compared with: the
    /// correlation, 1 for the same motion, 0 for one that has nothing to do with it.
    double change = 0, shared = 0;
    bool hasMotion = false;
    cv::Mat
        shown;  ///< CV_8U or CV_8UC3, of the first frame: a strip of its animation, or the picture's middle
    std::string picture;  ///< the file that it was written to, or empty
    std::string problem;  ///< why there are no numbers; empty: there are
};

/// Runs every row on every frame (depth without NaN) and runner. Differences are taken on each runner between
/// its own pictures. Calls `progress` after each row,
/// before its motion is known.
std::vector<PaperResult> runPapers(const std::vector<PaperExperiment>& experiments,
                                   const std::vector<FramePair>& frames, const std::vector<Runner*>& runners,
                                   const std::function<void(const PaperResult&)>& progress = {});

struct PaperMotion {
    double change = 0, shared = 0;  ///< as PaperResult's
    /// CV_8U: opacity (white: nothing but fog) at the start, the middle and the end, then one line of the
    /// picture, that where most changes, from the start (top) to the end: what moves evenly draws slanted
    /// streaks.
    cv::Mat strip;
};
/// Runs planned chains on a frame at `count` times from its own on, seconds/(count - 1) apart.
std::vector<PaperMotion> measureMotion(const std::vector<Chain>& chains, size_t against,
                                       const FramePair& frame, Runner& runner, double seconds, int count);

/// CV_8UC3, encoded: the middle 480×270 pixels of a picture (CV_32FC4), or all where it is smaller.
cv::Mat middleOf(const cv::Mat& image);

/// Writes what is shown of results to FOLDER/papers.N.png and notes the names. Throws Error (Io).
void writePictures(std::vector<PaperResult>& results, const std::string& folder);

/// largest, root mean square and root mean square of 16×16 means of a - b, in 8-bit steps after clipping and
/// encoding; CV_32FC4 of one size.
cv::Vec3d pictureDifference(const cv::Mat& a, const cv::Mat& b);

std::string toCsv(const std::vector<PaperResult>& results);
/// A page of tables: the papers' rows beside ours, means over the frames. Pictures are taken from `folder`.
std::string papersPage(const std::vector<PaperResult>& results, const std::string& folder);

}  // namespace brume
