// Files that follow no link: one that appears under its name only when it is whole, and one that grows.
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

/// Begins as such a file, then takes one piece after another, each in it as soon as append() returns. Throws
/// Error (Io).
class GrowingFile {
  public:
    GrowingFile(const std::string& target, const std::string& beginning);
    ~GrowingFile();
    GrowingFile(const GrowingFile&) = delete;
    GrowingFile& operator=(const GrowingFile&) = delete;

    void append(const std::string& piece);

  private:
    std::string target_;
    int file_;
};

}  // namespace brume
