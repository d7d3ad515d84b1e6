// One run of many frames at a time in an output folder.
#pragma once

#include <string>

namespace brume::host {

/// Holds the folder (made if need be) until destroyed; shards of one run share it. A run that has it alone
/// sweeps up the hidden, half-written files of runs that were killed. Throws Error (Io).
class FolderLock {
  public:
    FolderLock(const std::string& folder, bool isShard);
    ~FolderLock();
    FolderLock(const FolderLock&) = delete;
    FolderLock& operator=(const FolderLock&) = delete;

  private:
    int file_;
};

}  // namespace brume::host
