// --set: which parameter values each output gets.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "effect/chain.hpp"

namespace brume::host {

/// "effect.param" and a value's text, ready for setParameter.
using Settings = std::vector<std::pair<std::string, std::string>>;

/// One "--set effect.param=v1,v2": its alternatives, each a value, or random(a,b), random(a,b,log) or
/// choice(a,b,...), drawn anew for each frame.
struct Sweep {
    std::string path;
    std::vector<std::string> values;
};

/// Whether a value is drawn anew for each frame: random(...) or choice(...). Throws Error (Usage).
bool isDrawn(const std::string& path, const std::string& value);

/// Splits at the first '=' and at commas outside brackets. Throws Error (Usage).
Sweep parseSweep(const std::string& argument);

/// One output of every frame.
struct Variant {
    Settings settings;  ///< values may still be random(...)
    std::string label;  ///< "visibility-100_color-red": what tells it from the others; empty if it is alone
};

/// The product of all sweeps, the last varying fastest. Applies every value to a copy of `chain`, so that a
/// wrong one is an Error (Usage) before any frame is read.
std::vector<Variant> variantsOf(const std::vector<Sweep>& sweeps, const Chain& chain);

/// The settings with every draw made: from the frame's name, the path and the seed alone.
Settings drawn(const Settings& settings, const std::string& frameName, uint32_t seed);

Chain withSettings(Chain chain, const Settings& settings);

}  // namespace brume::host
