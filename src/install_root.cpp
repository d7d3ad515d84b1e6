#include "install_root.hpp"

#include <dlfcn.h>

#include <filesystem>

namespace brume {

namespace fs = std::filesystem;

std::string installRoot() {
    Dl_info info{};
    dladdr(reinterpret_cast<void*>(&installRoot), &info);
    std::error_code none;
    return (fs::canonical(info.dli_fname, none).parent_path() / "brume").string();
}

}  // namespace brume
