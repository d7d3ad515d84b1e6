#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <sstream>

#include "effect/effect.hpp"
#include "effect/effect_path.hpp"
#include "error.hpp"
#include "file_status.hpp"
#include "install_root.hpp"
#include "nearest_name.hpp"

namespace brume {

namespace fs = std::filesystem;

std::vector<std::string> EffectRegistry::standardFolders() {
    std::vector<std::string> folders;
    if (const char* path = std::getenv("BRUME_EFFECT_PATH")) {
        std::stringstream list(path);
        for (std::string folder; std::getline(list, folder, ':');)
            if (!folder.empty()) folders.push_back(folder);
    }
    const char* data = std::getenv("XDG_DATA_HOME");
    const char* home = std::getenv("HOME");
    if (data && *data)
        folders.push_back(std::string(data) + "/brume/effects");
    else if (home)
        folders.push_back(std::string(home) + "/.local/share/brume/effects");
    folders.push_back(installRoot() + "/effects");
    return folders;
}

const EffectRegistry& EffectRegistry::standard() {
    static const EffectRegistry registry(standardFolders());
    return registry;
}

// `<name>.fs` with `<name>.so` beside it, in a folder of its own or directly in the search folder.
static std::string libraryBeside(const fs::path& file) {
    auto library = fs::path(file).replace_extension(".so");
    return isFile(library) ? library.string() : std::string();
}

// The folder of an effect some way down, such as build/effects/mist for build; or empty.
static std::string effectBelow(const fs::path& folder) {
    std::string first;
    std::error_code none;
    for (fs::recursive_directory_iterator item(folder, none), end; item != end; item.increment(none)) {
        if (item.depth() == 2) item.disable_recursion_pending();
        const std::string found = item->path().parent_path().string();
        if (item->path().extension() == ".fs" && (first.empty() || found < first)) first = found;
    }
    return first;
}

// The .fs file that a path means: itself, or the folder's one of the folder's name, or the folder's only one.
static fs::path effectFile(const fs::path& path) {
    if (!isThere(path))
        failUsage(path.string(), ": no such effect file or folder", suggestionBeside(path.string()),
                  "; effects of your own are built first, by cmake --build build");
    if (!isFolder(path)) return path;
    std::vector<fs::path> files;
    for (const auto& item : fs::directory_iterator(path))
        if (item.path().extension() == ".fs") files.push_back(item.path());
    for (const auto& file : files)
        if (file.stem() == fs::canonical(path).filename()) return file;
    if (files.empty()) {
        const std::string inside = effectBelow(path);
        failUsage(path.string(), ": the folder holds no .fs file",
                  inside.empty() ? "" : "; did you mean " + inside + "?");
    }
    if (files.size() > 1)
        failUsage(path.string(), ": the folder holds ", files.size(), " .fs files; name one, such as ",
                  std::min(files[0], files[1]).string());
    return files[0];
}

static std::vector<std::string> includePathOf(const fs::path& file) {
    auto own = file.parent_path();
    std::vector<std::string> path = {own.string()};
    for (const auto& root : {own.parent_path().parent_path() / "glsl", fs::path(installRoot()) / "glsl"})
        if (isFolder(root) && path.back() != root.string()) path.push_back(root.string());
    return path;
}

EffectRegistry::EffectRegistry(const std::vector<std::string>& folders)
    : mutex_(std::make_shared<std::mutex>()) {
    auto add = [&](const fs::path& file) {
        entries_.try_emplace(file.stem().string(),
                             Entry{file.string(), libraryBeside(file), includePathOf(file)});
    };
    for (const auto& folder : folders) {
        std::error_code none;
        for (const auto& item : fs::directory_iterator(folder, none)) {
            auto path = item.path();
            if (path.extension() == ".fs" && item.is_regular_file()) add(path);
            auto inside = path / (path.filename().string() + ".fs");
            if (item.is_directory() && isFile(inside)) add(inside);
        }
    }
}

std::shared_ptr<const Effect> EffectRegistry::find(const std::string& nameOrPath) const {
    if (isEffectPath(nameOrPath)) {
        const fs::path file = effectFile(nameOrPath);
        return loadEffect(file.string(), libraryBeside(file), includePathOf(fs::absolute(file)));
    }
    auto entry = entries_.find(nameOrPath);
    if (entry == entries_.end() && isFolder(nameOrPath))
        failUsage("no effect '", nameOrPath, "'; for the folder of that name here, say ./", nameOrPath);
    if (entry == entries_.end())
        failUsage(
            "no effect '", nameOrPath, "'", suggestion(nameOrPath, names()),
            entries_.empty() ? "; no effects were found at all: set BRUME_EFFECT_PATH to their folder"
            : nearestName(nameOrPath, names()).empty()
                ? "; one of your own is found through BRUME_EFFECT_PATH (build/effects, where brume new made "
                  "it), or by its path on the command line"
                : "");
    std::lock_guard lock(*mutex_);
    auto& effect = loaded_[nameOrPath];
    if (effect) return effect;
    if (auto reason = refused_.find(nameOrPath); reason != refused_.end()) failUsage(reason->second);
    try {
        effect = loadEffect(entry->second.fs, entry->second.library, entry->second.includePath);
    } catch (const Error& error) {
        refused_[nameOrPath] = error.what();
        throw;
    }
    return effect;
}

std::vector<std::string> EffectRegistry::names() const {
    std::vector<std::string> names;
    for (const auto& [name, entry] : entries_) names.push_back(name);
    return names;
}

std::map<std::string, std::string> EffectRegistry::refused() const {
    std::map<std::string, std::string> reasons;
    for (const auto& name : names()) {
        try {
            find(name);
        } catch (const Error& error) {
            reasons[name] = error.what();
        }
    }
    return reasons;
}

}  // namespace brume
