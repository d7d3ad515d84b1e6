#include "modules/module.hpp"

#include <dlfcn.h>

#include <mutex>

#include "error.hpp"
#include "install_root.hpp"

namespace brume {

void* moduleFunction(const std::string& module, const std::string& symbol) {
    static std::mutex mutex;
    static std::map<std::string, void*> open;
    const std::lock_guard lock(mutex);
    void*& handle = open[module];
    if (!handle) {
        const std::string path = installRoot() + "/modules/" + module + ".so";
        handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (!handle) failIo("brume's module ", module, " cannot be loaded: ", dlerror());
    }
    void* function = dlsym(handle, symbol.c_str());
    if (!function) failIo("brume's module ", module, " lacks ", symbol, "; reinstall brume");
    return function;
}

}  // namespace brume
