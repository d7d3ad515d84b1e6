// Which files have changed since they were last looked at.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace brume::preview {

/// Polls times and sizes: works on every file system, and editors that write a new file and rename it are
/// seen as well. Not thread-safe.
class Watcher {
  public:
    /// From now on exactly these; ones that were watched before keep what is known of them.
    void watch(const std::vector<std::string>& paths);
    /// Paths that changed, appeared or vanished since the last call. A file that is being written is reported
    /// at each change.
    std::vector<std::string> changed();

  private:
    struct Stamp {
        int64_t seconds = -1, nanoseconds = 0, bytes = -1;
        uint64_t inode = 0;
        bool operator==(const Stamp&) const = default;
    };
    static Stamp stampOf(const std::string& path);
    std::map<std::string, Stamp> known_;
};

}  // namespace brume::preview
