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
    std::string against;  ///< the row that all are compared with, or empty
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
    std::string problem;  ///< why there are no numbers; empty: there are
};

/// Runs every row on every frame (depth without NaN) and runner. Differences are taken on each runner between
/// its own pictures. Calls `progress` after each row.
std::vector<PaperResult> runPapers(const std::vector<PaperExperiment>& experiments,
                                   const std::vector<FramePair>& frames, const std::vector<Runner*>& runners,
                                   const std::function<void(const PaperResult&)>& progress = {});

/// largest, root mean square and root mean square of 16×16 means of a - b, in 8-bit steps after clipping and
/// encoding; CV_32FC4 of one size.
cv::Vec3d pictureDifference(const cv::Mat& a, const cv::Mat& b);

std::string toCsv(const std::vector<PaperResult>& results);
/// A page of tables: the papers' rows beside ours, means over the frames.
std::string papersPage(const std::vector<PaperResult>& results);

}  // namespace brume
