// What the modes of `brume chart` share: the command's arguments. Each mode is a file of its own.
#pragma once

#include <string>
#include <vector>

#include "options.hpp"

namespace brume::host {

struct ChartArguments {
    std::vector<std::string> effects;  ///< as given; empty: all
    std::string output;                ///< a folder, made before a mode is called
    std::vector<std::string> frames;   ///< files; empty: made-up ones
    std::string size;                  ///< of the made-up ones
    FrameOptions frameOptions;
    std::vector<std::string> backends;
    int repetitions = 15, pixels = 14400;
    double seconds = 1;
    bool stability = false;
    bool papers = false;
};

/// The effects asked for, all that load if none is named. Throws Error (Usage) with the nearest name.
std::vector<std::shared_ptr<const Effect>> effectsOf(const ChartArguments& a);
/// The captured frames named, or one made up; depth without NaN. Throws Error (Usage, Io).
std::vector<FramePair> framesOf(const ChartArguments& a);
/// One runner for each of the backends asked for.
std::vector<std::unique_ptr<Runner>> runnersOf(const ChartArguments& a);

void chartStability(const ChartArguments& a);
void chartEffects(const ChartArguments& a);
void chartPapers(const ChartArguments& a);

}  // namespace brume::host
