// Words on a panel: where they stand clear of data, of lines and of each other; what ticks are called.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "measure/plot.hpp"

namespace brume {

/// One axis of a panel as it is drawn: its range, and where a value stands between its ends.
struct PlotAxis {
    double least = 0, most = 1;
    bool isLog = false;

    bool holds(double value) const { return value >= least && value <= most; }
    double share(double value) const;  ///< 0 at the start, 1 at the end
};
PlotAxis plotAxis(const PlotPanel& panel, bool ofX);

/// A word of a mark or a point. x and y are shares of the panel: of the middle of the end that is nearer to
/// what it names.
struct PlotWord {
    std::string word;
    double x = 0, y = 0;
    bool endsHere = false;   ///< right-aligned
    bool isUpright = false;  ///< read from below
    int fontSize = 9;
    std::string series;                               ///< whose colour it takes; empty: grey
    double left = 0, right = 0, bottom = 0, top = 0;  ///< what it covers, in shares
};

/// A mark's word goes to the first of some places where least is in its way. A point's goes to one of its
/// four corners, or is left out where each would lie on another word or outside.
std::vector<PlotWord> placeWords(const PlotPanel& panel);

/// A tick's place and word; an empty word: a small one.
using PlotTicks = std::vector<std::pair<double, std::string>>;
/// Of a logarithmic axis: decades, and 2 and 5 between them where there are few.
PlotTicks logTicks(const PlotAxis& axis);
/// `ticks` of the x axis without the words that would touch.
PlotTicks thinned(const PlotTicks& ticks, const PlotAxis& axis);

}  // namespace brume
