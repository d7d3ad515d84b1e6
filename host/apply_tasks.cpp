#include "apply_tasks.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <unordered_map>
#include <unordered_set>

#include "effect/preset.hpp"
#include "error.hpp"
#include "frame/light_maps.hpp"
#include "frame/pairing.hpp"
#include "frame/sidecar.hpp"

namespace brume::host {

namespace fs = std::filesystem;

Shard parseShard(const std::string& shard) {
    size_t part = 0, parts = 0;
    char rest = 0;
    if (shard.empty()) return {};
    if (std::sscanf(shard.c_str(), "%zu/%zu%c", &part, &parts, &rest) != 2 || part < 1 || part > parts)
        failUsage("--shard: '", shard, "' should be PART/PARTS, from 1/8 to 8/8 for eight");
    return {part, parts};
}

// Frames of different folders often have the same stem.
static std::string drawName(const std::string& input) {
    fs::path path = fs::absolute(input).lexically_normal();
    return (path.parent_path().filename() / path.stem()).string();
}

std::vector<Task> tasksOf(const Chain& chain, const Making& common, const std::vector<FrameFiles>& inputs,
                          const std::vector<Variant>& variants, const OutputNames& names) {
    std::vector<Task> tasks;
    const auto effects = std::make_shared<std::string>(effectFiles(chain).dump());
    for (size_t frame = 0; frame < inputs.size(); frame++)
        for (size_t variant = 0; variant < variants.size(); variant++) {
            Task task;
            task.frame = frame;
            task.variant = variant;
            task.making = common;
            task.making.input = inputs[frame].color;
            task.making.frame.depth = inputs[frame].depth;
            task.making.time = inputs[frame].time;
            task.making.index = common.index + frame;
            task.settings = drawn(variants[variant].settings, drawName(inputs[frame].color), common.seed);
            for (const auto& [path, value] : task.settings)
                std::erase_if(task.making.settings, [&](const auto& was) { return was.first == path; });
            task.making.settings.insert(task.making.settings.end(), task.settings.begin(),
                                        task.settings.end());
            bool isAsBefore = !tasks.empty() && tasks.back().settings == task.settings;
            task.making.preset =
                isAsBefore ? tasks.back().making.preset
                           : std::make_shared<std::string>(writePreset(withSettings(chain, task.settings)));
            task.making.effects = effects;
            task.missing = inputs[frame].missing;
            task.output = names.of(inputs[frame].color, frame, variants[variant], task.making.settings);
            if (common.withDepth && fs::path(task.output).extension() != ".exr")
                failUsage("--with-depth: '", task.output, "' should end in .exr");
            tasks.push_back(std::move(task));
        }
    return tasks;
}

std::vector<std::string> filesBeside(const std::string& color) {
    std::vector<std::string> files = depthFilesBeside(color);
    files.push_back(fs::path(color).replace_extension(".json").string());
    try {
        const Sidecar sidecar = readSidecar(color);
        files.push_back(sidecar.depthFile);
        if (sidecar.extras)
            for (const std::string& path : lightMapsOf(*sidecar.extras)) files.push_back(path);
    } catch (const std::exception&) {  // that frame's own reading will say it
    }
    std::erase(files, "");
    return files;
}

void requireDistinct(const std::vector<Task>& tasks, const std::vector<FrameFiles>& inputs,
                     const std::vector<Kept>& keep, const std::string& report) {
    std::unordered_map<std::string, const Task*> seen;
    std::unordered_set<std::string> read;
    std::vector<std::string> outputs;  // in the order of tasks, 1 + keep.size() each
    for (const Task& task : tasks) {
        outputs.push_back(task.output);
        for (const Kept& kept : keep) outputs.push_back(OutputNames::keptBeside(task.output, kept));
    }
    // Only what is there already can be an input.
    const bool mayOverwrite =
        !report.empty() || std::any_of(outputs.begin(), outputs.end(), [](auto& output) {
            std::error_code none;
            return fs::exists(output, none);
        });
    for (const FrameFiles& input : inputs) {
        read.insert(placeOf(input.color));
        if (!input.depth.empty()) read.insert(placeOf(input.depth));
        if (mayOverwrite)
            for (const std::string& beside : filesBeside(input.color)) read.insert(placeOf(beside));
    }
    for (const std::string& output : outputs)
        if (read.count(placeOf(output))) failUsage("-o: '", output, "' is an input; it would be overwritten");
    for (const Task& task : tasks) {
        auto [place, isNew] = seen.emplace(placeOf(task.output), &task);
        const auto stem = [](const Task& t) { return fs::path(t.making.input).stem(); };
        if (!isNew)
            failUsage("-o: '", place->second->making.input, "' and '", task.making.input,
                      "' would both be written to '", task.output, "'; use a name with ",
                      place->second->frame == task.frame   ? "{param}"
                      : stem(*place->second) == stem(task) ? "{index}"
                                                           : "{stem}");
    }
    if (!report.empty() && (read.count(placeOf(report)) || seen.count(placeOf(report))))
        failUsage("--report: '", report, "' is an input or output; it would be overwritten");
}

}  // namespace brume::host
