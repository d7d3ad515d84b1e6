// Which of two lists of times belong together.
#pragma once

#include <vector>

namespace brume {

/// For each frame the depth whose time is nearest, or -1: the closest pair first, each once, at most
/// `mostApart`.
std::vector<int> pairNearest(const std::vector<double>& frames, const std::vector<double>& depths,
                             double mostApart);

}  // namespace brume
