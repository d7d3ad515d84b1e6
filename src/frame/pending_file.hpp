// A file that appears under its name only when it is whole.
#pragma once

#include <string>

namespace brume {

/// Write to path(), close, then commit(). Without commit nothing is left. A link at the target's name is
/// replaced, not followed; a device or pipe there is refused. Throws Error (Io) naming the target.
class PendingFile {
  public:
    explicit PendingFile(const std::string& target);
    ~PendingFile();
    PendingFile(const PendingFile&) = delete;
    PendingFile& operator=(const PendingFile&) = delete;

    /// Beside the target, hidden, with its ending.
    const std::string& path() const { return path_; }
    /// To the disk, then renamed over the target.
    void commit();

  private:
    std::string target_, path_;
    bool committed_ = false;
};

/// Such a file of this content.
void writeWhole(const std::string& target, const std::string& content);

}  // namespace brume
