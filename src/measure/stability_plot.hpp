// Charts and a table of where methods fail.
#pragma once

#include <string>
#include <vector>

#include "measure/plot.hpp"
#include "measure/stability.hpp"

namespace brume {

/// A regime as it was swept.
struct StabilitySweep {
    Regime regime;
    std::vector<StabilityLine> lines;
};

/// A panel for each regime and backend: error over stress, a line a method. Where a value is 0, negative or
/// no number the stresses stand at even distances instead of on a logarithmic scale. Vertical lines: where a
/// method passes the tolerance. Errors beyond 255 steps, infinite ones too, are drawn at the upper edge; a
/// regime of fewer than two values that run is left out.
PlotPage stabilityPlot(const std::string& effect, const std::vector<StabilitySweep>& sweeps);

/// RFC 4180: a line of names, then one for each point.
std::string stabilityCsv(const std::vector<StabilitySweep>& sweeps);

/// "midpoint (CPU): fails at 0.1 m, holds at 1 m; half a step near 0.2", one for each crossing.
std::vector<std::string> crossingSentences(const StabilitySweep& sweep);

}  // namespace brume
