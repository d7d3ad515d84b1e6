// brume apply: frames through a preset.
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <set>

#include "apply_tasks.hpp"
#include "batch.hpp"
#include "commands.hpp"
#include "contact_sheet.hpp"
#include "effect/plan_words.hpp"
#include "effect/preset.hpp"
#include "error.hpp"
#include "file_status.hpp"
#include "folder_lock.hpp"
#include "frame/inspect.hpp"
#include "frame/sequence.hpp"
#include "frame/write.hpp"
#include "gl/gl_runner.hpp"
#include "nearest_name.hpp"
#include "printable.hpp"
#include "progress.hpp"
#include "report.hpp"
#include "shell_word.hpp"

namespace brume::host {
namespace {

namespace fs = std::filesystem;

constexpr size_t sheetFrames = 8;

struct Arguments {
    std::string preset, out, format, shard, report, like, memory;
    std::vector<std::string> frames, sets, keep;
    FrameOptions frame;
    BackendOption backend;
    uint32_t seed = 0;
    double framesPerSecond = 24;
    size_t firstIndex = 0;
    int jobs = 0;
    Settings settings;  // of what --like names
    bool withDepth = false, explain = false, dumpShader = false, resume = false, keepGoing = false,
         noSheet = false;
};

std::atomic<bool> interrupted = false;

void onSignal(int) { interrupted = true; }

void listenForSignals() {
    struct sigaction action {};
    action.sa_handler = onSignal;
    action.sa_flags = SA_RESETHAND;  // a second one ends at once
    for (int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
}

size_t parseBytes(const std::string& size) {
    char* end = nullptr;
    double number = std::strtod(size.c_str(), &end);
    const std::vector<std::pair<std::string, double>> units = {
        {"M", 1 << 20}, {"MiB", 1 << 20}, {"G", 1 << 30}, {"GiB", 1 << 30}};
    for (const auto& [unit, bytes] : units)
        if (unit == end && number > 0) return size_t(std::min(number * bytes, 1e18));
    failUsage("--memory: '", size, "' should be a number with M or G, such as 900M or 2G");
}

bool isPersistent(const Chain& chain) {
    for (const Step& step : chain.steps)
        for (const Pass& pass : step.effect->header.passes)
            if (step.enabled && pass.persistent) return true;
    return false;
}

std::string backendName(const Runner& runner) { return runner.backend() == Backend::Cpu ? "cpu" : "gl"; }

void dumpShaders(const Chain& chain) {
    for (const Step& step : chain.steps)
        for (size_t pass = 0; pass < step.effect->header.passes.size(); pass++)
            std::cout << "// " << step.id << ", pass " << pass << "\n" << shaderSource(step, pass) << "\n";
}

void explain(const Task& task, const Outcome& outcome, const Chain& chain) {
    std::cout << task.making.input << "\n";
    for (const std::string& note : outcome.notes) std::cout << "  " << note << "\n";
    for (const StepPlan& step : outcome.decisions) {
        std::cout << "  " << step.id << ": " << choiceWords(chain, step);
        if (!step.plan.why.empty()) std::cout << "; " << step.plan.why;
        std::cout << "\n";
        if (const std::string words = predictionWords(step); !words.empty())
            std::cout << "    predicted: " << words << "\n";
    }
}

// A wrong name is known before any frame is read.
void requireImages(const Chain& chain, const std::vector<Kept>& keep) {
    std::vector<std::string> known = {"transmittance", "depth", "captured"};
    for (const Step& step : chain.steps)
        if (step.output != "color") known.push_back(step.output);
    for (const Kept& kept : keep)
        if (std::find(known.begin(), known.end(), kept.image) == known.end())
            failUsage("--keep: no image '", kept.image, "'", suggestion(kept.image, known));
}

// What was stated here is the likeliest to be wrong, and wrong for every frame: the first tells.
void doubtWhatIsStated(const FrameFiles& first, const Arguments& a) {
    if ((a.frame.encoding.empty() && a.frame.camera.empty()) || !first.missing.empty()) return;
    ReadOptions options = a.frame.read();
    options.depth = first.depth;
    try {
        const Capture capture = readCapture(first.color, options);
        const auto encoding = capture.stated ? capture.stated : capture.habit;
        if (!encoding) return;
        for (const Doubt& d : findDoubts(capture, *encoding)) {
            const std::string& stated = d.name == "camera" ? a.frame.camera : a.frame.encoding;
            if (stated.empty()) continue;
            std::cerr << printable(text("note: the ", d.name == "camera" ? "camera" : "depth", " of '",
                                        first.color, "' looks wrong as ", stated, ": ",
                                        d.name == "camera" ? "" : d.name + ": ", d.evidence))
                      << "\n";
        }
    } catch (const Error&) {  // the run itself will say it
    }
}

// Paired by time, a frame that no depth lies near has no place in the run; twelve frames would be ten without
// a word.
void tellLeftOut(const std::vector<FrameFiles>& inputs, const Arguments& a) {
    if (a.frame.depth.empty()) return;
    const std::vector<FrameFiles> all = expandFrames(a.frames);
    const auto isLeftOut = [&](const FrameFiles& f) {
        return std::none_of(inputs.begin(), inputs.end(),
                            [&](const FrameFiles& in) { return in.color == f.color; });
    };
    const auto first =
        all.size() > inputs.size() ? std::find_if(all.begin(), all.end(), isLeftOut) : all.end();
    if (first != all.end())
        std::cerr << printable(text("note: ", all.size() - inputs.size(), " of ", all.size(),
                                    " frames are left out, '", first->color,
                                    "' the first: no depth lies within .02 s of them"))
                  << "\n";
}

// What is set in vain is seldom noticed: the picture looks as it did.
void tellIdle(Chain chain, const std::vector<Variant>& variants, uint32_t seed) {
    for (Step& step : chain.steps) step.given.clear();
    std::map<std::string, std::string> idle;  // by path: why
    std::set<std::string> used;
    for (const Variant& variant : variants)
        for (Step& step : withSettings(chain, drawn(variant.settings, "", seed)).steps) {
            for (const auto& [path, value] : variant.settings)
                for (auto& [name, set] : step.values)  // what a frame draws may be anything, as "auto" may
                    set.automatic |= path == step.id + "." + name && isDrawn(path, value);
            for (const Parameter& p : step.effect->header.parameters) {
                const std::string path = step.id + "." + p.name;
                if (!step.given.count(p.name)) continue;
                if (!step.enabled)
                    idle[path] = text("the preset has '", step.id, "' switched off (\"enabled\": false)");
                else if (isUsed(step.effect->header, p, step.values))
                    used.insert(path);
                else
                    idle[path] = text("only when ", conditionWords(step.effect->header, p, &Parameter::name));
            }
        }
    for (const auto& [path, why] : idle)
        if (!used.count(path))
            std::cerr << printable(text("note: ", path, " changes nothing here: ", why)) << "\n";
}

void runTasks(const Arguments& a, Batch& batch, size_t frames, const std::string& sheetPath) {
    Report report(batch.chain, a.seed, backendName(*batch.runner));
    Progress progress(batch.tasks.size());
    std::vector<Thumbnail> thumbnails;
    std::string firstError, sheetError;
    ErrorKind firstKind = ErrorKind::Io;
    bool isLong = frames > sheetFrames, saidCamera = false;
    if (isLong && !a.noSheet) batch.thumbnails = sheetFrames;
    listenForSignals();
    runBatch(batch, interrupted, [&](const Task& task, const Outcome& outcome) {
        report.add(task, outcome);
        if (outcome.state == Outcome::State::Failed) {
            if (firstError.empty()) firstError = outcome.error, firstKind = ErrorKind(outcome.status);
            if (a.keepGoing) progress.say("brume: " + outcome.error);
        } else if (!isLong && outcome.state == Outcome::State::Made) {
            for (const std::string& file : outcome.files) std::cout << file << "\n";
        }
        if (!outcome.cameraIsStated && !saidCamera && task.making.frame.depth != noDepth) {
            saidCamera = true;
            progress.say(text("note: '", task.making.input,
                              "' does not state its camera: taken as 60° wide, level, 1.6 m up; --camera "
                              "'horizontal_view_degrees=60,height=1.6' or a sidecar says what it was"));
        }
        if (!outcome.hardlyShows.empty())
            progress.say(text("note: '", task.output, "' looks much like its input: ", outcome.hardlyShows,
                              a.like.empty() ? text("; brume preview ", shellWord(a.preset), " ",
                                                    shellWord(task.making.input), " shows what others do")
                                             : ""));
        if (a.explain && outcome.state == Outcome::State::Made) explain(task, outcome, batch.chain);
        if (!outcome.thumbnail.empty() && thumbnails.size() < sheetFrames) {
            thumbnails.push_back({outcome.thumbnail, fs::path(task.output).filename().string()});
            if (thumbnails.size() == sheetFrames) {
                try {
                    writeImage(sheetPath, contactSheet(thumbnails, 4));
                    progress.say("the first frames: " + sheetPath);
                } catch (const Error& error) {  // the frames, and the report of them, count for more
                    sheetError = error.what();
                }
            }
        }
        progress.step(report.failed());
        return outcome.state != Outcome::State::Failed || a.keepGoing;
    });
    if (!a.report.empty()) report.write(a.report);
    size_t finished = report.made() + report.upToDate() + report.failed();
    if (isLong || report.upToDate() > 0) std::cout << report.summary() << "\n";
    if (interrupted)
        failIo("interrupted after ", finished, " of ", batch.tasks.size(),
               " outputs; the same command with --resume continues");
    if (firstError.empty() && !sheetError.empty()) failIo(sheetError);
    if (firstError.empty()) return;
    if (a.keepGoing && batch.tasks.size() > 1)
        failIo(report.failed(), " of ", batch.tasks.size(), " outputs failed, as said above");
    if (finished < batch.tasks.size())
        firstError += text("; stopped with ", report.made() + report.upToDate(), " of ", batch.tasks.size(),
                           " outputs there; --keep-going would try the others");
    throw Error(firstKind, firstError);
}

void apply(Arguments a) {
    a.backend.validate();
    Chain chain;
    if (!a.like.empty()) {
        auto record = readRecord(a.like);
        if (!record)
            failIo(
                "--like: '", a.like,
                "' does not say how it was made: only a picture that brume apply wrote does, as EXR or PNG");
        Making making = makingOf(*record, a.like);
        if (!a.preset.empty()) a.frames.insert(a.frames.begin(), a.preset);
        if (a.frames.empty()) a.frames = {making.input};
        bool isSame = a.frames.size() == 1 && a.frames[0] == making.input;
        chain = parsePreset(*making.preset, a.like, EffectRegistry::standard());
        a.frame = making.frame;
        a.seed = making.seed;
        a.framesPerSecond = making.framesPerSecond;
        a.backend.name = making.backend;
        a.withDepth = making.withDepth;
        a.settings = making.settings;
        if (isSame) a.firstIndex = making.index;
    } else {
        if (a.preset.empty()) failUsage("apply: give a PRESET (or an effect's name) and at least one FRAME");
        const std::string ending = fs::path(a.preset).extension().string();
        if (!ending.empty() && ending != ".json" && ending != ".fs" && isFile(a.preset))
            failUsage("apply: '", a.preset,
                      "' is no preset (.json) and no effect (.fs); the preset comes first, then the frames");
        chain = readPreset(a.preset, EffectRegistry::standard());
    }
    std::vector<Sweep> sweeps;
    for (const std::string& set : a.sets) sweeps.push_back(parseSweep(set));
    std::vector<Variant> variants = variantsOf(sweeps, chain);
    if (a.dumpShader) return dumpShaders(withSettings(chain, drawn(variants[0].settings, "", a.seed)));
    if (a.frames.empty()) failUsage("apply: give at least one FRAME");
    if (a.out.empty()) failUsage("apply: say where to write, with -o");
    tellIdle(chain, variants, a.seed);
    a.frame.read();  // wrong options before anything else

    Batch batch;
    batch.chain = chain;
    for (const std::string& image : a.keep) batch.keep.push_back(parseKept(image));
    requireImages(chain, batch.keep);
    batch.backend = a.backend;
    batch.jobs = a.jobs;
    batch.memory = a.memory.empty() ? 0 : parseBytes(a.memory);
    batch.resume = a.resume;
    if (isPersistent(chain) && (a.resume || !a.shard.empty()))
        failUsage("apply: ", chain.name,
                  " carries pictures from frame to frame; --resume and --shard would tear them apart");

    std::vector<FrameFiles> inputs = expandFrames(a.frames, a.frame.depth);
    for (const FrameFiles& input : inputs)
        if (!input.missing.empty() && !a.keepGoing)
            failIo(input.missing, "; --keep-going makes the other frames");
    tellLeftOut(inputs, a);
    OutputNames names(a.out, a.format, inputs.size());
    const Shard shard = parseShard(a.shard);
    batch.runner = a.backend.makeRunner(chain);
    std::string backend = a.backend.name;
    if (backend == "auto") backend = backendName(*batch.runner);
    Making common;
    common.frame = a.frame;
    common.index = a.firstIndex;
    common.framesPerSecond = a.framesPerSecond;
    common.seed = a.seed;
    common.backend = backend;
    common.withDepth = a.withDepth;
    common.settings = a.settings;
    batch.tasks = tasksOf(chain, common, inputs, variants, names);
    requireDistinct(batch.tasks, inputs, batch.keep, a.report);
    std::erase_if(batch.tasks, [&](const Task& task) { return task.frame % shard.parts != shard.part - 1; });
    std::unique_ptr<FolderLock> lock;
    if (inputs.size() > 1) lock = std::make_unique<FolderLock>(names.folder(), !a.shard.empty());
    std::string sheet = "contact_sheet.png";
    if (!a.shard.empty()) sheet = text("contact_sheet_", shard.part, "of", shard.parts, ".png");
    if (a.format.empty() && names.isFolder() && !batch.tasks.empty() &&
        fs::path(batch.tasks[0].output).extension() == ".exr")
        std::cerr << "note: EXR frames make EXR pictures; --format png makes PNG\n";
    doubtWhatIsStated(inputs[0], a);
    runTasks(a, batch, inputs.size(), (fs::path(names.folder()) / sheet).string());
}

}  // namespace

void addApply(CLI::App& program) {
    auto a = std::make_shared<Arguments>();
    CLI::App* command = program.add_subcommand("apply", "Apply a preset to captured frames");
    command->add_option("PRESET", a->preset, "A preset file, a shipped preset's name, or an effect's name");
    command->add_option("FRAME", a->frames,
                        "Colour images: files, folders, globs, sequences (in.####.exr, in.%04d.exr), or a "
                        "list (.txt: lines of "
                        "'color', 'color depth', 'time color' or 'time color time depth')");
    command->add_option(
        "-o,--out,--output", a->out,
        "A file; a folder; or a name with {stem}, {index} or {index:4}, {param} (all swept values), or a "
        "swept parameter's name");
    command
        ->add_option(
            "--set", a->sets,
            "effect.param=value. Several values with commas give one output each; several --set give all "
            "combinations; random(LOW,HIGH), random(LOW,HIGH,log) and choice(A,B,...) draw anew for each "
            "frame")
        ->allow_extra_args(false);
    command
        ->add_option(
            "--keep", a->keep,
            "Also write this image beside: transmittance, depth, or one that the preset names; with an "
            "ending for another format than EXR: depth.npy, transmittance.png")
        ->allow_extra_args(false);
    command->add_flag("--with-depth", a->withDepth,
                      "EXR outputs hold depth and camera besides the picture: frames that apply reads again");
    command->add_option("--format", a->format,
                        "The format of files in the folder OUT: exr, png, jpg, tif, npy (default: exr for "
                        "EXR frames, else png)");
    a->backend.addTo(*command);
    a->frame.addTo(*command);
    command->add_flag("--explain", a->explain,
                      "Print what was understood of each frame and decided for each effect");
    command->add_flag("--dump-shader", a->dumpShader, "Print the GLSL that the compiler gets, and stop");
    command->add_option("--seed", a->seed, "Of dither, noise and draws")->capture_default_str();
    command
        ->add_option("--fps", a->framesPerSecond, "Frames a second, where the capture does not say its time")
        ->capture_default_str()
        ->check(numberIn(1e-6, 1e6));
    command->add_option("--jobs", a->jobs, "Frames worked on at once (default: one a processor)")
        ->check(CLI::Range(1, 1024));
    command->add_option("--memory", a->memory,
                        "Bound on the frames held at once, such as 2G (default: a quarter of all)");
    command->add_flag(
        "--resume", a->resume,
        "Leave outputs that exist, after checking that they came from the same input, preset, effects and "
        "version");
    command->add_flag("--keep-going", a->keepGoing, "Report frames that fail and go on with the others");
    command->add_option("--report", a->report, "Write what was done to this JSON file");
    command->add_option("--like", a->like,
                        "Repeat how this output was made, on its own input or on FRAME...");
    command->add_option("--shard", a->shard, "PART/PARTS: do only every PARTS-th frame, from the PART-th on");
    command->add_flag("--no-sheet", a->noSheet, "No contact sheet of the first frames of a long run");
    command->footer(
        "Examples:\n"
        "  brume apply depth_fog street.exr -o foggy.png --set depth_fog.visibility=120\n"
        "  brume apply visibility_100 street.png -o out/ --set depth_fog.visibility=100,200,400 --keep "
        "transmittance\n"
        "  brume apply fog.json captures/ -o 'out/{stem}_{visibility}.exr' --set "
        "'depth_fog.visibility=random(50,400)'\n"
        "  brume apply fog.json 'in.####.exr' -o out/ --resume --keep-going --report run.json\n"
        "\nA frame is one EXR with RGB and Z, or a picture with depth beside it (NAME.depth.EXT or --depth). "
        "Every\n"
        "output is written whole or not at all, and the same command gives the same bytes.");
    command->callback([a] { apply(*a); });
}

}  // namespace brume::host
