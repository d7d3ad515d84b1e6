// brume chart's main mode: every method and knob of effects, timed and compared with the reference.
#include <filesystem>
#include <iostream>

#include "chart.hpp"
#include "error.hpp"
#include "frame/resolve.hpp"
#include "measure/bench.hpp"
#include "measure/chart.hpp"
#include "measure/chart_csv.hpp"
#include "measure/chart_page.hpp"
#include "progress.hpp"

namespace brume::host {
namespace {

namespace fs = std::filesystem;

constexpr double leastMapped = 1e-3;  // steps: a map of less would be black

std::string fileWord(std::string s) {
    for (char& c : s)
        if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '-') c = '_';
    return s;
}

// Of an earlier run: the frontier may hold others now.
void removeMaps(const std::string& folder, const std::string& effect) {
    std::vector<fs::path> old;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with(effect + ".") && name.ends_with(".png") && name != effect + ".png")
            old.push_back(entry.path());
    }
    std::error_code none;
    for (const fs::path& path : old) fs::remove(path, none);
}

// Maps of what the frontier of the first backend holds: another backend's look the same.
void writeMaps(std::vector<ChartMeasurement>& measurements, const std::string& folder,
               const std::string& backend) {
    for (ChartMeasurement& m : measurements) {
        ChartRow& row = m.row;
        if (!row.onFrontier || row.backend != backend || row.error.worst < leastMapped) continue;
        const cv::Mat values = cv::Mat(m.errors, true).reshape(1, m.cells.height);
        row.map =
            fileWord(text(row.effect, ".", row.caseName, row.caseName.empty() ? "" : ".", row.label())) +
            ".png";
        writeMap(values, leastMapped, 10, text(row.caseName, row.caseName.empty() ? "" : ": ", row.label()),
                 "8-bit steps", (fs::path(folder) / row.map).string(), 480);
    }
}

}  // namespace

void chartEffects(const ChartArguments& a) {
    const auto effects = effectsOf(a);
    const auto runners = runnersOf(a);
    if (!hasGnuplot()) failIo("gnuplot cannot be started; install the package gnuplot-nox");
    if (a.frames.size() > 1) failUsage("--frame: charts are drawn of one frame; only --papers takes several");
    std::vector<Runner*> pointers;
    for (const auto& r : runners) pointers.push_back(r.get());
    const FramePair frame = framesOf(a)[0];
    size_t total = 0, failed = 0;
    for (const auto& effect : effects) total += chartCount(*effect, pointers);
    if (total == 0)
        failUsage("chart: nothing of ", effects.size() == 1 ? effects[0]->name() : "these effects",
                  " runs on ", CLI::detail::join(a.backends, ", "));
    Progress progress(total);
    for (const auto& effect : effects) {
        auto measurements = chartEffect(effect, frame, pointers, {a.repetitions, a.seconds, size_t(a.pixels)},
                                        [&](const ChartRow& row) {
                                            failed += !row.problem.empty() && !row.isPeer();
                                            progress.step(failed);
                                        });
        const std::string stem = (fs::path(a.output) / effect->name()).string();
        std::vector<ChartRow> rows;
        removeMaps(a.output, effect->name());
        if (!measurements.empty()) writeMaps(measurements, a.output, measurements[0].row.backend);
        for (const auto& m : measurements) rows.push_back(m.row);
        if (rows.empty()) {
            progress.say(
                text(effect->name(), ": nothing of it runs on ", CLI::detail::join(a.backends, ", ")));
            continue;
        }
        for (const ChartRow& row : rows)
            if (!row.problem.empty())
                progress.say(text(effect->name(), ": ", row.label(), " on ", row.backend, ": ", row.problem));
        writeCsv(rows, stem + ".csv");
        writePlots(chartPlot(rows), stem);
        writeChartPage(a.output);
    }
    std::cout << "The charts are in " << (fs::path(a.output) / "index.html").string() << "\n";
    if (failed) throw Error(ErrorKind::CheckFailed, text(failed, " of ", total, " measurements failed"));
}

}  // namespace brume::host
