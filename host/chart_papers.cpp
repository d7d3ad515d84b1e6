// brume chart --papers: the papers' experiments on our frames.
#include <filesystem>
#include <iostream>

#include "chart.hpp"
#include "error.hpp"
#include "frame/pending_file.hpp"
#include "measure/papers.hpp"
#include "progress.hpp"

namespace brume::host {
void chartPapers(const ChartArguments& a) {
    if (!a.effects.empty()) failUsage("--papers: takes no effect; its experiments name their own");
    const auto experiments = readPapers(shippedPapers(), EffectRegistry::standard());
    const auto frames = framesOf(a);
    const auto runners = runnersOf(a);
    std::vector<Runner*> pointers;
    for (const auto& r : runners) pointers.push_back(r.get());
    size_t rows = 0, failed = 0;
    for (const auto& experiment : experiments) rows += experiment.rows.size();
    Progress progress(rows * frames.size() * runners.size());
    auto results = runPapers(experiments, frames, pointers, [&](const PaperResult& r) {
        if (!r.problem.empty()) progress.say(text(r.row, " on ", r.backend, ": ", r.problem));
        progress.step(failed += !r.problem.empty());
    });
    const std::string stem = (std::filesystem::path(a.output) / "papers").string();
    writePictures(results, a.output);
    writeWhole(stem + ".csv", toCsv(results));
    writeWhole(stem + ".html", papersPage(results, a.output));
    std::cout << "The papers' experiments are in " << stem << ".html\n";
    if (failed) throw Error(ErrorKind::CheckFailed, text(failed, " of ", results.size(), " rows failed"));
}

}  // namespace brume::host
