// Speed as a ratio in one run: candidates take turns over the same rotating frames; medians.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace brume {

struct Timing {
    std::string name;
    std::vector<double> milliseconds;  ///< one a repetition
    double median() const;
    double quartileLow() const;
    double quartileHigh() const;
};

struct Candidate {
    std::string name;
    std::function<void(int slot)> work;  ///< on frame `slot` of the eight
};

/// Runs each candidate in turn, `repetitions` times over slots 0..slots-1, after one warm-up each. Stops
/// early once `seconds` have passed, but never under three repetitions.
std::vector<Timing> takeTurns(const std::vector<Candidate>& candidates, int slots = 8, int repetitions = 24,
                              double seconds = 10);

}  // namespace brume
