// brume check --plan: do plans keep the tolerance, and is what they choose the fastest that does?
#include "check_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>

#include "commands.hpp"
#include "cpu/cpu_runner.hpp"
#include "error.hpp"
#include "file_status.hpp"
#include "frame/image_file.hpp"
#include "frame/pending_file.hpp"
#include "frame/resolve.hpp"
#include "frame/sequence.hpp"
#include "measure/bench.hpp"
#include "measure/encoded_error.hpp"
#include "measure/plan_check.hpp"
#include "options.hpp"
#include "progress.hpp"

namespace brume::host {
namespace {

constexpr int mostMebibytes = 64;  // of cases that are there already
const char* const heading =
    "effect,set,frame,size,choice,predicted,measured,worst_pixel,kept,left_out,plan_ms,chosen_ms,best_ms,"
    "ratio,best,values,why";

std::string quoted(std::string field) {
    for (size_t k = 0; (k = field.find('"', k)) != std::string::npos; k += 2) field.insert(k, 1, '"');
    return '"' + field + '"';
}

std::string lineOf(const PlanCheck& c, cv::Size size) {
    std::ostringstream line;
    line << c.effect << ',' << c.set << ',' << quoted(c.frame) << ',' << size.width << 'x' << size.height
         << ',' << quoted(c.choice) << ',' << c.predicted << ',' << c.measured << ',' << c.worst.x << ' '
         << c.worst.y << ',' << c.keptPromise() << ',' << c.leftOut << ',';
    if (c.isTimed)
        line << c.planMs << ',' << c.chosenMs << ',' << c.bestMs << ',' << c.ratio() << ',' << quoted(c.best);
    else
        line << ",,,,";
    line << ',' << quoted(c.values) << ',' << quoted(c.why);
    return line.str();
}

std::string distribution(const std::vector<double>& values) {
    if (values.empty()) return "-";
    char line[160];
    std::snprintf(line, sizeof line, "median %.3g, 90 %% %.3g, 95 %% %.3g, 99 %% %.3g, largest %.3g",
                  percentileOf(values, .5), percentileOf(values, .9), percentileOf(values, .95),
                  percentileOf(values, .99), *std::max_element(values.begin(), values.end()));
    return line;
}

// What was seen of one effect, or of all.
struct Summary {
    std::vector<double> errors, ratios, planning;  // of the tolerance; of the best time; ms
    size_t cases = 0, skipped = 0, over = 0, foretold = 0;

    void add(const PlanCheck& c) {
        cases++;
        skipped += c.isSkipped;
        errors.push_back(c.measured / unseenError);
        if (c.measured > unseenError) (c.keptPromise() ? foretold : over)++;
        if (c.isTimed) planning.push_back(c.planMs);
        if (c.isTimed && !c.isSkipped) ratios.push_back(c.ratio());
    }
    void print(const std::string& name) const {
        std::printf("%-14s %5zu cases, %zu skipped; error/tolerance: %s\n", name.c_str(), cases, skipped,
                    distribution(errors).c_str());
        if (foretold) std::printf("%-14s %5zu over the tolerance, as foretold\n", "", foretold);
        if (over) std::printf("%-14s %5zu OVER THE TOLERANCE\n", "", over);
        if (!ratios.empty()) std::printf("%-14s       time/best: %s\n", "", distribution(ratios).c_str());
        if (!planning.empty()) std::printf("%-14s    planning, ms: %s\n", "", distribution(planning).c_str());
    }
};

std::vector<FramePair> framesOf(const PlanArguments& a) {
    std::vector<FramePair> frames;
    if (a.frames.empty()) {
        frames = benchFrames({640, 360});
        frames.resize(2);
    }
    for (const FrameFiles& files : expandFrames(a.frames, a.frameOptions.depth)) {
        FramePair frame = readFrame(files, int(frames.size()), a.frameOptions.read());
        frame.name = std::filesystem::path(files.color).stem().string();
        frames.push_back(std::move(frame));
    }
    int width = 0, height = 0;
    if (std::sscanf(a.size.c_str(), "%dx%d", &width, &height) != 2 || width < 1 || height < 1)
        failUsage("--size: '", a.size, "' should be WIDTHxHEIGHT, such as 160x90");
    for (FramePair& frame : frames) {
        frame = resolveDepth(frame, {}).frame;
        // The smallest of its shape that covers the size asked for.
        const double scale =
            std::max(double(width) / frame.size().width, double(height) / frame.size().height);
        frame = resizedFrame(frame, {int(std::ceil(frame.size().width * scale - 1e-9)),
                                     int(std::ceil(frame.size().height * scale - 1e-9))});
    }
    return frames;
}

}  // namespace

void addPlanOptions(CLI::App& command, PlanArguments& a) {
    command.add_flag("--plan", a.isAsked, "Check plans instead: the error and time of what \"auto\" chooses")
        ->group("Plans");
    command
        .add_option("--frame", a.frames,
                    "Captured frames to plan for: files, folders (default: made-up ones)")
        ->allow_extra_args(false)
        ->group("Plans");
    command.add_option("--size", a.size, "Frames are brought to cover this size")
        ->capture_default_str()
        ->group("Plans");
    command.add_option("--first", a.first, "Number of the first random set")
        ->capture_default_str()
        ->group("Plans");
    command.add_option("--sets", a.count, "How many sets, the effects in turn")
        ->capture_default_str()
        ->group("Plans");
    command
        .add_flag("--timed", a.isTimed,
                  "Time each choice against every method and knob of CHART; each set on one "
                  "frame, in turn")
        ->group("Plans");
    command.add_option("--seconds", a.seconds, "Stop after this time, and say where to go on")
        ->group("Plans");
    command.add_option("--csv", a.csv, "Write the cases there, a line each, after those that it has")
        ->group("Plans");
}

void checkPlans(const PlanArguments& a, const std::vector<std::string>& names, uint32_t seed, size_t pixels) {
    std::vector<std::shared_ptr<const Effect>> effects;
    for (const std::string& name : names) {
        auto effect = EffectRegistry::standard().find(name);
        if (effect->plugin && effect->plugin->hasPlan() && effect->plugin->hasReference())
            effects.push_back(effect);
    }
    if (effects.empty()) failUsage("check --plan: none of these effects has a plan and a reference");
    const std::vector<FramePair> frames = framesOf(a);
    auto cpu = makeCpuRunner();
    std::optional<GrowingFile> csv;
    if (!a.csv.empty())
        csv.emplace(a.csv, isThere(a.csv) && !std::filesystem::is_empty(a.csv)
                               ? readText(a.csv, mostMebibytes)
                               : text(heading, "\n"));
    std::cout << cpu->describe() << "; sets " << a.first << " to " << a.first + a.count - 1 << " of seed "
              << seed << ", " << frames.size() << " frames of " << a.size << "\n";
    std::map<std::string, Summary> summaries;
    Summary all;
    size_t broken = 0;
    const auto start = std::chrono::steady_clock::now();
    const auto sets = planSets(effects, seed, a.first, a.count);
    Progress progress(sets.size());
    for (const PlanSet& set : sets) {
        const double elapsed =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        if (a.seconds > 0 && elapsed > a.seconds) {
            progress.say(text("stopped after ", int(elapsed), " s; --first ", set.number, " goes on"));
            break;
        }
        for (size_t k = 0; k < frames.size(); k++) {
            if (a.isTimed && size_t(set.number) / effects.size() % frames.size() != k) continue;
            const PlanCheck check =
                a.isTimed ? timePlan(*cpu, set, frames[k], pixels) : checkPlan(*cpu, set, frames[k], pixels);
            summaries[check.effect].add(check);
            all.add(check);
            if (csv) csv->append(text(lineOf(check, frames[k].size()), "\n"));
            if (check.keptPromise()) continue;
            broken++;
            progress.say(text(check.effect, ", set ", set.number, " on ", check.frame, ": ", check.choice,
                              ": error ", check.measured / unseenError, " of the tolerance, ",
                              check.predicted / unseenError, " predicted; ", check.values));
        }
        progress.step(broken);
    }
    for (const auto& [name, summary] : summaries) summary.print(name);
    if (summaries.size() > 1) all.print("all");
    std::fflush(stdout);
    if (broken) throw Error(ErrorKind::CheckFailed, text("plans broke their promise in ", broken, " cases"));
}

}  // namespace brume::host
