// Why an effect has no C++ half.
#pragma once

#include <string>

namespace brume {

/// What to add where an effect turns out to be GLSL only: that `<name>.cpp` lies beside its .fs, not built,
/// and what to do; empty where there is no such source.
std::string unbuiltSource(const std::string& fsPath);

}  // namespace brume
