// Speed against accuracy: every method and knob that an effect's CHART declares, timed, and compared with the
// effect's own fp64 reference.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "effect/header_chart.hpp"
#include "effect/runner.hpp"
#include "measure/encoded_error.hpp"
#include "measure/timer.hpp"

namespace brume {

/// One measurement: a variant of an effect on a backend, or a peer.
struct ChartRow {
    std::string effect, caseName, method, knob, value;
    std::string backend;  ///< "cpu", "gl", or "peer"
    std::string device;   ///< what ran it: "CPU, 2 threads", the GL renderer, the peer's own words
    std::string frame;
    cv::Size size;  ///< of the frame
    /// ms: median and quartiles. On GL of the passes alone, by GPU timer queries; on the CPU wall time.
    double milliseconds = 0, low = 0, high = 0;
    int runs = 0;     ///< that the median is of
    double copy = 0;  ///< ms that copying the frame took on that device; 0: not known
    ErrorStatistics error;
    bool hasError = false;    ///< false: the effect has no reference
    bool onFrontier = false;  ///< among its case's and backend's, in time and worst error
    std::string problem;      ///< why there are no numbers; empty: there are
    std::string map;          ///< file of the error map, beside the CSV; empty: none

    std::string label() const;  ///< "march, steps 8"
    bool isPeer() const { return backend == "peer"; }
    bool operator==(const ChartRow&) const = default;
};

/// A row with what its map is drawn from.
struct ChartMeasurement {
    ChartRow row;
    cv::Size cells;              ///< of the sample grid
    std::vector<double> errors;  ///< 8-bit steps in each cell; NaN: ambiguous
};

struct ChartOptions {
    int repetitions = 15;
    double seconds = 1;     ///< a variant's timing ends early after this, but never under three repetitions
    size_t pixels = 14400;  ///< at which the reference is asked
};

/// The frame that charts are drawn for: depth without NaN. Steps of CHART's BEFORE run first, on the CPU.
/// Measures each variant on each of `runners` that it names, in CHART's order, then the case's peers. The
/// worst error is that of the sampled pixels and of those where methods differ most from the best of them.
/// Calls `progress` after each, before its worst pixel is known.
/// What a run throws becomes the row's problem.
std::vector<ChartMeasurement> chartEffect(const std::shared_ptr<const Effect>& effect, const FramePair& frame,
                                          const std::vector<Runner*>& runners, const ChartOptions& options,
                                          const std::function<void(const ChartRow&)>& progress = {});

/// How many times chartEffect will call `progress`.
size_t chartCount(const Effect& effect, const std::vector<Runner*>& runners);

/// Sets onFrontier: nothing of the same effect, case and backend is both faster and better. Peers never are.
void markFrontiers(std::vector<ChartRow>& rows);

}  // namespace brume
