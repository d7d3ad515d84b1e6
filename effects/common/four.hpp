// Vectors of four pixels, sixteen floats. GCC 12 takes a vector that is longer than a register through
// memory, a dozen times slower; so kernels are written over a `Wide` and compiled as BRUME_WIDE says: for
// AVX-512, where such a vector is a register, and for others, where it is a pair of them. Both give the same
// bits.
#pragma once

#include <algorithm>

#include "effect/kit/math.hpp"

namespace blur {

// Four pixels, two, one; unaligned.
typedef float Four __attribute__((vector_size(64), aligned(4), may_alias));
typedef float Two __attribute__((vector_size(32), aligned(4), may_alias));
typedef float One __attribute__((vector_size(16), aligned(4), may_alias));

struct Pair {
    Two low, high;

    friend BRUME_INLINE Pair operator+(Pair a, Pair b) { return {a.low + b.low, a.high + b.high}; }
    friend BRUME_INLINE Pair operator-(Pair a, Pair b) { return {a.low - b.low, a.high - b.high}; }
    friend BRUME_INLINE Pair operator*(Pair a, Pair b) { return {a.low * b.low, a.high * b.high}; }
    friend BRUME_INLINE Pair operator+(Pair a, float b) { return {a.low + b, a.high + b}; }
    friend BRUME_INLINE Pair operator*(Pair a, float b) { return {a.low * b, a.high * b}; }
    friend BRUME_INLINE Pair operator*(float a, Pair b) { return {a * b.low, a * b.high}; }
    BRUME_INLINE Pair& operator+=(Pair b) { return low += b.low, high += b.high, *this; }
} __attribute__((may_alias));
static_assert(sizeof(Pair) == 64 && alignof(Pair) == 4);

// Pixels p, q, r, s of the eight of a and b.
template <int p, int q, int r, int s>
BRUME_INLINE Four pixels(Four a, Four b) {
    return __builtin_shufflevector(a, b, 4 * p, 4 * p + 1, 4 * p + 2, 4 * p + 3, 4 * q, 4 * q + 1, 4 * q + 2,
                                   4 * q + 3, 4 * r, 4 * r + 1, 4 * r + 2, 4 * r + 3, 4 * s, 4 * s + 1,
                                   4 * s + 2, 4 * s + 3);
}
template <int part>
BRUME_INLINE Two partOf(const Pair& a, const Pair& b) {
    return part == 0 ? a.low : part == 1 ? a.high : part == 2 ? b.low : b.high;
}
template <int p, int q>
BRUME_INLINE Two pixels(const Pair& a, const Pair& b) {
    constexpr int i = 4 * (p % 2), j = 8 + 4 * (q % 2);
    return __builtin_shufflevector(partOf<p / 2>(a, b), partOf<q / 2>(a, b), i, i + 1, i + 2, i + 3, j, j + 1,
                                   j + 2, j + 3);
}
template <int p, int q, int r, int s>
BRUME_INLINE Pair pixels(const Pair& a, const Pair& b) {
    return {pixels<p, q>(a, b), pixels<r, s>(a, b)};
}

// Of each pixel channel n, four times.
template <int n>
BRUME_INLINE Four channel(Four a) {
    return __builtin_shufflevector(a, a, n, n, n, n, 4 + n, 4 + n, 4 + n, 4 + n, 8 + n, 8 + n, 8 + n, 8 + n,
                                   12 + n, 12 + n, 12 + n, 12 + n);
}
template <int n>
BRUME_INLINE Two channel(Two a) {
    return __builtin_shufflevector(a, a, n, n, n, n, 4 + n, 4 + n, 4 + n, 4 + n);
}
template <int n>
BRUME_INLINE One channel(One a) {
    return __builtin_shufflevector(a, a, n, n, n, n);
}
template <int n>
BRUME_INLINE Pair channel(const Pair& a) {
    return {channel<n>(a.low), channel<n>(a.high)};
}

// Of sixteen numbers those from 4·part on, each four times.
template <int part>
BRUME_INLINE Four spreadPart(Four a) {
    constexpr int i = 4 * part, j = i + 1, k = i + 2, l = i + 3;
    return __builtin_shufflevector(a, a, i, i, i, i, j, j, j, j, k, k, k, k, l, l, l, l);
}
template <int part>
BRUME_INLINE Pair spreadPart(const Pair& a) {
    constexpr int i = 4 * (part % 2), j = i + 1, k = i + 2, l = i + 3;
    const Two half = part < 2 ? a.low : a.high;
    return {__builtin_shufflevector(half, half, i, i, i, i, j, j, j, j),
            __builtin_shufflevector(half, half, k, k, k, k, l, l, l, l)};
}
BRUME_INLINE Four least(Four a, Four b) { return a < b ? a : b; }
BRUME_INLINE Pair least(const Pair& a, const Pair& b) {
    return {a.low < b.low ? a.low : b.low, a.high < b.high ? a.high : b.high};
}

// Whether all that was looked at is finite.
struct WholeWatch {
    typedef int Bits __attribute__((vector_size(64), may_alias));
    Bits largest = {};
    BRUME_INLINE void look(Four x) {
        const Bits bits = (Bits)x & 0x7fffffff;
        largest = bits > largest ? bits : largest;
    }
    BRUME_INLINE bool areFinite() const {
        int most = 0;
        for (int k = 0; k < 16; k++) most = std::max(most, largest[k]);
        return most < 0x7f800000;
    }
};
struct HalvesWatch {
    typedef int Bits __attribute__((vector_size(32), may_alias));
    Bits largest = {};
    BRUME_INLINE void look(Two x) {
        const Bits bits = (Bits)x & 0x7fffffff;
        largest = bits > largest ? bits : largest;
    }
    BRUME_INLINE void look(Pair x) { look(x.low), look(x.high); }
    BRUME_INLINE bool areFinite() const {
        int most = 0;
        for (int k = 0; k < 8; k++) most = std::max(most, largest[k]);
        return most < 0x7f800000;
    }
};

/// What kernels are compiled over: four pixels; a register, for what does not care how many pixels it takes;
/// how many of those may be sums that wait, of how many rows; of four pixels the same.
struct Whole {
    typedef blur::Four Four;
    typedef blur::Four Register;
    typedef WholeWatch Watch;
    static constexpr int sums = 16, acrossSums = 8, alongSums = 8;
    static BRUME_INLINE Four load(const float* from) { return *(const Four*)from; }
    static BRUME_INLINE void store(float* to, Four x) { *(Four*)to = x; }
    static BRUME_INLINE Four of(One a, One b, One c, One d) {
        const Two low = __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7),
                  high = __builtin_shufflevector(c, d, 0, 1, 2, 3, 4, 5, 6, 7);
        return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    }
};
struct Halves {
    typedef Pair Four;
    typedef Two Register;
    typedef HalvesWatch Watch;
    static constexpr int sums = 8, acrossSums = 4, alongSums = 3;
    static BRUME_INLINE Four load(const float* from) { return {*(const Two*)from, *(const Two*)(from + 8)}; }
    static BRUME_INLINE void store(float* to, Four x) { *(Two*)to = x.low, *(Two*)(to + 8) = x.high; }
    static BRUME_INLINE Four of(One a, One b, One c, One d) {
        return {__builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7),
                __builtin_shufflevector(c, d, 0, 1, 2, 3, 4, 5, 6, 7)};
    }
};

// One number a pixel, four times each. (Widening four in a register, GCC 12 goes through memory.)
template <class Wide>
BRUME_INLINE typename Wide::Four spread(const float* numbers);
template <>
BRUME_INLINE Four spread<Whole>(const float* numbers) {
    Four a;
#if defined(__x86_64__)
    asm("vbroadcastf32x4 %1, %0" : "=v"(a) : "m"(*(const One*)numbers));
#else
    for (int k = 0; k < 16; k++) a[k] = numbers[k % 4];
#endif
    return spreadPart<0>(a);
}
template <>
BRUME_INLINE Pair spread<Halves>(const float* numbers) {
    const One a = *(const One*)numbers;
    const Two twice = __builtin_shufflevector(a, a, 0, 1, 2, 3, 4, 5, 6, 7);
    return {__builtin_shufflevector(twice, twice, 0, 0, 0, 0, 5, 5, 5, 5),
            __builtin_shufflevector(twice, twice, 2, 2, 2, 2, 7, 7, 7, 7)};
}

/// BRUME_WIDE(Result, name, (parameters), (arguments)): a function that runs nameBy<Whole> or nameBy<Halves>,
/// as this machine can. Sanitizers cannot run code chosen at load, so they get the halves.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && \
    defined(__OPTIMIZE__)
inline const bool hasWhole = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                             __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                             __builtin_cpu_supports("avx512vl");
#define BRUME_WIDE(Result, name, parameters, arguments)                                                 \
    __attribute__((target("arch=x86-64-v4"))) static Result name##Whole parameters {                    \
        return name##By<blur::Whole> arguments;                                                         \
    }                                                                                                   \
    __attribute__((target_clones("arch=x86-64-v3", "default"))) static Result name##Halves parameters { \
        return name##By<blur::Halves> arguments;                                                        \
    }                                                                                                   \
    static inline Result name parameters {                                                              \
        return blur::hasWhole ? name##Whole arguments : name##Halves arguments;                         \
    }
#else
#define BRUME_WIDE(Result, name, parameters, arguments) \
    static inline Result name parameters { return name##By<blur::Halves> arguments; }
#endif

}  // namespace blur
