#include "measure/stability_plot.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "error.hpp"

namespace brume {
namespace {

constexpr double leastError = 1e-4, mostError = 255, tolerance = .5;

// Two digits are all that an interpolated place is worth.
std::string roundedText(double x) { return stressText(std::stod(cv::format("%.2g", x))); }

std::string withUnit(const Regime& regime, double stress) {
    return stressText(stress) + (regime.unit.empty() ? "" : " " + regime.unit);
}

const char* wordOf(Backend backend) { return backend == Backend::Cpu ? "CPU" : "GLSL"; }

// Where a stress value stands on a panel's axis.
struct Axis {
    std::vector<double> values;  ///< those not refused
    bool isLog;

    explicit Axis(const Regime& regime) {
        for (double value : regime.values)
            if (!regime.isRefused(value)) values.push_back(value);
        isLog = std::all_of(values.begin(), values.end(), [](double v) { return v > 0 && std::isfinite(v); });
    }
    double at(size_t k) const { return isLog ? values[k] : double(k); }
};

// Dotted lines in the methods' colours, with the stress at which they pass the tolerance.
std::vector<PlotMark> crossingMarks(const StabilitySweep& sweep, Backend backend) {
    std::vector<PlotMark> marks;
    for (const StabilityLine& line : sweep.lines)
        if (line.backend == backend)
            for (const Crossing& crossing : line.crossings())
                if (crossing.near > 0)
                    marks.push_back({true, crossing.near, roundedText(crossing.near), line.name});
    return marks;
}

PlotPanel panelOf(const StabilitySweep& sweep, Backend backend) {
    const Regime& regime = sweep.regime;
    const Axis axis(regime);
    PlotPanel panel;
    panel.title = regime.name + ", " + wordOf(backend);
    panel.xLabel = regime.stress + (regime.unit.empty() ? "" : ", " + regime.unit);
    panel.yLabel = "worst error, 8-bit steps";
    panel.logX = axis.isLog;
    panel.yRange = {leastError, mostError};
    if (axis.isLog)
        panel.marks = crossingMarks(sweep, backend);
    else
        for (size_t k = 0; k < axis.values.size(); k++)
            panel.xTicks.emplace_back(axis.at(k), stressText(axis.values[k]));
    panel.marks.push_back({false, tolerance, "half an 8-bit step", ""});
    for (const StabilityLine& line : sweep.lines) {
        if (line.backend != backend) continue;
        PlotSeries series;
        series.name = line.name;
        // Where curves coincide, each still shows: auto as a band behind all, the marks one inside the other.
        if (line.name == "auto") series.kind = PlotSeries::Kind::Band;
        series.markSize = std::max(.4, 1.25 - .2 * double(panel.series.size()));
        for (const StabilityPoint& point : line.points)
            if (!point.refused)
                series.points.push_back({axis.at(series.points.size()),
                                         std::clamp(point.error, leastError, mostError), 0, 0, ""});
        panel.series.push_back(series);
    }
    return panel;
}

std::string csvField(const std::string& s) {
    if (s.find_first_of(",\"\n") == std::string::npos) return s;
    std::string out = "\"";
    for (char c : s) out += c == '"' ? std::string("\"\"") : std::string(1, c);
    return out + '"';
}

}  // namespace

PlotPage stabilityPlot(const std::string& effect, const std::vector<StabilitySweep>& sweeps) {
    PlotPage page;
    page.title = effect + ": where methods fail";
    page.note =
        "At the lower edge: less; at the upper: more, or another class of number. Dotted: where a method "
        "passes half a step";
    for (const StabilitySweep& sweep : sweeps)
        for (Backend backend : {Backend::Cpu, Backend::Gl}) {
            const PlotPanel panel = panelOf(sweep, backend);
            if (!panel.series.empty() && panel.series[0].points.size() > 1) page.panels.push_back(panel);
        }
    return page;
}

std::string stabilityCsv(const std::vector<StabilitySweep>& sweeps) {
    std::string out = "effect,regime,stress,unit,method,backend,value,error,holds,refused,chosen,problem\r\n";
    for (const StabilitySweep& sweep : sweeps)
        for (const StabilityLine& line : sweep.lines)
            for (const StabilityPoint& point : line.points) {
                char numbers[80];
                std::snprintf(numbers, sizeof numbers, "%.9g,%.9g", point.stress,
                              point.refused ? NAN : point.error);
                const Regime& r = sweep.regime;
                out += text(csvField(r.effect), ',', csvField(r.name), ',', csvField(r.stress), ',',
                            csvField(r.unit), ',', csvField(line.name), ',',
                            line.backend == Backend::Cpu ? "cpu" : "gl", ',', numbers, ',',
                            point.holds() ? "yes" : "no", ',', point.refused ? "yes" : "no", ',',
                            csvField(point.chosen), ',', csvField(point.problem), "\r\n");
            }
    return out;
}

std::vector<std::string> crossingSentences(const StabilitySweep& sweep) {
    std::vector<std::string> sentences;
    for (const StabilityLine& line : sweep.lines)
        for (const Crossing& c : line.crossings()) {
            const StabilityPoint &a = line.points[c.after], &b = line.points[c.after + 1];
            sentences.push_back(text(line.name, " (", wordOf(line.backend),
                                     "): ", a.holds() ? "holds" : "fails", " at ",
                                     withUnit(sweep.regime, a.stress), ", ", b.holds() ? "holds" : "fails",
                                     " at ", withUnit(sweep.regime, b.stress),
                                     c.near > 0 ? "; half a step near " + roundedText(c.near) : ""));
        }
    return sentences;
}

}  // namespace brume
