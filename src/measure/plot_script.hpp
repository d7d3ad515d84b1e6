// A page of charts as gnuplot's commands.
#pragma once

#include <string>

#include "measure/plot.hpp"

namespace brume {

/// px at a scale of 1.
struct PlotSize {
    int width = 0, height = 0;
};
PlotSize plotSize(const PlotPage& page);

/// Commands that draw the page into `output` with `terminal` ("svg size ..."), whatever the locale.
std::string plotScript(const PlotPage& page, const std::string& terminal, const std::string& output);

/// Text between single quotes, as gnuplot reads it: between double ones it would run what stands in
/// backquotes.
std::string plotQuoted(const std::string& s);

}  // namespace brume
