// Memory for intermediate results, which a thread keeps for its next task: touching fresh pages costs more
// than a short filter over them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

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
            block_.memory.reset();
            block_.memory.reset(static_cast<float*>(operator new(size * sizeof(float), alignment)));
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
    static constexpr std::align_val_t alignment{64};
    struct Free {
        void operator()(float* p) const { operator delete(p, alignment); }
    };
    struct Block {
        std::unique_ptr<float, Free> memory;
        size_t size = 0;
    };
    static std::vector<Block>& kept() {
        thread_local std::vector<Block> blocks;
        return blocks;
    }
    Block block_;
};

}  // namespace blur
