// brume preview: the live window. The window itself is a module, so that nothing else waits for its
// libraries.
#include <algorithm>
#include <filesystem>

#include "apply_tasks.hpp"
#include "commands.hpp"
#include "effect/preset.hpp"
#include "error.hpp"
#include "file_status.hpp"
#include "frame/sequence.hpp"
#include "modules/module.hpp"
#include "nearest_name.hpp"
#include "options.hpp"
#include "output_names.hpp"
#include "preview/options.hpp"

namespace brume::host {
namespace {

struct Arguments {
    preview::PreviewOptions options;
    std::string size;
};

// A frame's sidecar (.json) is no preset.
bool isPreset(const std::string& word) {
    const std::filesystem::path path(word);
    if (path.extension() == ".json" || path.extension() == ".fs") return true;
    if (isThere(path)) return false;
    std::vector<std::string> names = EffectRegistry::standard().names();
    for (const auto& preset : shippedPresets()) names.push_back(preset.first);
    if (std::find(names.begin(), names.end(), word) != names.end()) return true;
    if (const std::string near = nearestName(word, names); !near.empty())
        failUsage("no frame, preset or effect '", word, "' (did you mean '", near, "'?)");
    return false;
}

// The last word is the preset where it names one, or else the first, as for apply.
void takePreset(preview::PreviewOptions& o) {
    std::vector<std::string>& words = o.words.frames;
    if (words.empty()) return;
    const auto preset = isPreset(words.back()) ? words.end() - 1 : words.begin();
    if (preset == words.begin() && !isPreset(*preset)) return;
    o.preset = *preset;
    words.erase(preset);
}

void requirePictureEnding(const std::string& screenshot) {
    const std::string ending = std::filesystem::path(screenshot).extension().string();
    if (!screenshot.empty() && ending != ".png" && ending != ".jpg" && ending != ".jpeg")
        failUsage("--screenshot: '", screenshot, "' should end in .png or .jpg");
}

cv::Size parseWindowSize(const std::string& words) {
    int width = 0, height = 0;
    char rest = 0;
    if (std::sscanf(words.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 640 || height < 400 ||
        width > 16384 || height > 16384)
        failUsage("--size: '", words, "' should be WIDTHxHEIGHT, such as 1440x900, at least 640x400");
    return {width, height};
}

// The frames, what lies beside them and the preset are not written over.
void requireDistinct(const preview::PreviewOptions& o) {
    std::vector<std::string> read = {o.preset};
    for (const FrameFiles& frame : expandFrames(o.words.frames, o.words.depth)) {
        const std::vector<std::string> beside = filesBeside(frame.color);
        read.insert(read.end(), {frame.color, frame.depth});
        read.insert(read.end(), beside.begin(), beside.end());
    }
    std::erase(read, "");
    for (const std::string& output : {o.screenshot, o.state, o.trace})
        if (!output.empty()) requireNotRead(output, read);
}

}  // namespace

void addPreview(CLI::App& program) {
    auto a = std::make_shared<Arguments>();
    CLI::App* command =
        program.add_subcommand("preview", "A window that shows a preset on frames while you change it");
    auto& o = a->options;
    command->add_option(
        "FRAME", o.words.frames,
        "Frames: files, folders, patterns such as shot.####.exr, lists; and, first or last, a PRESET: "
        "a file, a shipped preset's name or an effect's name. Both can be dropped on the window later");
    command->add_option("--depth", o.words.depth, "Where depth is, as for apply");
    command->add_option("--depth-encoding", o.words.encoding, "What the depth's numbers mean, as for apply");
    command->add_option("--camera", o.words.camera, "Where the camera was, as for apply");
    command->add_option("--color", o.words.color,
                        "What the colour file holds: srgb or linear (default: by its format)");
    addMaxPixels(*command, o.maxPixels);
    command->add_option("--fps", o.words.framesPerSecond, "Frames a second of a sequence without timestamps")
        ->capture_default_str()
        ->check(numberIn(1e-6, 1e6));
    command
        ->add_option(
            "--backend", o.backend,
            "What runs the effects: gl, cpu, or auto: GLSL where a real GPU draws the window, else the CPU; "
            "G in the window changes it")
        ->capture_default_str();
    command
        ->add_option("--show", o.show,
                     "What to show first: result, before, wipe, blink, depth, difference, or an image's name")
        ->capture_default_str();
    addPassSeconds(*command);
    command->add_option("--size", a->size, "The window's size, such as 1440x900 (default: as it was last)");
    command->add_option("--screenshot", o.screenshot,
                        "Write the window to this PNG or JPEG once the picture is there, and end");
    command->add_option("--state", o.state,
                        "For tests: keep what the window shows and where, as JSON, in this file");
    command->add_option("--trace", o.trace,
                        "For measuring: a line of JSON here for each picture that reached the window");
    command->footer(
        "F1 in the window lists its keys.\n\nExamples:\n"
        "  brume preview frame.exr visibility_200\n"
        "  brume preview 'shots/*.png' my_fog.json\n"
        "  brume preview");
    command->callback([a] {
        auto& o = a->options;
        if (!a->size.empty()) o.window = parseWindowSize(a->size);
        const std::vector<std::string> backends = {"auto", "cpu", "gl"};
        if (std::find(backends.begin(), backends.end(), o.backend) == backends.end())
            failUsage("--backend: no backend '", o.backend, "'", suggestion(o.backend, backends));
        takePreset(o);
        requirePictureEnding(o.screenshot);
        if (!o.screenshot.empty() && o.words.frames.empty()) failUsage("--screenshot: name a frame to show");
        if (!o.screenshot.empty() || !o.state.empty() || !o.trace.empty()) requireDistinct(o);
        moduleFunction<preview::RunPreviewFunction>("preview", "brumeRunPreview")(o);
    });
}

}  // namespace brume::host
