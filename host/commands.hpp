// The program's subcommands: each file of host/ adds its own to the command line.
#pragma once

#include <CLI/CLI.hpp>

namespace brume::host {

// Each adds one subcommand whose callback does the work. Callbacks throw Error; main prints its sentence and
// exits with its kind.
void addApply(CLI::App& program);
void addChart(CLI::App& program);
void addCheck(CLI::App& program);
void addBench(CLI::App& program);
void addList(CLI::App& program);
void addInfo(CLI::App& program);
void addInspect(CLI::App& program);
void addPreview(CLI::App& program);
void addConvert(CLI::App& program);
void addConvertPreset(CLI::App& program);
void addNew(CLI::App& program);

}  // namespace brume::host
