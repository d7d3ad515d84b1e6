// An effect ready to run: the header, its GLSL, and the C++ half if there is one.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "effect/header.hpp"
#include "effect/plugin.hpp"

namespace brume {

/// GLSL with `#include "..."` expanded and #line directives, so that errors name file and line.
struct ExpandedSource {
    std::string text;
    std::vector<std::string> files;  ///< the file of each #line source number
};

/// Immutable; shared between chains and threads. Holds its plugin's library open.
struct Effect {
    EffectHeader header;
    std::shared_ptr<const PluginEffect> plugin;  ///< null: GLSL only
    std::vector<std::string> includePath;        ///< folders searched by #include, first its own
    /// The GLSL as its files were when this was set; null: they are read when it is compiled.
    std::shared_ptr<const ExpandedSource> source;

    const std::string& name() const { return header.name; }
    /// A plugin always holds a CPU half: loadEffect sees to it.
    bool hasCpu() const { return plugin != nullptr; }
};

/// Reads `<folder>/<name>.fs` and, if `library` names a file, loads the plugin from it. Throws Error (Usage):
/// a version mismatch, a parameter bound that the header lacks or the reverse, a derived name without a
/// function.
std::shared_ptr<const Effect> loadEffect(const std::string& fsPath, const std::string& libraryPath,
                                         const std::vector<std::string>& includePath);

/// The effect's GLSL: its `source`, or else what its files hold now. Throws Error (Usage).
ExpandedSource expandIncludes(const Effect& effect);

/// The effects found in BRUME_EFFECT_PATH, the user's data folder and the install prefix (or build tree).
class EffectRegistry {
  public:
    /// The registry of this process, discovered once.
    static const EffectRegistry& standard();
    explicit EffectRegistry(const std::vector<std::string>& folders);

    /// By name, or by the path of a .fs file or of its folder. Throws Error (Usage) with the nearest name, or
    /// with the reason the effect was refused.
    std::shared_ptr<const Effect> find(const std::string& nameOrPath) const;
    /// All names, sorted, whether or not they load.
    std::vector<std::string> names() const;
    /// Loads them all; those that cannot be, with the reason.
    std::map<std::string, std::string> refused() const;

    /// Folders searched, first wins: BRUME_EFFECT_PATH, ~/.local/share/brume/effects,
    /// <prefix>/lib/brume/effects.
    static std::vector<std::string> standardFolders();

  private:
    struct Entry {
        std::string fs, library;
        std::vector<std::string> includePath;
    };
    std::map<std::string, Entry> entries_;
    mutable std::map<std::string, std::shared_ptr<const Effect>> loaded_;
    mutable std::map<std::string, std::string> refused_;
    std::shared_ptr<std::mutex> mutex_;
};

}  // namespace brume
