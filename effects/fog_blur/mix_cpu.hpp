// How fog_blur's levels become one picture, on the CPU.
#pragma once

#include "fog_blur/cells_cpu.hpp"

namespace fog_blur {

// The weighted sum of four nodes for each pixel; nodes[0] is the sharp picture. Every pixel's four weights
// lie beside each other, as its four channels do.
template <class Pixels>
BRUME_INLINE typename Pixels::Vector sumOfNodes(typename Pixels::Vector weights, const float* const* node,
                                                int i) {
    typedef typename Pixels::Vector Vector;
    auto at = [&](int k) { return *(const Vector*)(node[k] + 4 * i); };
    auto weight = [&](auto k) {
        constexpr int n = k;
        if constexpr (sizeof(Vector) == sizeof(Four))
            return __builtin_shufflevector(weights, weights, n, n, n, n, 4 + n, 4 + n, 4 + n, 4 + n, 8 + n,
                                           8 + n, 8 + n, 8 + n, 12 + n, 12 + n, 12 + n, 12 + n);
        else
            return __builtin_shufflevector(weights, weights, n, n, n, n);
    };
    using std::integral_constant;
    return ((weight(integral_constant<int, 0>()) * at(0) + weight(integral_constant<int, 1>()) * at(1)) +
            weight(integral_constant<int, 2>()) * at(2)) +
           weight(integral_constant<int, 3>()) * at(3);
}
// The same of a row; meanwhile as many pixels of row `soon` are asked for.
BRUME_VECTORISE static void mix(float* out, const Places& places, const float* nodeWeights,
                                const float* const* nodes, int count, const float* soon) {
    auto rowAt = [&](int i, int next) { return *(const One*)(nodeWeights + 4 * (places.entry[i] + next)); };
    auto fourRows = [&](int i, int next) {
        const blur::Two a = __builtin_shufflevector(rowAt(i, next), rowAt(i + 1, next), 0, 1, 2, 3, 4, 5, 6,
                                                    7),
                        b = __builtin_shufflevector(rowAt(i + 2, next), rowAt(i + 3, next), 0, 1, 2, 3, 4, 5,
                                                    6, 7);
        return (Four)__builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    };
    int i = 0;
    auto mixOne = [&](int at) {
        const One below = rowAt(at, 0), weights = below + places.share[at] * (rowAt(at, 1) - below);
        *(One*)(out + 4 * at) = sumOfNodes<blur::Ones>(weights, nodes + places.first[at], at);
    };
    for (; i + 4 <= count; i += 4) {
        const int first = places.first[i];
        __builtin_prefetch(soon + 4 * i);
        if (places.first[i + 1] == first && places.first[i + 2] == first && places.first[i + 3] == first) {
            const Four below = fourRows(i, 0),
                       weights = below + spread(places.share + i) * (fourRows(i, 1) - below);
            *(Four*)(out + 4 * i) = sumOfNodes<blur::Fours>(weights, nodes + first, i);
        } else {
            for (int k = 0; k < 4; k++) mixOne(i + k);
        }
    }
    for (; i < count; i++) mixOne(i);
}

// Divides by the weight; where hardly any is left, the pixel itself makes up for it.
BRUME_VECTORISE static void divide(float* out, const float* sharp, int count) {
    float sums[cellWidth], inverse[cellWidth + spreadMargin], missing[cellWidth + spreadMargin];
    for (int i = 0; i < count; i++) sums[i] = out[4 * i + 3];
    for (int i = 0; i < count; i++) {
        const float weight = std::max(sums[i], 0.05f);
        inverse[i] = 1.0f / weight;
        missing[i] = weight - sums[i];
    }
    int i = 0;
    for (; i + 4 <= count; i += 4) {
        const Four self = *(const Four*)(sharp + 4 * i), sum = *(const Four*)(out + 4 * i);
        *(Four*)(out + 4 * i) = (sum + spread(missing + i) * self) * spread(inverse + i);
    }
    for (; i < count; i++) {
        const One self = *(const One*)(sharp + 4 * i), sum = *(const One*)(out + 4 * i);
        *(One*)(out + 4 * i) = (sum + missing[i] * self) * inverse[i];
    }
}

}  // namespace fog_blur
