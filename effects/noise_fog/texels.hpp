// The baked volume as a plan looks at it: of its texels, those that were asked for.
#pragma once

#include <atomic>
#include <cstdlib>
#include <memory>
#include <new>

namespace brume::noise_fog {

// edge³ values in 0..1, each known once it was set; several threads may set the same one to the same value.
class Texels {
  public:
    explicit Texels(int edge)
        : values_(static_cast<float*>(std::calloc(size_t(edge) * edge * edge, sizeof(float))), std::free) {
        if (!values_) throw std::bad_alloc();
    }
    // 0: not known yet, or really 0.
    float operator[](int texel) const {
        return std::atomic_ref(values_.get()[texel]).load(std::memory_order_relaxed);
    }
    void set(int texel, float value) {
        std::atomic_ref(values_.get()[texel]).store(value, std::memory_order_relaxed);
    }

  private:
    std::unique_ptr<float, decltype(&std::free)> values_;  // pages that nobody asks for take no memory
};

}  // namespace brume::noise_fog
