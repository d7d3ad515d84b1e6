// Memory for intermediate results, which a thread keeps for its next task: touching fresh pages costs more
// than a short filter over them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace blur {

/// Room for at least `size` floats, holding whatever was there before, aligned to 64 bytes. For use by the
/// thread that made it. What a thread keeps is the most it ever used at once, until it ends.
class Scratch {
  public:
    explicit Scratch(size_t size) {
        auto& blocks = kept();
        auto fits = [&](const Block& b) { return b.size >= size; };
        auto found = std::find_if(blocks.begin(), blocks.end(), fits);
        if (found == blocks.end() && !blocks.empty()) found = blocks.end() - 1;
        if (found != blocks.end()) {
            block_ = std::move(*found);
            blocks.erase(found);
        }
        if (block_.size < size) {
            block_ = {};
            block_.memory = taken(size * sizeof(float));
            block_.size = size;
        }
    }
    ~Scratch() {
        if (!block_.memory) return;
        auto& blocks = kept();  // by rising size
        auto larger = [&](const Block& b) { return b.size >= block_.size; };
        blocks.insert(std::find_if(blocks.begin(), blocks.end(), larger), std::move(block_));
    }
    Scratch(Scratch&&) = default;
    Scratch& operator=(Scratch&&) = delete;

    float* data() const { return block_.memory.get(); }

  private:
    struct Free {
        void operator()(float* p) const { std::free(p); }
    };
    using Memory = std::unique_ptr<float, Free>;
    struct Block {
        Memory memory;
        size_t size = 0;
    };
    // An image is hundreds of small pages, on whose addresses a pass over several images waits half its time.
    static Memory taken(size_t bytes) {
        constexpr size_t largePage = 2 << 20;
        const size_t alignment = bytes >= largePage ? largePage : 64;
        bytes = (bytes + alignment - 1) / alignment * alignment;
        Memory memory(static_cast<float*>(std::aligned_alloc(alignment, bytes)));
        if (!memory) throw std::bad_alloc();
#ifdef __linux__
        if (alignment == largePage) madvise(memory.get(), bytes, MADV_HUGEPAGE);
#endif
        return memory;
    }
    static std::vector<Block>& kept() {
        thread_local std::vector<Block> blocks;
        return blocks;
    }
    Block block_;
};

}  // namespace blur
