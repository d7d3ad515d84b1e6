#include "measure/timer.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace brume {
namespace {

// Linear between neighbours of the sorted values.
double quantile(std::vector<double> values, double q) {
    if (values.empty()) return std::nan("");
    std::sort(values.begin(), values.end());
    double place = q * double(values.size() - 1);
    size_t below = size_t(place), above = std::min(below + 1, values.size() - 1);
    return values[below] + (place - double(below)) * (values[above] - values[below]);
}

}  // namespace

double Timing::median() const { return quantile(milliseconds, .5); }
double Timing::quartileLow() const { return quantile(milliseconds, .25); }
double Timing::quartileHigh() const { return quantile(milliseconds, .75); }

std::vector<Timing> takeTurns(const std::vector<Candidate>& candidates, int slots, int repetitions,
                              double seconds) {
    using Clock = std::chrono::steady_clock;
    std::vector<Timing> timings;
    // Each turn takes the next slot, so that nobody finds a frame that the one before just warmed; the extra
    // step a round lets every candidate meet every slot.
    int turn = 0;
    auto nextSlot = [&] { return (turn + turn / slots) % slots; };
    for (const Candidate& candidate : candidates) {
        timings.push_back({candidate.name, {}});
        candidate.work(nextSlot());
        turn++;
    }
    Clock::time_point begin = Clock::now();
    for (int repetition = 0; repetition < repetitions; repetition++) {
        if (repetition >= 3 && std::chrono::duration<double>(Clock::now() - begin).count() > seconds) break;
        for (size_t k = 0; k < candidates.size(); k++, turn++) {
            int slot = nextSlot();
            Clock::time_point start = Clock::now();
            candidates[k].work(slot);
            std::chrono::duration<double, std::milli> elapsed = Clock::now() - start;
            timings[k].milliseconds.push_back(elapsed.count());
        }
    }
    return timings;
}

}  // namespace brume
