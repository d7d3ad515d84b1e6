// What the fuzz targets share: the bytes as text, as a file, and what may be thrown.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <opencv2/core/utility.hpp>
#include <string>

#include "error.hpp"

namespace brume::fuzz {

/// A file in memory that is rewritten for each input; other processes of this user can open it, too.
class MemoryFile {
  public:
    MemoryFile()
        : file_(memfd_create("fuzz", 0)),
          path_("/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(file_)) {
        if (file_ < 0) std::abort();
        cv::setNumThreads(1);  // small images: waiting for other threads would take most of the time
    }
    const std::string& holding(const uint8_t* data, size_t size) {
        if (ftruncate(file_, 0) != 0 || pwrite(file_, data, size, 0) != ssize_t(size)) std::abort();
        return path_;
    }

  private:
    int file_;
    std::string path_;
};

/// Runs `action`, which may refuse its input by an Error of one line, and by nothing else.
template <class Action>
bool acceptedOrRefused(Action action) {
    try {
        action();
        return true;
    } catch (const Error& e) {
        if (std::string(e.what()).empty()) std::abort();
        return false;
    }
}

}  // namespace brume::fuzz
