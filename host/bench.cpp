// brume bench: how long effects and presets take.
#include "measure/bench.hpp"

#include <cstdio>
#include <filesystem>
#include <iostream>

#include "commands.hpp"
#include "effect/preset.hpp"
#include "error.hpp"
#include "frame/resolve.hpp"
#include "measure/stage.hpp"
#include "options.hpp"
#include "sweep.hpp"

namespace brume::host {
namespace {

struct Arguments {
    std::vector<std::string> chains, sets;
    std::string frame, size = "1920x1080";
    std::vector<std::string> backends = {"cpu", "gl"};
    FrameOptions frameOptions;
    int repetitions = 24;
    double seconds = 10;
    bool steps = false;
};

std::vector<FramePair> framesOf(const Arguments& a) {
    if (a.frame.empty()) return benchFrames(parseSize(a.size));
    FramePair frame = resolveDepth(readFrame(a.frame, a.frameOptions.read()), {}).frame;
    std::vector<FramePair> frames(8, frame);
    for (FramePair& copy : frames) {
        copy.color = frame.color.clone();
        copy.depth = frame.depth.clone();
    }
    return frames;
}

// An effect by itself gets what CHART's BEFORE makes of the frames; a preset's steps see to that themselves.
std::vector<Stage> stagesOf(const std::string& name, const Chain& chain,
                            const std::vector<FramePair>& captured) {
    std::vector<Stage> stages;
    if (chain.steps.size() != 1) return stages;
    const std::shared_ptr<const Effect>& effect = chain.steps[0].effect;
    if (std::filesystem::path(name).stem() == effect->name())
        for (const FramePair& frame : captured) stages.emplace_back(effect, frame);
    return stages;
}

bool runsOn(const Chain& chain, Backend backend) { return backend == Backend::Gl || !chain.needsGl(); }

void printLine(const std::string& name, const std::string& backend, const BenchResult& r, bool steps) {
    char line[200];
    std::snprintf(line, sizeof line, "%-36s %-7s %8.2f (%.2f to %.2f) %9.1f %8.2f %8.2f", name.c_str(),
                  backend.c_str(), r.chain.median(), r.chain.quartileLow(), r.chain.quartileHigh(),
                  r.megapixels / r.chain.median() * 1e3, r.copy.median(), r.ratio());
    std::cout << line << "\n";
    for (size_t k = 0; steps && k < r.steps.size(); k++) {
        std::snprintf(line, sizeof line, "  %-42s %8.2f", r.steps[k].name.c_str(), r.steps[k].milliseconds);
        std::cout << line << "\n";
    }
    std::cout << std::flush;
}

void bench(const Arguments& a) {
    const EffectRegistry& registry = EffectRegistry::standard();
    std::vector<std::string> names = a.chains;
    if (names.empty()) {
        auto refused = registry.refused();
        for (const std::string& name : registry.names())
            if (!refused.count(name)) names.push_back(name);
    }
    struct Line {
        std::string name;
        Chain chain;
        std::shared_ptr<const std::vector<FramePair>> frames;
    };
    const auto captured = std::make_shared<const std::vector<FramePair>>(framesOf(a));
    std::vector<Line> lines;
    for (const std::string& name : names) {
        Chain chain = readPreset(name, registry);
        std::vector<Sweep> sweeps;
        for (const std::string& set : a.sets) sweeps.push_back(parseSweep(set));
        const std::vector<Stage> stages = stagesOf(name, chain, *captured);
        auto frames = captured;
        if (!stages.empty()) {
            std::vector<FramePair> staged;
            for (const Stage& stage : stages) staged.push_back(stage.frame());
            frames = std::make_shared<const std::vector<FramePair>>(std::move(staged));
        }
        for (const Variant& variant : variantsOf(sweeps, chain)) {
            const Chain set = withSettings(chain, drawn(variant.settings, name, 0));
            lines.push_back({variant.label.empty() ? name : name + " " + variant.label,
                             stages.empty() ? set : stages[0].placed(set), frames});
        }
    }
    for (const std::string& backendName : a.backends) {
        BackendOption backend{backendName};
        auto runner = backend.makeRunner({});
        std::cout << runner->describe() << ", " << captured->at(0).color.cols << "×"
                  << captured->at(0).color.rows << "\n"
                  << "                                     backend       ms (quartiles)     megapixel/s   "
                     "copy ms  ratio\n";
        for (const auto& [name, chain, frames] : lines) {
            if (!runsOn(chain, runner->backend())) {
                std::cout << name << ": GLSL only\n";
                continue;
            }
            printLine(name, backendName, benchChain(*runner, chain, *frames, a.repetitions, a.seconds),
                      a.steps);
        }
    }
}

}  // namespace

void addBench(CLI::App& program) {
    auto a = std::make_shared<Arguments>();
    CLI::App* command =
        program.add_subcommand("bench", "How long effects and presets take, against copying the frame");
    command->add_option("EFFECT", a->chains, "Effects or presets (default: all effects at their defaults)");
    command->add_option("--set", a->sets, "effect.param=value; several values give a line each")
        ->allow_extra_args(false);
    command->add_option("--backend", a->backends, "cpu, gl, osmesa, egl; several with commas")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->capture_default_str();
    command->add_option("--size", a->size, "WIDTHxHEIGHT of the made-up frames")->capture_default_str();
    command->add_option("--frame", a->frame, "Work on this captured frame instead");
    a->frameOptions.addTo(*command);
    command->add_option("--repetitions", a->repetitions)->capture_default_str()->check(CLI::Range(3, 10000));
    command->add_option("--seconds", a->seconds, "Stop a line early after this time")->capture_default_str();
    addPassSeconds(*command);
    command->add_flag("--steps", a->steps, "Also each step (CPU) or pass (GPU timer)");
    command->footer(
        "Copy and effect take turns over the same eight frames; medians. On GL the time includes upload and "
        "read-back;\n"
        "--steps shows the passes alone. An effect that needs another before it (fog_blur some fog) is timed "
        "alone, "
        "on\nwhat its CHART's BEFORE makes of the frames.\n"
        "\nExamples:\n  brume bench depth_fog\n  brume bench gaussian_blur --set gaussian_blur.radius=2,8,32 "
        "--backend cpu");
    command->callback([a] { bench(*a); });
}

}  // namespace brume::host
