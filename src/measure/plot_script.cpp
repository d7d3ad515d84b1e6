#include "measure/plot_script.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "measure/plot_words.hpp"

namespace brume {
namespace {

// Okabe and Ito 2008, the light yellow left out: it vanishes on white. Then the same with open marks.
const char* colors[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#333333"};
const int marks[] = {7, 5, 9, 13, 11, 15, 3, 6, 4, 8, 12, 10, 14};  // discs, squares, triangles, ...
const int colorCount = 7, markCount = 13;

constexpr size_t mostShared = 9;  // names in a legend for the whole page; with more, each row has its own

std::string number(double x) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.9g", x);
    return buffer;
}

using Kind = PlotSeries::Kind;

struct Legend {
    std::vector<std::pair<std::string, Kind>> entries;

    void take(const PlotPanel& panel) {
        for (const PlotSeries& s : panel.series)
            if (std::none_of(entries.begin(), entries.end(), [&](auto& e) { return e.first == s.name; }))
                entries.emplace_back(s.name, s.kind);
    }
    // Frontier, bands and limits have a look of their own: colours are for the others.
    size_t lookOf(const std::string& name) const {
        size_t look = 0;
        for (const auto& [other, kind] : entries) {
            if (other == name) break;
            look += kind == Kind::Line || kind == Kind::Points;
        }
        return look;
    }
    std::string colorOf(const std::string& name) const {  // of a line or a word; nobody's are grey
        for (const auto& [other, kind] : entries)
            if (other == name) return kind == Kind::Band ? "#9a8c5a" : colors[lookOf(name) % colorCount];
        return "#666666";
    }
    int columns(int width) const {
        size_t longest = 0;
        for (const auto& [name, kind] : entries) longest = std::max(longest, name.size());
        return std::clamp(width / (70 + 7 * int(longest)), 1, std::max(1, int(entries.size())));
    }
    int height(int width) const {
        return 19 * ((int(entries.size()) + columns(width) - 1) / columns(width)) + 16;
    }
};

std::string styleOf(Kind kind, size_t look, double markSize = .75) {
    if (kind == Kind::Frontier || kind == Kind::Band) return "with lines lw 7 lc rgb '#e3ddc8'";
    if (kind == Kind::Limit) return "with lines lw 1.5 dt 2 lc rgb '#333333'";
    return (kind == Kind::Line ? "with linespoints lw 1.8 ps " + number(markSize)
                               : "with points lw 1.8 ps 1.2") +
           " pt " + std::to_string(marks[look % markCount]) + " lc rgb '" + colors[look % colorCount] + "'";
}

void writeTicks(std::ostream& out, char axis, const PlotTicks& ticks) {
    out << "set " << axis << "tics (";
    for (size_t k = 0; k < ticks.size(); k++)
        out << (k ? ", " : "") << plotQuoted(ticks[k].second) << ' ' << number(ticks[k].first)
            << (ticks[k].second.empty() ? " 1" : " 0");
    out << ")\n";
}

void writeMarks(std::ostream& out, const PlotPanel& panel, const Legend& legend) {
    out << "unset label\nunset arrow\n";
    for (const PlotMark& m : panel.marks) {
        if (!plotAxis(panel, m.isVertical).holds(m.at)) continue;
        const std::string at = number(m.at);
        out << "set arrow from "
            << (m.isVertical ? at + ",graph 0 to " + at + ",graph 1"
                             : "graph 0,first " + at + " to graph 1,first " + at)
            << " nohead lw 1.2 dt " << (m.isVertical ? 3 : 2) << " lc rgb '" << legend.colorOf(m.series)
            << "' back\n";
    }
    for (const PlotWord& w : placeWords(panel))
        out << "set label " << plotQuoted(w.word) << " at graph " << number(w.x) << ",graph " << number(w.y)
            << (w.endsHere ? " right" : " left") << (w.isUpright ? " rotate by 90" : "") << " front font ',"
            << w.fontSize << "' tc rgb '" << legend.colorOf(w.series) << "'\n";
}

void writePanel(std::ostream& out, const PlotPanel& panel, const Legend& legend, int index) {
    const PlotAxis x = plotAxis(panel, true), y = plotAxis(panel, false);
    auto shown = [&](const PlotPoint& p) {
        return std::isfinite(p.x) && std::isfinite(p.y) && !(panel.logX && p.x <= 0) &&
               (!panel.logY || p.y >= 0);
    };
    out << "set title " << plotQuoted(panel.title) << " offset 0,-.6 font ',12'\n"
        << "set xlabel " << plotQuoted(panel.xLabel) << " offset 0,.4\nset ylabel "
        << plotQuoted(panel.yLabel) << " offset .8,0\n"
        << (panel.logX ? "set logscale x\n" : "unset logscale x\n")
        << (panel.logY ? "set logscale y\n" : "unset logscale y\n") << "set xrange [" << number(x.least)
        << ':' << number(x.most) << "]\nset yrange [" << number(y.least) << ':' << number(y.most)
        << "]\nset xtics autofreq\nset ytics autofreq\n";
    if (!panel.xTicks.empty())
        writeTicks(out, 'x', thinned(panel.xTicks, x));
    else if (panel.logX)
        writeTicks(out, 'x', logTicks(x));
    if (panel.logY) writeTicks(out, 'y', logTicks(y));
    writeMarks(out, panel, legend);
    std::ostringstream plots;
    int block = 0;
    for (int layer = 0; layer < 2; layer++)  // the wide ones lie behind
        for (const PlotSeries& s : panel.series) {
            const size_t look = legend.lookOf(s.name);
            const bool isWide = s.kind == Kind::Frontier || s.kind == Kind::Band;
            if (isWide != (layer == 0)) continue;
            const std::string name = "$d" + std::to_string(index) + "_" + std::to_string(block++);
            bool any = false, spread = false;
            out << name << " << EOD\n";
            for (const PlotPoint& p : s.points) {
                if (!shown(p)) continue;
                any = true;
                const bool isSpread = p.xHigh > p.xLow;
                spread |= isSpread;
                out << number(p.x) << ' ' << number(std::clamp(p.y, y.least, y.most)) << ' '
                    << number(isSpread ? std::max(p.xLow, x.least) : p.x) << ' '
                    << number(isSpread ? std::min(p.xHigh, x.most) : p.x) << '\n';
            }
            out << "EOD\n";
            if (!any) continue;
            plots << (plots.tellp() > 0 ? ", " : "") << name;
            if (s.kind == Kind::Frontier)
                plots << " using 1:2 notitle with steps lw 7 lc rgb '#e3ddc8', " << name
                      << " using 1:2 notitle with points pt 7 ps 2.2 lc rgb '#e3ddc8'";
            else
                plots << " using 1:2 notitle " << styleOf(s.kind, look, s.markSize);
            if (spread)
                plots << ", " << name << " using 1:2:3:4 notitle with xerrorbars pt 0 lw 1 lc rgb '"
                      << colors[look % colorCount] << "'";
        }
    // A plot of nothing still draws the axes.
    out << "plot " << (plots.tellp() > 0 ? plots.str() : std::string("NaN notitle")) << "\n";
}

const char* frameOfPanels =
    "set border 3 lc rgb '#888888'\nset tics nomirror textcolor rgb '#333333' font ',9'\nset xtics nomirror "
    "format "
    "'%g'\nset ytics nomirror format '%g'\nset grid xtics ytics lw .6 lc rgb '#e8e8e8'\nset lmargin "
    "8.5\nset rmargin 1.5\nset tmargin 1.8\nset bmargin 3.2\n";
const char* noFrame =
    "unset border\nunset tics\nunset title\nunset xlabel\nunset ylabel\nunset label\nunset arrow\nunset "
    "grid\nunset logscale\nset lmargin 0\nset rmargin 0\nset tmargin 0\nset bmargin 0\nset xrange "
    "[0:1]\nset yrange [0:1]\n";

// Of a page, in px: a head, then rows of panels; a legend under each row, or one under all.
struct Layout {
    static constexpr int head = 48;
    int columns, width, panelHeight;
    std::vector<std::vector<const PlotPanel*>> rows;
    std::vector<Legend> legends;  // one, or one a row

    explicit Layout(const PlotPage& page) {
        const int count = int(page.panels.size());
        columns = std::max(1, std::min(page.columns, count));
        width = columns == 1 ? 640 : 440 * columns;
        panelHeight = columns == 1 ? 420 : 320;
        Legend all;
        for (int k = 0; k < count; k++) {
            if (k % columns == 0) rows.emplace_back();
            rows.back().push_back(&page.panels[k]);
            all.take(page.panels[k]);
        }
        if (all.entries.size() <= mostShared)
            legends = {all};
        else
            for (const auto& row : rows) {
                legends.emplace_back();
                for (const PlotPanel* panel : row) legends.back().take(*panel);
            }
    }
    const Legend& legendOf(size_t row) const { return legends[legends.size() == 1 ? 0 : row]; }
    bool endsWithLegend(size_t row) const { return legends.size() > 1 || row + 1 == rows.size(); }
    int height() const {
        int sum = head + panelHeight * std::max(1, int(rows.size()));
        for (const Legend& legend : legends) sum += legend.height(width);
        return sum;
    }
};

void writeLegend(std::ostream& out, const Legend& legend, double bottom, double share, int columns) {
    out << "set origin 0," << number(bottom) << "\nset size 1," << number(share) << "\n"
        << noFrame << "set key at screen .5,screen " << number(bottom + share / 2)
        << " center center horizontal Left reverse maxcols " << columns << " samplen 2.2 font ',10'\nplot ";
    for (size_t k = 0; k < legend.entries.size(); k++) {
        const auto& [name, kind] = legend.entries[k];
        out << (k ? ", " : "") << "NaN title " << plotQuoted(name) << ' '
            << styleOf(kind, legend.lookOf(name));
    }
    out << (legend.entries.empty() ? "NaN notitle" : "") << "\nunset key\n";
}

}  // namespace

std::string plotQuoted(const std::string& s) {
    std::string out = "'";
    for (char c : s) {
        if (c == '\'') out += c;
        out += c == '\n' ? ' ' : c;
    }
    return out + '\'';
}

PlotSize plotSize(const PlotPage& page) {
    const Layout layout(page);
    return {layout.width, layout.height()};
}

std::string plotScript(const PlotPage& page, const std::string& terminal, const std::string& output) {
    const Layout layout(page);
    const double height = layout.height();
    std::ostringstream out;
    out << "set encoding utf8\nset terminal " << terminal << "\nset output " << plotQuoted(output)
        << "\nset multiplot\nunset key\nset errorbars small\n"
        // Labels belong to the plot drawn next: one of nothing, for the title.
        << noFrame << "set label 1 " << plotQuoted(page.title) << " at screen .5,screen "
        << number(1 - 15. / height) << " center font ',15'\nset label 2 " << plotQuoted(page.note)
        << " at screen .5,screen " << number(1 - 36. / height)
        << " center font ',10' tc rgb '#666666'\nset origin 0,0\nset size 1,1\nplot NaN notitle\n";
    int index = 0;
    double below = height - Layout::head;  // px left under what is drawn
    for (size_t row = 0; row < layout.rows.size(); row++) {
        below -= layout.panelHeight;
        out << frameOfPanels;
        for (size_t k = 0; k < layout.rows[row].size(); k++) {
            out << "set origin " << number(double(k) / layout.columns) << ',' << number(below / height)
                << "\nset size " << number(1. / layout.columns) << ',' << number(layout.panelHeight / height)
                << "\n";
            writePanel(out, *layout.rows[row][k], layout.legendOf(row), index++);
        }
        if (!layout.endsWithLegend(row)) continue;
        const Legend& legend = layout.legendOf(row);
        below -= legend.height(layout.width);
        writeLegend(out, legend, below / height, legend.height(layout.width) / height,
                    legend.columns(layout.width));
    }
    out << "unset multiplot\nset output\n";
    return out.str();
}

}  // namespace brume
