#include "measure/plot.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "error.hpp"

namespace brume {
namespace {

// Okabe and Ito 2008, the light yellow left out: it vanishes on white. Then the same with open marks.
const char* colors[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#333333"};
const int marks[] = {7, 5, 9, 13, 11, 15, 3, 6, 4, 8, 12, 10, 14};  // discs, squares, triangles, ...
const int colorCount = 7, markCount = 13;

std::string quoted(const std::string& s) {
    std::string out = "\"";
    for (char c : s) {
        if (c == '"' || c == '\\') out += '\\';
        if (c == '\n') c = ' ';
        out += c;
    }
    return out + '"';
}

// A number that gnuplot reads whatever the locale.
std::string number(double x) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.9g", x);
    return buffer;
}

std::pair<double, double> rangeOf(const PlotPanel& panel, bool ofX) {
    auto given = ofX ? panel.xRange : panel.yRange;
    if (given.first != given.second) return given;
    const bool isLog = ofX ? panel.logX : panel.logY;
    double least = HUGE_VAL, most = -HUGE_VAL;
    auto take = [&](double v) {
        if (!std::isfinite(v) || (isLog && v <= 0)) return;
        least = std::min(least, v);
        most = std::max(most, v);
    };
    for (const PlotSeries& s : panel.series)
        for (const PlotPoint& p : s.points) take(ofX ? p.x : p.y);
    for (const PlotMark& m : panel.marks)
        if (m.isVertical == ofX) take(m.at);
    if (!(least <= most)) return {isLog ? .1 : 0, 1};
    if (!isLog) return {least - .05 * (most - least), most + .05 * (most - least) + (most == least)};
    return {least / 1.6, most * 1.6};
}

struct Legend {
    std::vector<std::pair<std::string, PlotSeries::Kind>> entries;
    size_t placeOf(const PlotSeries& s) {
        for (size_t k = 0; k < entries.size(); k++)
            if (entries[k].first == s.name) return k;
        entries.emplace_back(s.name, s.kind);
        return entries.size() - 1;
    }
    // Frontier, bands and limits have a look of their own: colours are for the others.
    size_t lookOf(size_t place) const {
        size_t look = 0;
        for (size_t k = 0; k < place; k++)
            look +=
                entries[k].second == PlotSeries::Kind::Line || entries[k].second == PlotSeries::Kind::Points;
        return look;
    }
};

std::string styleOf(PlotSeries::Kind kind, size_t look, double markSize = .75) {
    using Kind = PlotSeries::Kind;
    if (kind == Kind::Frontier || kind == Kind::Band) return "with lines lw 7 lc rgb '#e3ddc8'";
    if (kind == Kind::Limit) return "with lines lw 1.5 dt 2 lc rgb '#333333'";
    const std::string color = std::string(" lc rgb '") + colors[look % colorCount] + "'";
    const std::string mark = " pt " + std::to_string(marks[look % markCount]);
    return (kind == Kind::Line ? "with linespoints lw 1.8 ps " + number(markSize)
                               : "with points lw 1.8 ps 1.2") +
           mark + color;
}

void writePanel(std::ostream& out, const PlotPanel& panel, Legend& legend, int index) {
    const auto x = rangeOf(panel, true), y = rangeOf(panel, false);
    auto shown = [&](const PlotPoint& p) {
        return std::isfinite(p.x) && std::isfinite(p.y) && !(panel.logX && p.x <= 0) &&
               (!panel.logY || p.y >= 0);
    };
    out << "set title " << quoted(panel.title) << " offset 0,-.6 font ',12'\n"
        << "set xlabel " << quoted(panel.xLabel) << " offset 0,.4\nset ylabel " << quoted(panel.yLabel)
        << " offset .8,0\n"
        << (panel.logX ? "set logscale x\n" : "unset logscale x\n")
        << (panel.logY ? "set logscale y\n" : "unset logscale y\n") << "set xrange [" << number(x.first)
        << ':' << number(x.second) << "]\n"
        << "set yrange [" << number(y.first) << ':' << number(y.second) << "]\n"
        << "unset label\nunset arrow\n";
    if (!panel.xTicks.empty()) {
        std::string ticks;
        for (const auto& [at, word] : panel.xTicks)
            ticks += (ticks.empty() ? "" : ", ") + quoted(word) + " " + number(at);
        out << "set xtics (" << ticks << ")\n";
    }
    for (const PlotMark& m : panel.marks) {
        const auto [least, most] = m.isVertical ? x : y;
        if (m.at < least || m.at > most) continue;
        const std::string at = number(m.at);
        if (m.isVertical)
            out << "set arrow from " << at << ",graph 0 to " << at
                << ",graph 1 nohead lw 1.2 dt 3 lc rgb '#666666' back\nset label " << quoted(m.label)
                << " at " << at
                << ",graph .02 rotate by 90 left offset .75,0 front font ',9' tc rgb '#666666'\n";
        else
            out << "set arrow from graph 0,first " << at << " to graph 1,first " << at
                << " nohead lw 1.2 dt 2 lc rgb '#666666' back\nset label " << quoted(m.label)
                << (m.labelAtStart ? " at graph .1,first " : " at graph .985,first ") << at
                << (m.labelAtStart ? " left" : " right")
                << " offset 0,.45 front font ',9' tc rgb '#666666'\n";
    }
    std::ostringstream plots;
    int block = 0;
    for (int layer = 0; layer < 2; layer++)  // the wide ones lie behind
        for (const PlotSeries& s : panel.series) {
            const size_t look = legend.lookOf(legend.placeOf(s));
            const bool isWide = s.kind == PlotSeries::Kind::Frontier || s.kind == PlotSeries::Kind::Band;
            if (isWide != (layer == 0)) continue;
            const std::string name = "$d" + std::to_string(index) + "_" + std::to_string(block++);
            bool any = false, spread = false, labels = false;
            out << name << " << EOD\n";
            for (const PlotPoint& p : s.points) {
                if (!shown(p)) continue;
                any = true;
                spread |= p.xHigh > p.xLow;
                labels |= !p.label.empty();
                out << number(p.x) << ' ' << number(std::clamp(p.y, y.first, y.second)) << ' '
                    << number(p.xHigh > p.xLow ? std::max(p.xLow, x.first) : p.x) << ' '
                    << number(p.xHigh > p.xLow ? std::min(p.xHigh, x.second) : p.x) << ' ' << quoted(p.label)
                    << '\n';
            }
            out << "EOD\n";
            if (!any) continue;
            const std::string color = std::string(" lc rgb '") + colors[look % colorCount] + "'";
            if (s.kind == PlotSeries::Kind::Frontier)
                plots << (plots.tellp() > 0 ? ", " : "") << name
                      << " using 1:2 notitle with steps lw 7 lc rgb '#e3ddc8', " << name
                      << " using 1:2 notitle with points pt 7 ps 2.2 lc rgb '#e3ddc8'";
            else
                plots << (plots.tellp() > 0 ? ", " : "") << name << " using 1:2 notitle "
                      << styleOf(s.kind, look, s.markSize);
            if (spread) plots << ", " << name << " using 1:2:3:4 notitle with xerrorbars pt 0 lw 1" << color;
            if (labels)
                plots << ", " << name
                      << " using 1:2:5 notitle with labels font ',8' offset .6,.55 left tc rgb '"
                      << colors[look % colorCount] << "'";
        }
    // A plot of nothing still draws the axes.
    out << "plot " << (plots.tellp() > 0 ? plots.str() : std::string("NaN notitle")) << "\n";
    if (!panel.xTicks.empty()) out << "set xtics autofreq\n";
}

// Of a page, in px.
struct Layout {
    int width, height, head, legend;
    int columns, rows, legendColumns;
};

Layout layoutOf(const PlotPage& page) {
    Layout l;
    const int count = int(page.panels.size());
    l.columns = std::max(1, std::min(page.columns, count));
    l.rows = std::max(1, (count + l.columns - 1) / l.columns);
    size_t longest = 0;
    std::vector<std::string> names;
    for (const PlotPanel& panel : page.panels)
        for (const PlotSeries& s : panel.series)
            if (std::find(names.begin(), names.end(), s.name) == names.end()) {
                names.push_back(s.name);
                longest = std::max(longest, s.name.size());
            }
    l.width = l.columns == 1 ? 640 : 440 * l.columns;
    l.legendColumns = std::clamp(l.width / (70 + 7 * int(longest)), 1, std::max(1, int(names.size())));
    const int legendRows = (int(names.size()) + l.legendColumns - 1) / l.legendColumns;
    l.legend = 19 * legendRows + 16;
    l.head = 48;
    l.height = (l.columns == 1 ? 420 : 320) * l.rows + l.legend + l.head;
    return l;
}

std::string scriptOf(const PlotPage& page, const std::string& terminal, const std::string& output,
                     const Layout& l) {
    const double legendShare = double(l.legend) / l.height, headShare = double(l.head) / l.height;
    const int height = l.height, columns = l.columns, rows = l.rows;
    std::ostringstream out;
    out << "set encoding utf8\nset terminal " << terminal << "\nset output " << quoted(output) << "\n"
        << "set multiplot\nunset key\nset border 3 lc rgb '#888888'\n"
        << "set tics nomirror textcolor rgb '#333333' font ',9'\nset xtics nomirror format '%g'\nset ytics "
           "nomirror format "
           "'%g'\n"
        << "set grid xtics ytics lw .6 lc rgb '#e8e8e8'\nset errorbars small\n"
        << "set lmargin 8.5\nset rmargin 1.5\nset tmargin 1.8\nset bmargin 3.2\n";
    const double titleAt = 1 - 15. / height, noteAt = 1 - 36. / height;
    out << "set label 1000 " << quoted(page.title) << " at screen .5,screen " << titleAt
        << " center font ',15'\nset label 1001 " << quoted(page.note) << " at screen .5,screen " << noteAt
        << " center font ',10' tc rgb '#666666'\n";
    // Labels belong to the first plot drawn; each panel clears them.
    out << "set origin 0,0\nset size 1,1\nunset border\nunset tics\nset xrange [0:1]\nset yrange [0:1]\n"
        << "plot NaN notitle\nunset label 1000\nunset label 1001\nset border 3 lc rgb '#888888'\n"
        << "set tics nomirror textcolor rgb '#333333' font ',9'\nset xtics nomirror format '%g'\nset ytics "
           "nomirror format "
           "'%g'\n";
    Legend legend;
    const double body = 1 - legendShare - headShare;
    for (size_t k = 0; k < page.panels.size(); k++) {
        const int column = int(k) % columns, row = int(k) / columns;
        out << "set origin " << double(column) / columns << ','
            << legendShare + body * (rows - 1 - row) / rows << "\nset size " << 1. / columns << ','
            << body / rows << "\n";
        writePanel(out, page.panels[k], legend, int(k));
    }
    out << "set origin 0,0\nset size 1," << legendShare
        << "\nunset border\nunset tics\nunset title\nunset xlabel\nunset ylabel\nunset label\nunset "
           "arrow\nunset grid\n"
        << "unset logscale\nset lmargin 0\nset rmargin 0\nset tmargin 0\nset bmargin 0\n"
        << "set xrange [0:1]\nset yrange [0:1]\nset key at screen .5,screen " << legendShare * .5
        << " center center horizontal maxcols " << l.legendColumns << " samplen 2.2 font ',10'\nplot ";
    for (size_t k = 0; k < legend.entries.size(); k++)
        out << (k ? ", " : "") << "NaN title " << quoted(legend.entries[k].first) << ' '
            << styleOf(legend.entries[k].second, legend.lookOf(k));
    out << (legend.entries.empty() ? "NaN notitle" : "") << "\nunset multiplot\nset output\n";
    return out.str();
}

// Not through a shell: a path may hold anything.
int runGnuplot(const std::string& script) {
    const pid_t child = fork();
    if (child < 0) return 127;
    if (child == 0) {
        // What it says is of a script that nobody wrote by hand.
        if (!std::getenv("BRUME_KEEP_PLOTS"))
            if (const int null = open("/dev/null", O_WRONLY); null >= 0) dup2(null, STDERR_FILENO);
        execlp("gnuplot", "gnuplot", script.c_str(), nullptr);
        _exit(127);
    }
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

void draw(const std::string& script, const std::string& output) {
    std::string file = (std::filesystem::temp_directory_path() / "brume-plot-XXXXXX").string();
    const int handle = mkstemp(file.data());
    if (handle < 0) failIo(file, ": cannot be written; set TMPDIR to a folder that can");
    ::close(handle);
    std::ofstream(file) << script;
    const int status = runGnuplot(file);
    if (const char* keep = std::getenv("BRUME_KEEP_PLOTS"); !keep) std::filesystem::remove(file);
    if (status == 127) failIo("gnuplot cannot be started; install the package gnuplot-nox");
    std::error_code none;
    if (status != 0 || std::filesystem::file_size(output, none) == 0 || none)
        failIo("gnuplot could not draw '", output, "' (status ", status, ")");
}

}  // namespace

void writePlots(const PlotPage& page, const std::string& path) {
    const Layout l = layoutOf(page);
    const std::string size = text(l.width, ",", l.height), twice = text(2 * l.width, ",", 2 * l.height);
    const std::string font = "noenhanced font 'DejaVu Sans,11' rounded";
    draw(scriptOf(page, "svg size " + size + " dynamic background rgb 'white' " + font, path + ".svg", l),
         path + ".svg");
    // Twice the pixels: sharp on any screen.
    draw(scriptOf(page, "pngcairo size " + twice + " fontscale 2 linewidth 2 pointscale 2 " + font,
                  path + ".png", l),
         path + ".png");
}

void writeMap(const cv::Mat& values, double least, double most, const std::string& title,
              const std::string& barLabel, const std::string& path, int width) {
    std::ostringstream out;
    const int height = int(double(width - 110) * values.rows / std::max(1, values.cols)) + 50;
    out << "set encoding utf8\nset terminal pngcairo size " << width << ',' << height
        << " noenhanced font 'DejaVu Sans,10'\nset output " << quoted(path) << "\nset title " << quoted(title)
        << " offset 0,-.5\nunset key\nunset tics\nset border lc rgb '#888888'\nset lmargin at screen "
        << 10. / width << "\nset rmargin at screen " << 1 - 100. / width << "\nset tmargin at screen "
        << 1 - 32. / height << "\nset bmargin at screen "
        << 18. / height
        // Black over blue and orange to white, lightness rising all the way.
        << "\nset palette defined (0 '#0b0b1e', 1 '#2a2a72', 2 '#4f6fb0', 3 '#9a86a8', 4 '#e08a4a', 5 "
           "'#f8c25c', 6 '#fffbe0')\n"
        << "set logscale cb\nset cbrange [" << number(least) << ':' << number(most)
        << "]\nset format cb '%g'\n"
        << "set cblabel " << quoted(barLabel) << " offset 1,0\nset cbtics font ',9'\n"
        << "set object rectangle from graph 0,0 to graph 1,1 behind fc rgb '#999999' fs solid\n"
        << "set xrange [-.5:" << values.cols - .5 << "]\nset yrange [" << values.rows - .5
        << ":-.5]\n$d << EOD\n";
    for (int j = 0; j < values.rows; j++) {
        for (int i = 0; i < values.cols; i++) {
            const double v = values.at<double>(j, i);
            out << (std::isnan(v) ? "NaN" : number(std::clamp(v, least, most))) << ' ';
        }
        out << '\n';
    }
    out << "EOD\nplot $d matrix with image\n";
    draw(out.str(), path);
}

std::vector<size_t> paretoFrontier(const std::vector<std::pair<double, double>>& points) {
    std::vector<size_t> order;
    for (size_t k = 0; k < points.size(); k++)
        if (std::isfinite(points[k].first) && std::isfinite(points[k].second)) order.push_back(k);
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return points[a] < points[b]; });
    std::vector<size_t> frontier;
    for (size_t k : order)
        if (frontier.empty() || points[k].second < points[frontier.back()].second) frontier.push_back(k);
    return frontier;
}

bool hasGnuplot() {
    const char* path = std::getenv("PATH");
    std::istringstream folders(path ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');)
        if (access((folder + "/gnuplot").c_str(), X_OK) == 0) return true;
    return false;
}

}  // namespace brume
