#include "report.hpp"

#include <sys/resource.h>

#include <cstdio>

#include "effect/preset.hpp"
#include "error.hpp"
#include "frame/pending_file.hpp"

namespace brume::host {

// What a setting says, as a number or a list of numbers where it is one, so that nobody must parse it again.
static nlohmann::ordered_json valueOf(const std::string& setting) {
    const bool isList = setting.starts_with("(") && setting.ends_with(")");
    auto value = nlohmann::ordered_json::parse(
        isList ? "[" + setting.substr(1, setting.size() - 2) + "]" : setting, nullptr, false);
    return value.is_number() || value.is_array() ? value : nlohmann::ordered_json(setting);
}

Report::Report(const Chain& chain, uint32_t seed, const std::string& backend) {
    run_["version"] = BRUME_VERSION;
    run_["preset"] = nlohmann::ordered_json::parse(writePreset(chain));
    run_["seed"] = seed;
    run_["backend"] = backend;
}

void Report::add(const Task& task, const Outcome& outcome) {
    using State = Outcome::State;
    nlohmann::ordered_json entry;
    entry["index"] = task.making.index;
    entry["input"] = task.making.input;
    if (!task.making.frame.depth.empty()) entry["depth"] = task.making.frame.depth;
    entry["output"] = task.output;
    entry["state"] = outcome.state == State::Made       ? "made"
                     : outcome.state == State::UpToDate ? "up to date"
                                                        : "failed";
    if (!outcome.error.empty()) entry["error"] = outcome.error;
    for (const auto& [path, value] : task.making.settings) entry["settings"][path] = valueOf(value);
    if (outcome.state == State::Made) {
        entry["files"] = outcome.files;
        entry["size"] = {outcome.size.width, outcome.size.height};
        entry["seconds"] = {
            {"read", outcome.readSeconds}, {"run", outcome.runSeconds}, {"write", outcome.writeSeconds}};
        megapixels_ += outcome.size.area() * 1e-6;
    }
    frames_.push_back(entry);
    made_ += outcome.state == State::Made;
    upToDate_ += outcome.state == State::UpToDate;
    failed_ += outcome.state == State::Failed;
}

std::string Report::summary() const {
    double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    char line[200] = "0 made";
    if (made_)
        std::snprintf(line, sizeof line, "%zu made in %.1f s, %.2f a second, %.1f megapixels/s", made_,
                      seconds, double(made_) / seconds, megapixels_ / seconds);
    std::string all = line;
    if (upToDate_) all += text("; ", upToDate_, " were up to date");
    if (failed_) all += text("; ", failed_, " failed");
    return all;
}

void Report::write(const std::string& path) const {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    nlohmann::ordered_json report = run_;
    report["frames"] = frames_;
    report["summary"] = {
        {"made", made_},      {"up_to_date", upToDate_},   {"failed", failed_},
        {"seconds", seconds}, {"megapixels", megapixels_}, {"peak_bytes", usage.ru_maxrss * 1024}};
    writeWhole(path, report.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

}  // namespace brume::host
