// brume chart: speed against accuracy.
#include "chart.hpp"

#include <filesystem>

#include "commands.hpp"
#include "error.hpp"
#include "frame/resolve.hpp"
#include "measure/bench.hpp"

namespace brume::host {
namespace {

void makeFolder(const std::string& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) failIo("'", folder, "' cannot be made: ", error.message());
}

}  // namespace

std::vector<std::shared_ptr<const Effect>> effectsOf(const ChartArguments& a) {
    const EffectRegistry& registry = EffectRegistry::standard();
    std::vector<std::shared_ptr<const Effect>> effects;
    for (const std::string& name : a.effects) effects.push_back(registry.find(name));
    if (!a.effects.empty()) return effects;
    const auto refused = registry.refused();
    for (const std::string& name : registry.names())
        if (!refused.count(name)) effects.push_back(registry.find(name));
    return effects;
}

std::vector<FramePair> framesOf(const ChartArguments& a) {
    std::vector<FramePair> frames;
    for (const std::string& file : a.frames)
        frames.push_back(resolveDepth(readFrame(file, a.frameOptions.read()), {}).frame);
    if (!frames.empty()) return frames;
    frames.push_back(benchFrames(parseSize(a.size))[0]);
    frames[0].name = "a made-up frame";
    return frames;
}

std::vector<std::unique_ptr<Runner>> runnersOf(const ChartArguments& a) {
    std::vector<std::unique_ptr<Runner>> runners;
    for (const std::string& name : a.backends) runners.push_back(BackendOption{name}.makeRunner({}));
    return runners;
}

void addChart(CLI::App& program) {
    auto a = std::make_shared<ChartArguments>();
    CLI::App* command =
        program.add_subcommand("chart", "Speed against accuracy, as charts, tables and error maps");
    command->add_option("EFFECT", a->effects, "Effects' names or .fs files (default: all there are)");
    a->output = "charts";
    command->add_option("-o,--output", a->output, "Folder for what is written, made if missing")
        ->capture_default_str();
    command
        ->add_option("--frame", a->frames,
                     "A captured frame to work on (default: one made up of walls and sky)")
        ->allow_extra_args(false);
    a->frameOptions.addTo(*command);
    a->size = "1280x720";
    command->add_option("--size", a->size, "WIDTHxHEIGHT of the made-up frame")->capture_default_str();
    a->backends = {"cpu", "gl"};
    command->add_option("--backend", a->backends, "cpu, gl, osmesa, egl; several with commas")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->capture_default_str();
    command->add_option("--repetitions", a->repetitions, "Of each method's timing")
        ->capture_default_str()
        ->check(CLI::Range(3, 10000));
    command->add_option("--seconds", a->seconds, "Stop a method's timing early after this time")
        ->capture_default_str();
    addPassSeconds(*command);
    command->add_flag(
        "--papers", a->papers,
        "Instead: run the papers' experiments again, on every --frame, and put their figures beside ours");
    command
        ->add_option(
            "--pixels", a->pixels,
            "At how many the fp64 reference is asked, and for the worst one where methods differ most, too")
        ->capture_default_str()
        ->check(CLI::Range(1, 1 << 24));
    command->footer(
        "Writes EFFECT.svg, .png and .csv for each effect, maps of where the error is, and index.html, "
        "which\n"
        "holds all of it in one file, and what earlier runs left in the folder. Errors are in steps of an "
        "8-bit\n"
        "picture, after sRGB encoding; times are medians, on GL of the passes alone.\n"
        "\nExamples:\n  brume chart -o charts\n  brume chart gaussian_blur -o charts --frame street.exr "
        "--backend cpu");
    command->add_flag(
        "--stability", a->stability,
        "Instead: error against what strains a method, for each failure regime that effects declare");
    command->callback([a] {
        makeFolder(a->output);
        if (a->stability) return chartStability(*a);
        if (a->papers) return chartPapers(*a);
        chartEffects(*a);
    });
}

}  // namespace brume::host
