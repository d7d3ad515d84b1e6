#include "preview/session.hpp"

#include <algorithm>
#include <filesystem>

#include "error.hpp"
#include "file_status.hpp"
#include "frame/pending_file.hpp"
#include "frame/sidecar.hpp"
#include "nearest_name.hpp"
#include "preview/stack.hpp"

namespace brume::preview {

namespace fs = std::filesystem;

Session::Session(const EffectRegistry& registry) : registry_(registry), history_(Chain{}) {
    savedText_ = writePreset(chain());
}

// --- frames --------------------------------------------------------------------------------------

ReadOptions Session::readOptions() const {
    ReadOptions options;
    options.maxPixels = maxPixels_;
    if (!words_.encoding.empty()) options.encoding = parseDepthEncoding(words_.encoding);
    if (!words_.camera.empty()) options.camera = parseCamera(words_.camera);
    if (!words_.color.empty()) {
        if (words_.color != "srgb" && words_.color != "linear")
            failUsage("--color: no choice '", words_.color, "'",
                      suggestion(words_.color, {"srgb", "linear"}));
        options.colorIsSrgb = words_.color == "srgb";
    }
    return options;
}

void Session::openFrames(const FrameWords& words) {
    auto frames = expandFrames(words.frames, words.depth);
    if (frames.empty()) failIo("there are no frames in ", words.frames.empty() ? "nothing" : words.frames[0]);
    for (const FrameFiles& files : frames)
        if (!isThere(files.color)) failIo(files.color, ": there is no such file");
    const FrameWords before = words_;
    words_ = words;
    try {
        readOptions();
    } catch (...) {
        words_ = before;
        throw;
    }
    frames_ = std::move(frames);
    current_ = 0;
    framesRevision_++;
    changed();
}

void Session::readDepthAs(const std::string& encoding) {
    parseDepthEncoding(encoding);
    words_.encoding = encoding;
    framesRevision_++;
    changed();
    say("Depth is read as " + encoding);
}

// --- the preset ----------------------------------------------------------------------------------

std::shared_ptr<const Effect> withSourceKept(const std::shared_ptr<const Effect>& effect) {
    auto kept = std::make_shared<Effect>(*effect);
    kept->source = std::make_shared<ExpandedSource>(expandIncludes(*effect));
    return kept;
}

static void keepSources(Chain& chain) {
    std::map<std::string, std::shared_ptr<const Effect>> kept;
    for (Step& step : chain.steps) {
        if (step.effect->source) continue;
        auto& effect = kept[step.effect->header.path];
        if (!effect) effect = withSourceKept(step.effect);
        step.effect = effect;
    }
}

// The registry gives effects as their files were when it first read them.
void Session::bringUpToDate(Chain& chain) const {
    std::map<std::string, std::shared_ptr<const Effect>> now;  // by path
    for (const Step& step : this->chain().steps) now[step.effect->header.path] = step.effect;
    for (size_t k = 0; k < chain.steps.size(); k++) {
        const std::string path = chain.steps[k].effect->header.path;
        auto& effect = now[path];
        std::error_code none;
        if (!effect && fs::last_write_time(path, none) > started_) effect = loadAnew(path);
        if (effect && effect != chain.steps[k].effect) replaceEffect(chain, effect);
    }
}

void Session::adopt(Chain chain, const std::string& what) {
    bringUpToDate(chain);
    keepSources(chain);
    history_.push(std::move(chain), what);
    trial_.reset();
    fileError_.clear();
    changed();
    watchFiles();
}

// The file that a preset's name stands for; empty for an effect's name.
static std::string presetFileOf(const std::string& pathOrName) {
    if (fs::path(pathOrName).extension() == ".fs") return "";
    if (isFile(pathOrName)) return pathOrName;
    for (const auto& [name, file] : shippedPresets())
        if (name == pathOrName) return file;
    return "";
}

void Session::openPreset(const std::string& pathOrName) {
    Chain chain = readPreset(pathOrName, registry_);
    presetName_ = pathOrName;
    presetFile_ = presetFileOf(pathOrName);
    const bool isFirst = history_.now().steps.empty() && !history_.canUndo();
    if (isFirst) history_ = History(Chain{});
    adopt(std::move(chain), "opening " + fs::path(pathOrName).filename().string());
    savedText_ = writePreset(this->chain());
    if (isFirst) history_ = History(this->chain());
}

void Session::openAny(const std::vector<std::string>& paths) {
    FrameWords words;
    for (const std::string& path : paths) {
        const auto ending = fs::path(path).extension();
        if (ending == ".json")
            openPreset(path);
        else if (ending == ".fs")
            addEffect(path);
        else
            words.frames.push_back(path);
    }
    if (words.frames.empty()) return;
    openFrames(words);
    say(text("Opened ", frames_.size(), frames_.size() == 1 ? " frame" : " frames"));
}

void Session::savePreset(const std::string& path) {
    const std::string written = writePreset(chain());
    for (const Step& step : chain().steps) {
        const auto names = registry_.names();
        const std::string& name = step.effect->name();
        if (std::find(names.begin(), names.end(), name) == names.end() ||
            registry_.find(name)->header.path != step.effect->header.path)
            failUsage(path, ": a preset names effects that 'brume list' shows; add the folder of ",
                      step.effect->header.path, " to BRUME_EFFECT_PATH");
    }
    const Chain readBack = parsePreset(written, path, registry_);
    if (writePreset(readBack) != written)
        throw Error(ErrorKind::CheckFailed, path + ": the preset would not be read back as it is");
    writeWhole(path, written);
    presetName_ = presetFile_ = path;
    savedText_ = written;
    watchFiles();
    watcher_.changed();  // this change is ours
    say("Saved " + path);
}

// --- editing -------------------------------------------------------------------------------------

void Session::edit(const std::string& what, const std::string& key,
                   const std::function<void(Chain&)>& change) {
    Chain next = chain();
    change(next);
    keepSources(next);
    history_.push(std::move(next), what, key);
    changed();
}

void Session::setValue(size_t step, const Parameter& parameter, const ParameterValue& value, bool isDrag) {
    const std::string& id = chain().steps.at(step).id;
    edit(parameter.name + " of " + id, isDrag ? id + "." + parameter.name : "", [&](Chain& next) {
        next.steps[step].values[parameter.name] = value;
        next.steps[step].given.insert(parameter.name);
    });
}

void Session::resetValue(size_t step, const Parameter& parameter) {
    edit("resetting " + parameter.name, "", [&](Chain& next) {
        next.steps.at(step).values[parameter.name] = parameter.defaultValue;
        next.steps.at(step).given.erase(parameter.name);
    });
}

void Session::addEffect(const std::string& nameOrPath) {
    Chain one;
    one.steps.push_back(newStep(registry_.find(nameOrPath)));
    bringUpToDate(one);
    edit("adding " + one.steps[0].effect->name(), "",
         [&](Chain& next) { insertStep(next, next.steps.size(), newStep(one.steps[0].effect)); });
    watchFiles();
}

void Session::undo() {
    if (!history_.canUndo()) return say("Nothing to undo");
    say("Undone: " + history_.undoes());
    history_.undo();
    changed();
    watchFiles();
}

void Session::redo() {
    if (!history_.canRedo()) return say("Nothing to redo");
    say("Done again: " + history_.redoes());
    history_.redo();
    changed();
    watchFiles();
}

// --- files ---------------------------------------------------------------------------------------

static std::string libraryOf(const std::string& fsPath) {
    return fs::path(fsPath).replace_extension(".so").string();
}

void Session::watchFiles() {
    std::vector<std::string> paths;
    if (!presetFile_.empty()) paths.push_back(presetFile_);
    for (const Step& step : chain().steps) {
        const std::string& file = step.effect->header.path;
        paths.push_back(file);
        paths.push_back(libraryOf(file));
        if (step.effect->source)
            paths.insert(paths.end(), step.effect->source->files.begin(), step.effect->source->files.end());
    }
    if (trial_)
        for (const auto& effect : trial_->effects)
            paths.insert(paths.end(), effect->source->files.begin(), effect->source->files.end());
    watcher_.watch(paths);
}

void Session::pollFiles() {
    const std::vector<std::string> paths = watcher_.changed();
    if (paths.empty()) return;
    if (std::find(paths.begin(), paths.end(), presetFile_) != paths.end()) reloadPreset();
    reloadEffects(paths);
}

void Session::reloadPreset() {
    if (!isThere(presetFile_)) return;
    try {
        Chain chain = readPreset(presetFile_, registry_);
        keepSources(chain);
        if (writePreset(chain) == writePreset(this->chain())) return;
        adopt(std::move(chain), "the preset's file");
        savedText_ = writePreset(this->chain());
        say("The preset's file has changed: read again");
    } catch (const Error& e) {
        fileError_ = e.what();
    }
}

std::shared_ptr<const Effect> Session::loadAnew(const std::string& fsPath) const {
    return withSourceKept(registry_.find(fsPath));
}

void Session::reloadEffects(const std::vector<std::string>& changedPaths) {
    auto isChanged = [&](const std::string& path) {
        return std::find(changedPaths.begin(), changedPaths.end(), path) != changedPaths.end();
    };
    std::map<std::string, std::shared_ptr<const Effect>> touched;  // by path
    bool isPluginNew = false;
    for (const Step& step : chainToRender().steps) {
        const std::string& path = step.effect->header.path;
        bool isTouched = isChanged(path) || isChanged(libraryOf(path));
        for (const std::string& file : step.effect->source->files) isTouched |= isChanged(file);
        if (trial_)
            for (const auto& effect : trial_->effects)
                if (effect->header.path == path)
                    for (const std::string& file : effect->source->files) isTouched |= isChanged(file);
        if (!isTouched) continue;
        touched[path] = step.effect;
        isPluginNew |= isChanged(libraryOf(path)) || isChanged(path);
    }
    if (touched.empty()) return;
    Trial trial;
    if (trial_)
        for (const auto& effect : trial_->effects)
            if (!touched.count(effect->header.path)) trial.effects.push_back(effect);
    trial.programsBefore = trial_ ? trial_->programsBefore : programs_;
    try {
        for (const auto& [path, effect] : touched) trial.effects.push_back(loadAnew(path));
    } catch (const Error& e) {
        fileError_ = e.what();
        return;  // the last good one stays
    }
    trial_ = std::move(trial);
    if (isPluginNew) programs_++;
    changed();
    trial_->revision = revision_;
    watchFiles();
}

Chain Session::chainToRender() const {
    Chain chain = this->chain();
    if (trial_)
        for (const auto& effect : trial_->effects) replaceEffect(chain, effect);
    return chain;
}

void Session::rendered(uint64_t revision, const std::string& error) {
    if (!trial_ || revision < trial_->revision) return;
    if (!error.empty()) {
        fileError_ = error;
        if (programs_ != trial_->programsBefore) programs_++;
        trial_.reset();
        changed();
        return;  // still watched: watchFiles() has seen the trial's files
    }
    const Trial good = std::move(*trial_);
    trial_.reset();
    history_.change([&](Chain& chain) {
        for (const auto& effect : good.effects) replaceEffect(chain, effect);
    });
    fileError_.clear();
    std::string names;
    for (const auto& effect : good.effects) names += (names.empty() ? "" : ", ") + effect->name();
    say("Loaded again: " + names);
    watchFiles();
}

}  // namespace brume::preview
