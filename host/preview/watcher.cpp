#include "preview/watcher.hpp"

#include <sys/stat.h>

namespace brume::preview {

Watcher::Stamp Watcher::stampOf(const std::string& path) {
    struct stat found {};
    if (stat(path.c_str(), &found) != 0) return {};
    return {found.st_mtim.tv_sec, found.st_mtim.tv_nsec, found.st_size, found.st_ino};
}

void Watcher::watch(const std::vector<std::string>& paths) {
    std::map<std::string, Stamp> next;
    for (const std::string& path : paths) {
        auto known = known_.find(path);
        next[path] = known != known_.end() ? known->second : stampOf(path);
    }
    known_ = std::move(next);
}

std::vector<std::string> Watcher::changed() {
    std::vector<std::string> paths;
    for (auto& [path, known] : known_)
        if (Stamp now = stampOf(path); !(now == known)) {
            known = now;
            paths.push_back(path);
        }
    return paths;
}

}  // namespace brume::preview
