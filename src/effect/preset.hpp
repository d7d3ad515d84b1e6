// Presets on disk: JSON with comments, an ordered list of effects with parameters.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "effect/chain.hpp"

namespace brume {

/// Reads a preset file, or a shipped preset by name, or a bare effect's name (its defaults). Throws Error
/// (Usage) with file, the offending key and the nearest valid name.
Chain readPreset(const std::string& pathOrName, const EffectRegistry& registry);
Chain parsePreset(const std::string& jsonText, const std::string& where, const EffectRegistry& registry);
/// What readPreset reads back to an equal chain.
std::string writePreset(const Chain& chain);

/// Applies "effect.param", "effect.list[2].field" = argument.
void setParameter(Chain& chain, const std::string& path, const std::string& argument);

/// Shipped presets: name and path, sorted.
std::vector<std::pair<std::string, std::string>> shippedPresets();

}  // namespace brume
