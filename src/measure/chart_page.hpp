// What people look at: an effect's chart from its rows, and one page that holds every chart of a folder.
#pragma once

#include <string>
#include <vector>

#include "measure/chart.hpp"
#include "measure/plot.hpp"

namespace brume {

/// The errors that count as none: half an 8-bit step cannot be seen.
inline constexpr double visibleError = .5;

/// Panels of worst error over time, cases downwards, CPU and GL side by side; peers stand with the CPU.
/// Rows of one effect.
PlotPage chartPlot(const std::vector<ChartRow>& rows);

/// The fastest row of that case and backend that stays under half an 8-bit step, or null.
const ChartRow* fastestUnseen(const std::vector<ChartRow>& rows, const std::string& caseName,
                              const std::string& backend);

/// "CPU", or "OpenGL, " and the renderer's name without its versions.
std::string deviceWord(const ChartRow& row);

/// Cases of rows, in their order.
std::vector<std::string> casesOf(const std::vector<ChartRow>& rows);

/// "2.3 ms", "0.0123", with three digits that count.
std::string shortNumber(double value);

/// What files of an effect's stability are called, without extension.
inline std::string stabilityStem(const std::string& effect) { return "stability." + effect; }

/// An <img> that holds the file, .svg or .png; nothing where it cannot be read.
std::string embeddedPicture(const std::string& path, const std::string& alt);

/// How every page of ours begins, up to <body>.
std::string pageHead(const std::string& title);

/// Writes DIR/index.html from all EFFECT.csv in it with their EFFECT.svg and maps: one file that needs no
/// other. Pieces of a long measurement may so be made one after the other. Throws Error (Io).
void writeChartPage(const std::string& folder);

}  // namespace brume
