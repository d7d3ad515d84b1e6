// The command line that makes what the window shows.
#include <filesystem>
#include <nlohmann/json.hpp>

#include "error.hpp"
#include "preview/session.hpp"
#include "shell_word.hpp"

namespace brume::preview {

namespace {

using host::shellWord;

// As parseArgument takes it: lists of numbers in brackets, labels bare.
std::string argumentOf(const Parameter& parameter, const ParameterValue& value) {
    const nlohmann::json json = toJson(parameter, value);
    if (json.is_string()) return json.get<std::string>();
    std::string dumped = json.dump();
    if (json.is_array()) dumped = "(" + dumped.substr(1, dumped.size() - 2) + ")";
    return dumped;
}

[[noreturn]] void needsSaving(const std::string& why) {
    failUsage("Save the preset first: ", why, ", which no --set can say");
}

std::string settingsBetween(const Chain& saved, const Chain& now) {
    const DepthPolicy &p = saved.policy, &q = now.policy;
    if (p.sky != q.sky || p.skyDistance != q.skyDistance || p.unknown != q.unknown || p.smooth != q.smooth)
        needsSaving("sky or unknown depth is treated otherwise");
    if (saved.steps.size() != now.steps.size()) needsSaving("effects were added or removed");
    std::string settings;
    for (size_t k = 0; k < now.steps.size(); k++) {
        const Step &a = saved.steps[k], &b = now.steps[k];
        if (a.id != b.id || a.effect->header.path != b.effect->header.path)
            needsSaving("the effects have another order");
        if (a.enabled != b.enabled || a.input != b.input || a.output != b.output)
            needsSaving(b.id + " was switched on or off, or reads or writes another image");
        for (const Parameter& parameter : b.effect->header.parameters) {
            const ParameterValue& value = b.values.at(parameter.name);
            const bool isGiven = b.given.count(parameter.name), wasGiven = a.given.count(parameter.name);
            if (value == a.values.at(parameter.name) && isGiven == wasGiven) continue;
            if (!isGiven && wasGiven && !parameter.sidecar.empty())
                needsSaving(parameter.name + " of " + b.id + " comes from the capture again");
            if (parameter.type == ParameterType::List)
                needsSaving("the list " + parameter.name + " of " + b.id + " has changed");
            settings +=
                " --set " + shellWord(b.id + "." + parameter.name + "=" + argumentOf(parameter, value));
        }
    }
    return settings;
}

}  // namespace

std::string applyLine(const Session& session, const std::string& backend) {
    if (session.frames().empty()) failUsage("Open a frame first");
    if (session.presetName().empty()) failUsage("Save the preset first");
    const Chain saved = readPreset(session.presetName(), session.registry());
    std::string line = "brume apply " + shellWord(session.presetName());
    const FrameWords& words = session.words();
    const FrameFiles& frame = session.frames()[session.current()];
    std::string stem = std::filesystem::path(frame.color).stem().string();
    if (session.frames().size() > 1) {
        for (const std::string& name : words.frames) line += " " + shellWord(name);
        line += " -o fogged/";
        if (!words.depth.empty()) line += " --depth " + shellWord(words.depth);
    } else {
        line += " " + shellWord(frame.color) + " -o " + shellWord(stem + ".fogged.png");
        if (!frame.depth.empty()) line += " --depth " + shellWord(frame.depth);
    }
    if (!words.encoding.empty()) line += " --depth-encoding " + shellWord(words.encoding);
    if (!words.camera.empty()) line += " --camera " + shellWord(words.camera);
    if (words.framesPerSecond != 24) line += text(" --fps ", words.framesPerSecond);
    if (!words.color.empty()) line += " --color " + words.color;
    if (session.maxPixels() != ReadOptions().maxPixels) line += text(" --max-pixels ", session.maxPixels());
    return line + " --backend " + backend + settingsBetween(saved, session.chain());
}

}  // namespace brume::preview
