// brume list: the effects and presets there are.
#include <iostream>

#include "commands.hpp"
#include "effect/preset.hpp"
#include "error.hpp"

namespace brume::host {
namespace {

// Up to the first sentence's end.
std::string firstSentence(const std::string& text) {
    size_t end = text.find(". ");
    return end == std::string::npos ? text : text.substr(0, end + 1);
}

std::string column(const std::string& text, size_t width) {
    return text + std::string(text.size() < width ? width - text.size() : 1, ' ');
}

void list() {
    const EffectRegistry& registry = EffectRegistry::standard();
    auto refused = registry.refused();
    std::cout << "Effects\n";
    for (const std::string& name : registry.names()) {
        if (refused.count(name)) continue;
        auto effect = registry.find(name);
        std::cout << "  " << column(name, 16)
                  << column(effect->plugin ? "" : "GLSL only", effect->plugin ? 0 : 11)
                  << firstSentence(effect->header.description) << "\n";
    }
    if (!refused.empty()) std::cout << "Refused\n";
    for (const auto& [name, reason] : refused) std::cout << "  " << column(name, 16) << reason << "\n";
    std::cout << "Presets\n";
    for (const auto& [name, path] : shippedPresets()) {
        std::string description;
        try {
            description = readPreset(path, registry).description;
        } catch (const Error& e) {
            description = text("(cannot be used: ", e.what(), ")");
        }
        std::cout << "  " << column(name, 28) << description << "\n";
    }
    std::cout << "Searched\n";
    for (const std::string& folder : EffectRegistry::standardFolders()) std::cout << "  " << folder << "\n";
}

}  // namespace

void addList(CLI::App& program) {
    CLI::App* command = program.add_subcommand("list", "The effects and presets there are");
    command->callback(list);
}

}  // namespace brume::host
