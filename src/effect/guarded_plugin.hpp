// A loaded plugin whose every exception becomes brume's own error, naming the library and the function.
#pragma once

#include <memory>
#include <string>

#include "effect/plugin.hpp"

namespace brume {

/// What the entry's factory makes. Whatever it or the plugin's functions throw, other than Error, is thrown
/// on as Error (CheckFailed); `library` is the plugin's path, for the sentence.
std::shared_ptr<const PluginEffect> makePlugin(const PluginEntry& entry, const std::string& library);

}  // namespace brume
