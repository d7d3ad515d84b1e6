// How fog_blur's levels become one picture, on the CPU.
#pragma once

#include "common/stream.hpp"
#include "fog_blur/cells_cpu.hpp"

namespace fog_blur {

// The weighted sum of four nodes for each pixel; nodes[0] is the sharp picture. Every pixel's four weights
// lie beside each other, as its four channels do.
template <class Wide, class Vector, class Load>
BRUME_INLINE Vector sumOfNodes(Vector weights, Load at) {
    using blur::channel;
    Vector sum = channel<0>(weights) * at(0);
    sum = Wide::fused(channel<1>(weights), at(1), sum);
    sum = Wide::fused(channel<2>(weights), at(2), sum);
    return Wide::fused(channel<3>(weights), at(3), sum);
}

// What a pixel's sum is multiplied by, and what the pixel itself adds before that: the sum is divided by its
// weight, and where hardly any is left, the pixel makes up for it.
template <class Vector>
struct Shares {
    Vector inverse, missing;
};
template <class Vector>
BRUME_INLINE Shares<Vector> sharesOf(Vector weight) {
    const Vector least = Vector{} + 0.05f, enough = weight < least ? least : weight;
    return {1.0f / enough, enough - weight};
}
template <class Wide, class Vector>
BRUME_INLINE Vector divided(Vector sum, Vector self) {
    const auto of = sharesOf(blur::channel<3>(sum));
    return Wide::fused(of.missing, self, sum) * of.inverse;
}
// A division takes as long for two weights eight times as for four.
template <class Wide>
BRUME_INLINE blur::Pair divided(blur::Pair sum, blur::Pair self) {
    const auto of = sharesOf(__builtin_shufflevector(sum.low, sum.high, 3, 3, 11, 11, 7, 7, 15, 15));
    auto spread = [](blur::Two x) __attribute__((always_inline)) {
        return blur::Pair{__builtin_shufflevector(x, x, 0, 0, 0, 0, 4, 4, 4, 4),
                          __builtin_shufflevector(x, x, 2, 2, 2, 2, 6, 6, 6, 6)};
    };
    return Wide::fused(spread(of.missing), self, sum) * spread(of.inverse);
}

BRUME_INLINE Four withAlpha(Four color, Four of) {
    return __builtin_shufflevector(color, of, 0, 1, 2, 19, 4, 5, 6, 23, 8, 9, 10, 27, 12, 13, 14, 31);
}
BRUME_INLINE blur::Pair withAlpha(const blur::Pair& color, const blur::Pair& of) {
    return {__builtin_shufflevector(color.low, of.low, 0, 1, 2, 11, 4, 5, 6, 15),
            __builtin_shufflevector(color.high, of.high, 0, 1, 2, 11, 4, 5, 6, 15)};
}
BRUME_INLINE One withAlpha(One color, One of) { return __builtin_shufflevector(color, of, 0, 1, 2, 7); }

/// A row of the picture from the rows of its levels.
struct MixedRow {
    const Places* places;  ///< none: all of nodes[0]
    const float* nodeWeights;
    const float* const* nodes;
    const float *sharp, *alphas;  ///< pixels
    bool isWeighed;               ///< the fourth channel is a weight to divide by
    const float* soon;            ///< as many pixels are asked for meanwhile
    float* out;
    bool streams;
    int count;
};
template <class Wide, bool isMixed, bool isWeighed, bool streams>
BRUME_INLINE void mixRow(const MixedRow& r) {
    typedef typename Wide::Four Four;
    const int count = r.count;
    const Places* const places = r.places;
    const float *const nodeWeights = r.nodeWeights, *const sharp = r.sharp, *const alphas = r.alphas,
                       *const soon = r.soon;
    const float* const* const nodes = r.nodes;
    float* const out = r.out;
    auto rowAt = [&](int i, int next) __attribute__((always_inline)) {
        return *(const One*)(nodeWeights + 4 * (places->entry[i] + next));
    };
    auto fourRows = [&](int i, int next) __attribute__((always_inline)) {
        return Wide::of(rowAt(i, next), rowAt(i + 1, next), rowAt(i + 2, next), rowAt(i + 3, next));
    };
    auto sumOfOne = [&](int i) __attribute__((always_inline)) {
        if constexpr (!isMixed) return *(const One*)(nodes[0] + 4 * i);
        const One below = rowAt(i, 0),
                  weights = blur::fused<Wide>(places->share[i], rowAt(i, 1) - below, below);
        const float* const* node = nodes + places->first[i];
        return sumOfNodes<Wide>(
            weights, [&](int k) __attribute__((always_inline)) { return *(const One*)(node[k] + 4 * i); });
    };
    auto sumOfFour = [&](int i) __attribute__((always_inline)) {
        if constexpr (!isMixed) return Wide::load(nodes[0] + 4 * i);
        const int first = places->first[i];
        if (places->first[i + 1] != first || places->first[i + 2] != first || places->first[i + 3] != first)
            return Wide::of(sumOfOne(i), sumOfOne(i + 1), sumOfOne(i + 2), sumOfOne(i + 3));
        const Four below = fourRows(i, 0),
                   weights = Wide::fused(Wide::spread(places->share + i), fourRows(i, 1) - below, below);
        const float* const* node = nodes + first;
        return sumOfNodes<Wide>(
            weights, [&](int k) __attribute__((always_inline)) { return Wide::load(node[k] + 4 * i); });
    };
    int i = 0;
    for (; i + 4 <= count; i += 4) {
        __builtin_prefetch(soon + 4 * i);
        Four color = sumOfFour(i);
        if constexpr (isWeighed) color = divided<Wide>(color, Wide::load(sharp + 4 * i));
        color = withAlpha(color, Wide::load(alphas + 4 * i));
        if constexpr (streams)
            brume::streamPixels(out + 4 * i, color);
        else
            Wide::store(out + 4 * i, color);
    }
    for (; i < count; i++) {
        One color = sumOfOne(i);
        if constexpr (isWeighed) color = divided<Wide>(color, *(const One*)(sharp + 4 * i));
        *(One*)(out + 4 * i) = withAlpha(color, *(const One*)(alphas + 4 * i));
    }
}
template <class Wide>
BRUME_INLINE void mixBy(const MixedRow& r) {
    auto with = [&](auto isMixed, auto isWeighed) __attribute__((always_inline)) {
        r.streams ? mixRow<Wide, isMixed, isWeighed, true>(r) : mixRow<Wide, isMixed, isWeighed, false>(r);
    };
    using std::true_type, std::false_type;
    if (r.places)
        r.isWeighed ? with(true_type(), true_type()) : with(true_type(), false_type());
    else
        r.isWeighed ? with(false_type(), true_type()) : with(false_type(), false_type());
}
BRUME_WIDE(void, mix, (const MixedRow& r), (r))

}  // namespace fog_blur
