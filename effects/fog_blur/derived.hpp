// fog_blur's constants, fp64.
#pragma once

#include <algorithm>
#include <vector>

#include "effect/derive_context.hpp"
#include "fog_blur/ladder_design.hpp"
#include "fog_blur/params.hpp"

namespace fog_blur {

/// What a method may be off by, of the brightest light within its blur and the share of the weight left.
inline double statedError(const FogBlur& p) {
    if (p.method == gatherMethod) return 1e-3;
    if (p.rungs == 1) return p.edges == keep ? .03 : .021;
    if (p.rungs == 2) return p.edges == keep ? .01 : .004;
    return p.edges == keep ? .005 : .001;
}
inline double largestOf(const FogBlur& p, const brume::DeriveContext& c) {
    return double(p.radius) * c.size.width / c.frameSize.width;
}
inline std::vector<Level> levelsOf(const FogBlur& p, const brume::DeriveContext& c) {
    return ladderOf(largestOf(p, c), c.size.width, c.size.height, spacingOf(p.rungs));
}
inline std::vector<double> largestSigma(const FogBlur& p, const brume::DeriveContext& c) {
    return {largestOf(p, c)};
}
inline std::vector<double> levelCount(const FogBlur& p, const brume::DeriveContext& c) {
    return {double(levelsOf(p, c).size())};
}
// Levels take turns at the shelves of the strip.
inline std::vector<double> levels(const FogBlur& p, const brume::DeriveContext& c) {
    std::vector<double> numbers, left(size_t(p.rungs), 0.);
    size_t shelf = 0;
    for (const Level& l : levelsOf(p, c)) {
        for (double x : {l.sigma, double(l.factor), left[shelf], double(l.reach)}) numbers.push_back(x);
        left[shelf] += l.width;
        shelf = (shelf + 1) % left.size();
    }
    return numbers;
}
inline std::vector<double> levelTables(const FogBlur& p, const brume::DeriveContext& c) {
    std::vector<double> numbers;
    double taps = 0, prefilter = 0, phase = 0;
    for (const Level& l : levelsOf(p, c)) {
        for (double x : {taps, prefilter, phase, double(l.width)}) numbers.push_back(x);
        taps += l.reach + 1, prefilter += prefilterReach(l.factor) + 1, phase += l.factor;
    }
    return numbers;
}
inline std::vector<double> stripWidth(const FogBlur& p, const brume::DeriveContext& c) {
    std::vector<double> widths(size_t(p.rungs), 0.);
    size_t shelf = 0;
    for (const Level& l : levelsOf(p, c)) {
        widths[shelf] += l.width;
        shelf = (shelf + 1) % widths.size();
    }
    return {*std::max_element(widths.begin(), widths.end())};
}
template <class TableOf>
inline std::vector<double> joined(const FogBlur& p, const brume::DeriveContext& c, TableOf tableOf) {
    std::vector<double> numbers;
    for (const Level& l : levelsOf(p, c)) {
        auto table = tableOf(l);
        numbers.insert(numbers.end(), table.begin(), table.end());
    }
    return numbers;
}
inline std::vector<double> levelTaps(const FogBlur& p, const brume::DeriveContext& c) {
    return joined(p, c, tapsOf);
}
inline std::vector<double> prefilters(const FogBlur& p, const brume::DeriveContext& c) {
    return joined(p, c, [](const Level& l) { return decimationOf(l).prefilter; });
}
inline std::vector<double> phases(const FogBlur& p, const brume::DeriveContext& c) {
    return joined(p, c, [](const Level& l) { return blur::enlargingWeights(decimationOf(l)); });
}
inline std::vector<double> tapCount(const FogBlur& p, const brume::DeriveContext& c) {
    return {double(levelTaps(p, c).size())};
}
inline std::vector<double> prefilterCount(const FogBlur& p, const brume::DeriveContext& c) {
    return {double(prefilters(p, c).size())};
}
inline std::vector<double> phaseCount(const FogBlur& p, const brume::DeriveContext& c) {
    return {double(phases(p, c).size()) / blur::enlargingTaps};
}
inline std::vector<double> nodeWeights(const FogBlur& p, const brume::DeriveContext& c) {
    return ladderWeights(levelsOf(p, c), p.rungs);
}

}  // namespace fog_blur
