// How much there can be.
#pragma once

#include <unistd.h>

#include <cstddef>

namespace brume {

/// Bytes of this machine's memory.
inline size_t machineMemory() { return size_t(sysconf(_SC_PHYS_PAGES)) * size_t(sysconf(_SC_PAGESIZE)); }

}  // namespace brume
