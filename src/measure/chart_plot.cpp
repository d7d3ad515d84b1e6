#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "error.hpp"
#include "measure/chart_page.hpp"
#include "measure/number_text.hpp"

namespace brume {
namespace {

constexpr double leastShown = 1e-5;  // steps: about fp32's rounding

PlotPoint pointOf(const ChartRow& row) {
    return {row.milliseconds, std::max(row.error.worst, leastShown), row.low, row.high, ""};
}

// What the numbers at a line's ends are stands behind its name.
std::string seriesName(const ChartRow& row) {
    std::string knob = row.knob;
    std::replace(knob.begin(), knob.end(), '_', ' ');
    return knob.empty() ? row.method : text(row.method, " (", knob, ")");
}

PlotPanel panelOf(const std::vector<ChartRow>& rows, const std::string& caseName, const std::string& backend,
                  const std::string& title) {
    PlotPanel panel;
    panel.title = title;
    panel.xLabel = "ms a frame";
    panel.yLabel = "worst error, 8-bit steps";
    PlotSeries frontier{"no method is both faster and better", PlotSeries::Kind::Frontier, {}};
    std::vector<PlotSeries> methods, peers;
    double copy = 0;
    for (const ChartRow& row : rows) {
        const bool isHere =
            row.caseName == caseName && (row.backend == backend || (row.isPeer() && backend == "cpu"));
        if (!isHere || !row.problem.empty() || !row.hasError) continue;
        if (row.onFrontier) frontier.points.push_back(pointOf(row));
        auto& all = row.isPeer() ? peers : methods;
        auto found = std::find_if(all.begin(), all.end(), [&](auto& s) { return s.name == seriesName(row); });
        if (found == all.end())
            found = all.insert(
                all.end(),
                {seriesName(row), row.isPeer() ? PlotSeries::Kind::Points : PlotSeries::Kind::Line, {}});
        found->points.push_back(pointOf(row));
        // The knob at both ends says which way the line runs.
        if (!row.knob.empty()) found->points.back().label = row.value;
        if (row.copy > 0 && !row.isPeer()) copy = copy > 0 ? std::min(copy, row.copy) : row.copy;
    }
    for (PlotSeries& s : methods)
        for (size_t k = 1; k + 1 < s.points.size(); k++) s.points[k].label.clear();
    std::sort(frontier.points.begin(), frontier.points.end(), [](auto& a, auto& b) { return a.x < b.x; });
    if (!frontier.points.empty()) panel.series.push_back(frontier);
    for (auto* group : {&methods, &peers})
        panel.series.insert(panel.series.end(), group->begin(), group->end());
    if (copy > 0) panel.marks.push_back({true, copy, "copying the frame", ""});
    panel.marks.push_back({false, visibleError, "half an 8-bit step", ""});
    return panel;
}

std::pair<double, double> rangeOf(const std::vector<const PlotPanel*>& panels, bool ofX) {
    double least = HUGE_VAL, most = 0;
    for (const PlotPanel* panel : panels) {
        for (const PlotSeries& s : panel->series)
            for (const PlotPoint& p : s.points) {
                least = std::min(least, ofX ? p.x : p.y);
                most = std::max(most, ofX ? p.x : p.y);
            }
        for (const PlotMark& m : panel->marks)
            if (m.isVertical == ofX) least = std::min(least, m.at), most = std::max(most, m.at);
    }
    // Whole decades upwards leave room for the words.
    if (!(least <= most)) return {.1, 10};
    if (ofX) return {least / 1.5, most * 2};
    return {std::pow(10, std::floor(std::log10(least))), std::pow(10, std::ceil(std::log10(most) + .1))};
}

}  // namespace

std::string deviceWord(const ChartRow& row) {
    if (row.backend != "gl") return "CPU";
    // "OSMesa: Mesa/X.org, llvmpipe (LLVM 15.0.6, 256 bits), 4.5 ...": the renderer.
    std::string renderer = row.device.substr(std::min(row.device.size(), row.device.find(", ") + 2));
    renderer = renderer.substr(0, std::min(renderer.find(" ("), renderer.find_first_of(",/")));
    return "OpenGL, " + renderer;
}

std::vector<std::string> casesOf(const std::vector<ChartRow>& rows) {
    std::vector<std::string> names;
    for (const ChartRow& row : rows)
        if (std::find(names.begin(), names.end(), row.caseName) == names.end()) names.push_back(row.caseName);
    return names;
}

std::string shortNumber(double value) {
    if (value == 0 || !std::isfinite(value)) return text(value);
    char buffer[40];
    const int digits = std::max(0, 2 - int(std::floor(std::log10(std::abs(value)))));
    if (std::abs(value) < 1e-3)
        std::snprintf(buffer, sizeof buffer, "%.1e", value);
    else
        std::snprintf(buffer, sizeof buffer, "%.*f", std::min(digits, 4), value);
    return shortExponent(buffer);
}

const ChartRow* fastestUnseen(const std::vector<ChartRow>& rows, const std::string& caseName,
                              const std::string& backend) {
    const ChartRow* best = nullptr;
    for (const ChartRow& row : rows)
        if (row.caseName == caseName && row.backend == backend && row.problem.empty() && row.hasError &&
            row.error.worst <= visibleError && (!best || row.milliseconds < best->milliseconds))
            best = &row;
    return best;
}

// Where each case has one method, cases stand side by side: an effect of several models.
static std::vector<ChartRow> merged(std::vector<ChartRow> rows) {
    std::map<std::pair<std::string, std::string>, int> counts;
    for (const ChartRow& row : rows)
        if (!row.isPeer()) counts[{row.caseName, row.backend}]++;
    const bool isMerged = std::all_of(counts.begin(), counts.end(), [](auto& c) { return c.second == 1; });
    if (!isMerged || casesOf(rows).size() < 2) return rows;
    for (ChartRow& row : rows) {
        row.method = row.isPeer() ? row.method + ", " + row.caseName : row.caseName;
        row.caseName.clear();
        row.onFrontier = false;  // of its own case only
    }
    return rows;
}

PlotPage chartPlot(const std::vector<ChartRow>& measured) {
    PlotPage page;
    if (measured.empty()) return page;
    const std::vector<ChartRow> rows = merged(measured);
    page.title = rows[0].effect;
    std::map<std::string, std::string> devices;
    for (const ChartRow& row : rows)
        if (!row.isPeer()) devices[row.backend] = deviceWord(row);
    page.note = text(rows[0].frame, ", ", rows[0].size.width, "×", rows[0].size.height,
                     "; left is faster; below the dashed line nobody sees a difference");
    const auto cases = casesOf(rows);
    page.columns = devices.size() == 1 && cases.size() > 1 ? 2 : int(devices.size());
    for (const std::string& name : cases)
        for (const auto& [backend, device] : devices)
            page.panels.push_back(
                panelOf(rows, name, backend, name.empty() ? device : name + " · " + device));
    std::vector<const PlotPanel*> all;
    for (const PlotPanel& panel : page.panels) all.push_back(&panel);
    const auto yRange = rangeOf(all, false);
    for (size_t column = 0; column < devices.size(); column++) {
        std::vector<const PlotPanel*> below;
        for (size_t k = column; k < all.size(); k += devices.size()) below.push_back(all[k]);
        const auto xRange = rangeOf(below, true);
        for (size_t k = column; k < all.size(); k += devices.size()) {
            page.panels[k].yRange = yRange;
            page.panels[k].xRange = xRange;
        }
    }
    return page;
}

}  // namespace brume
