#include "effect/missing_half.hpp"

#include <filesystem>

#include "error.hpp"
#include "file_status.hpp"

namespace brume {

std::string unbuiltSource(const std::string& fsPath) {
    const auto source = std::filesystem::path(fsPath).replace_extension(".cpp");
    if (!isFile(source)) return {};
    const std::string name = source.stem().string();
    return text(source.filename().string(), " beside it is not built into ", name,
                ".so; build it and name the folder that the build makes, such as build/effects/", name);
}

}  // namespace brume
