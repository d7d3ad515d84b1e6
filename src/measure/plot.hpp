// Charts in one style, drawn by gnuplot: SVG for pages, PNG for everything else.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>
#include <vector>

namespace brume {

struct PlotPoint {
    double x = 0, y = 0;
    double xLow = 0, xHigh = 0;  ///< spread of x; equal: none is drawn
    std::string label;           ///< small, beside the point; left out where it would lie on another
};

struct PlotSeries {
    enum class Kind {
        Line,      ///< points joined by a line, in their order
        Points,    ///< alone: peers, what "auto" chose
        Frontier,  ///< a wide pale staircase behind the others
        Band,      ///< a wide pale line behind the others
        Limit,     ///< a dark dashed curve: what must not be passed
    };
    std::string name;  ///< series of one name share colour and mark across panels and one line of the legend
    Kind kind = Kind::Line;
    std::vector<PlotPoint> points;
    double markSize = .75;
};

/// A straight line across a panel, with a word beside it.
struct PlotMark {
    bool isVertical = false;
    double at = 0;
    std::string label;
    std::string series;  ///< whose colour it takes; empty: grey. Such a word should be short
};

struct PlotPanel {
    std::string title, xLabel, yLabel;
    bool logX = true, logY = true;
    /// Both 0: as the data asks. Values of y outside are drawn at the edge.
    std::pair<double, double> xRange, yRange;
    std::vector<std::pair<double, std::string>> xTicks;  ///< place and word; none: numbers
    std::vector<PlotSeries> series;
    std::vector<PlotMark> marks;
};

struct PlotPage {
    std::string title, note;  ///< one line each; the note, in grey, under the title
    std::vector<PlotPanel> panels;
    int columns = 2;  ///< at most
};

/// Writes `path`.svg and `path`.png: panels in a grid, one legend for all below them, or where names are many
/// one below each row. Words move out of the way of data and of each other. Colours are Okabe and
/// Ito's, distinguishable by the colour-blind, and every series has a mark of its own. Points with a value
/// that is not finite, or not positive on a logarithmic axis, are left out. Throws Error (Io) if gnuplot is
/// missing or cannot write.
void writePlots(const PlotPage& page, const std::string& path);

/// A picture with a colour bar: `values` (CV_64F, one channel; NaN is grey) on a logarithmic scale, least to
/// most, as `path` (a .png), `width` px wide.
void writeMap(const cv::Mat& values, double least, double most, const std::string& title,
              const std::string& barLabel, const std::string& path, int width = 720);

/// The places of those of `points` (time, error) that no other beats in one without losing in the other,
/// ascending in time. Points that are not finite are never among them; of equal ones the first is.
std::vector<size_t> paretoFrontier(const std::vector<std::pair<double, double>>& points);

/// True where gnuplot can be started.
bool hasGnuplot();

}  // namespace brume
