// brume chart --stability: error against stress, for each failure regime that effects' headers declare.
#include <filesystem>
#include <iostream>

#include "chart.hpp"
#include "error.hpp"
#include "frame/pending_file.hpp"
#include "measure/chart_page.hpp"
#include "measure/stability_plot.hpp"
#include "progress.hpp"

namespace brume::host {
namespace {

namespace fs = std::filesystem;

std::vector<Regime> regimesOfEffect(const Effect& effect) {
    if (!effect.plugin || !effect.plugin->hasReference()) return {};
    return regimesOf(effect.header, effect.plugin->hasPlan());
}

}  // namespace

void chartStability(const ChartArguments& a) {
    const auto effects = effectsOf(a);
    const auto runners = runnersOf(a);
    if (!hasGnuplot()) failIo("gnuplot cannot be started; install the package gnuplot-nox");
    std::vector<Runner*> pointers;
    for (const auto& r : runners) pointers.push_back(r.get());
    size_t total = 0;
    for (const auto& effect : effects)
        for (const Regime& regime : regimesOfEffect(*effect)) total += regime.values.size();
    if (total == 0) failUsage("no regime to sweep: the effect's header declares none under STABILITY");
    Progress progress(total);
    std::vector<std::string> wrong;
    for (const auto& effect : effects) {
        std::vector<StabilitySweep> sweeps;
        for (const Regime& regime : regimesOfEffect(*effect)) {
            sweeps.push_back(
                {regime, sweepRegime(effect, regime, pointers, [&] { progress.step(wrong.size()); })});
            for (const std::string& sentence : contradictions(regime, sweeps.back().lines))
                wrong.push_back(sentence);
        }
        if (sweeps.empty()) continue;
        const fs::path stem = fs::path(a.output) / stabilityStem(effect->name());
        writeWhole(stem.string() + ".csv", stabilityCsv(sweeps));
        writePlots(stabilityPlot(effect->name(), sweeps), stem.string());
        writeChartPage(a.output);
        for (const StabilitySweep& sweep : sweeps)
            for (const std::string& sentence : crossingSentences(sweep))
                progress.say(text(effect->name(), ", ", sweep.regime.name, ": ", sentence));
    }
    std::cout << "The charts are in " << (fs::path(a.output) / "index.html").string() << "\n";
    for (const std::string& sentence : wrong) std::cerr << sentence << "\n";
    if (!wrong.empty())
        throw Error(ErrorKind::CheckFailed,
                    text(wrong.size(), " points are not as the headers' STABILITY says"));
}

}  // namespace brume::host
