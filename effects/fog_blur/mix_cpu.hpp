// How fog_blur's levels become one picture, on the CPU.
#pragma once

#include "fog_blur/cells_cpu.hpp"

namespace fog_blur {

// The weighted sum of four nodes for each pixel; nodes[0] is the sharp picture. Every pixel's four weights
// lie beside each other, as its four channels do.
template <class Vector, class Load>
BRUME_INLINE Vector sumOfNodes(Vector weights, Load at) {
    using blur::channel;
    return ((channel<0>(weights) * at(0) + channel<1>(weights) * at(1)) + channel<2>(weights) * at(2)) +
           channel<3>(weights) * at(3);
}
// The same of a row; meanwhile as many pixels of row `soon` are asked for.
template <class Wide>
BRUME_INLINE void mixBy(float* out, const Places& places, const float* nodeWeights, const float* const* nodes,
                        int count, const float* soon) {
    typedef typename Wide::Four Four;
    auto rowAt = [&](int i, int next) __attribute__((always_inline)) {
        return *(const One*)(nodeWeights + 4 * (places.entry[i] + next));
    };
    auto fourRows = [&](int i, int next) __attribute__((always_inline)) {
        return Wide::of(rowAt(i, next), rowAt(i + 1, next), rowAt(i + 2, next), rowAt(i + 3, next));
    };
    int i = 0;
    auto mixOne = [&](int at) __attribute__((always_inline)) {
        const One below = rowAt(at, 0), weights = below + places.share[at] * (rowAt(at, 1) - below);
        const float* const* node = nodes + places.first[at];
        *(One*)(out + 4 * at) = sumOfNodes(
            weights, [&](int k) __attribute__((always_inline)) { return *(const One*)(node[k] + 4 * at); });
    };
    for (; i + 4 <= count; i += 4) {
        const int first = places.first[i];
        __builtin_prefetch(soon + 4 * i);
        if (places.first[i + 1] == first && places.first[i + 2] == first && places.first[i + 3] == first) {
            const Four below = fourRows(i, 0),
                       weights = below + blur::spread<Wide>(places.share + i) * (fourRows(i, 1) - below);
            const float* const* node = nodes + first;
            Wide::store(out + 4 * i, sumOfNodes(
                                         weights, [&](int k) __attribute__((always_inline)) {
                                             return Wide::load(node[k] + 4 * i);
                                         }));
        } else {
            for (int k = 0; k < 4; k++) mixOne(i + k);
        }
    }
    for (; i < count; i++) mixOne(i);
}
BRUME_WIDE(void, mix,
           (float* out, const Places& places, const float* nodeWeights, const float* const* nodes, int count,
            const float* soon),
           (out, places, nodeWeights, nodes, count, soon))

// Divides by the weight; where hardly any is left, the pixel itself makes up for it.
template <class Wide>
BRUME_INLINE void divideBy(float* out, const float* sharp, int count) {
    typedef typename Wide::Four Four;
    float sums[cellWidth], inverse[cellWidth], missing[cellWidth];
    for (int i = 0; i < count; i++) sums[i] = out[4 * i + 3];
    for (int i = 0; i < count; i++) {
        const float weight = std::max(sums[i], 0.05f);
        inverse[i] = 1.0f / weight;
        missing[i] = weight - sums[i];
    }
    int i = 0;
    for (; i + 4 <= count; i += 4) {
        const Four self = Wide::load(sharp + 4 * i), sum = Wide::load(out + 4 * i);
        Wide::store(out + 4 * i,
                    (sum + blur::spread<Wide>(missing + i) * self) * blur::spread<Wide>(inverse + i));
    }
    for (; i < count; i++) {
        const One self = *(const One*)(sharp + 4 * i), sum = *(const One*)(out + 4 * i);
        *(One*)(out + 4 * i) = (sum + missing[i] * self) * inverse[i];
    }
}
BRUME_WIDE(void, divide, (float* out, const float* sharp, int count), (out, sharp, count))

}  // namespace fog_blur
