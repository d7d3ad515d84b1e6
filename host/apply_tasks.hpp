// What a run of apply has to make, and where.
#pragma once

#include <string>
#include <vector>

#include "batch.hpp"
#include "frame/sequence.hpp"
#include "sweep.hpp"

namespace brume::host {

/// "3/8": a run takes the third of every eight frames.
struct Shard {
    size_t part = 1, parts = 1;
};
/// Throws Error (Usage). "" is the whole.
Shard parseShard(const std::string& shard);

/// Every variant of every input, made as `common` says, whose index is the first one's and whose settings
/// were made before. Throws Error (Usage) where an output cannot hold what it should.
std::vector<Task> tasksOf(const Chain& chain, const Making& common, const std::vector<FrameFiles>& inputs,
                          const std::vector<Variant>& variants, const OutputNames& names);

/// Throws Error (Usage) unless every output, those beside the pictures too, and the report ("": none), has a
/// place of its own, which is no file of any frame's: its colour, depth, sidecar, or a light map this names.
void requireDistinct(const std::vector<Task>& tasks, const std::vector<FrameFiles>& inputs,
                     const std::vector<Kept>& keep, const std::string& report);

/// What reading a frame finds beside it.
std::vector<std::string> filesBeside(const std::string& color);

}  // namespace brume::host
