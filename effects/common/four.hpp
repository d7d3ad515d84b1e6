// Vectors of four pixels, sixteen floats. GCC 12 takes a vector that is longer than a register through
// memory, a dozen times slower; so kernels are written over a `Wide` and compiled as BRUME_WIDE says: for
// AVX-512, where such a vector is a register, and for others, where it is a pair of them. All give the same
// bits: where a multiplication and an addition are one, rounded once, that is said, Wide::fused.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <type_traits>

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

// From and to any place: as a template's argument a vector is no longer known to be unaligned.
template <class Vector>
struct Anywhere {
    Vector x;
} __attribute__((packed, may_alias));
template <class Vector>
BRUME_INLINE Vector loaded(const float* from) {
    return ((const Anywhere<Vector>*)from)->x;
}
template <class Vector>
BRUME_INLINE void put(float* to, Vector x) {
    ((Anywhere<Vector>*)to)->x = x;
}

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

/// Beyond this two that are added may be infinite: as its bits, which compare as numbers do.
constexpr int mostAdded = std::bit_cast<int>(1e38f);

// Whether all that was looked at is finite, and may be added.
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
        return most <= mostAdded;
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
        return most <= mostAdded;
    }
};

/// The same number everywhere. (By way of four: GCC 12 fills a longer vector number by number.)
template <class Vector>
BRUME_INLINE Vector all(float x) {
    const One one = {x};
    if constexpr (std::is_same_v<Vector, Pair>)
        return {all<Two>(x), all<Two>(x)};
    else if constexpr (sizeof(Vector) == sizeof(One))
        return One{x, x, x, x};
    else if constexpr (sizeof(Vector) == sizeof(Two))
        return __builtin_shufflevector(one, one, 0, 0, 0, 0, 0, 0, 0, 0);
    else
        return __builtin_shufflevector(one, one, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
}
/// a·b + c, rounded once: what one instruction does on most machines, and a library where none does. (Asked
/// of GCC by name, since code compiled for every machine has no such builtin of vectors.)
struct FusedInOne {
    static constexpr bool isInOne = true;
#if defined(__x86_64__)
#define BRUME_FUSED(Vector)                                          \
    static BRUME_INLINE Vector fused(Vector a, Vector b, Vector c) { \
        asm("vfmadd231ps %2, %1, %0" : "+v"(c) : "v"(a), "vm"(b));   \
        return c;                                                    \
    }
    BRUME_FUSED(One)
    BRUME_FUSED(Two)
    BRUME_FUSED(Four)
#undef BRUME_FUSED
    // Past the caches, `to` aligned as the vector is long.
    template <class Vector>
    static BRUME_INLINE void stream(float* to, Vector x) {
        asm volatile("vmovntps %1, %0" : "=m"(((Anywhere<Vector>*)to)->x) : "v"(x));
    }
    static BRUME_INLINE void stream(float* to, const Pair& x) { stream(to, x.low), stream(to + 8, x.high); }
    // A number of memory's everywhere.
    template <class Vector>
    static BRUME_INLINE Vector spreadOne(const float& x) {
        Vector a;
        asm("vbroadcastss %1, %0" : "=v"(a) : "m"(x));
        return a;
    }
#endif
};
struct FusedByEach {
    static constexpr bool isInOne = false;
    template <class Vector>
    static BRUME_INLINE Vector fused(Vector a, Vector b, Vector c) {
        for (size_t k = 0; k < sizeof(Vector) / sizeof(float); k++) c[k] = std::fma(a[k], b[k], c[k]);
        return c;
    }
    template <class Vector>
    static BRUME_INLINE void stream(float* to, const Vector& x) {
        put(to, x);
    }
    template <class Vector>
    static BRUME_INLINE Vector spreadOne(const float& x) {
        return all<Vector>(x);
    }
};

/// What kernels are compiled over: four pixels; a register, for what does not care how many pixels it takes;
/// how many of those may be sums that wait.
template <class Fused>
struct InWhole : Fused {
    typedef blur::Four Four;
    typedef blur::Four Register;
    typedef WholeWatch Watch;
    static constexpr int sums = 8;
    static BRUME_INLINE Four load(const float* from) { return *(const Four*)from; }
    static BRUME_INLINE void store(float* to, Four x) { *(Four*)to = x; }
    static BRUME_INLINE Four of(One a, One b, One c, One d) {
        const Two low = __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7),
                  high = __builtin_shufflevector(c, d, 0, 1, 2, 3, 4, 5, 6, 7);
        return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    }
    // One number a pixel, four times each. (Widening four in a register, GCC 12 goes through memory.)
    static BRUME_INLINE Four spread(const float* numbers) {
        Four a;
#if defined(__x86_64__)
        if constexpr (Fused::isInOne)
            asm("vbroadcastf32x4 %1, %0" : "=v"(a) : "m"(*(const One*)numbers));
        else
#endif
            for (int k = 0; k < 16; k++) a[k] = numbers[k % 4];
        return spreadPart<0>(a);
    }
};
template <class Fused>
struct InHalves : Fused {
    typedef Pair Four;
    typedef Two Register;
    typedef HalvesWatch Watch;
    static constexpr int sums = 4;
    static BRUME_INLINE Four load(const float* from) { return {*(const Two*)from, *(const Two*)(from + 8)}; }
    static BRUME_INLINE void store(float* to, Four x) { *(Two*)to = x.low, *(Two*)(to + 8) = x.high; }
    static BRUME_INLINE Four of(One a, One b, One c, One d) {
        return {__builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7),
                __builtin_shufflevector(c, d, 0, 1, 2, 3, 4, 5, 6, 7)};
    }
    static BRUME_INLINE Four spread(const float* numbers) {
        const One a = *(const One*)numbers;
        const Two twice = __builtin_shufflevector(a, a, 0, 1, 2, 3, 0, 1, 2, 3);
        return {__builtin_shufflevector(twice, twice, 0, 0, 0, 0, 5, 5, 5, 5),
                __builtin_shufflevector(twice, twice, 2, 2, 2, 2, 7, 7, 7, 7)};
    }
    using Fused::fused;
    static BRUME_INLINE Pair fused(const Pair& a, const Pair& b, const Pair& c) {
        return {fused(a.low, b.low, c.low), fused(a.high, b.high, c.high)};
    }
};
typedef InWhole<FusedInOne> Whole;
typedef InHalves<FusedInOne> Halves;
typedef InHalves<FusedByEach> Plain;

/// a·b + c with one number for all.
template <class Wide, class Vector>
BRUME_INLINE Vector fused(float a, Vector b, Vector c) {
    return Wide::fused(all<Vector>(a), b, c);
}

/// BRUME_WIDE(Result, name, (parameters), (arguments)): a function that runs nameBy<Whole>, nameBy<Halves> or
/// nameBy<Plain>, as this machine can. Sanitized it leaves out the first, which takes minutes to compile.
#if defined(__x86_64__) && defined(__OPTIMIZE__)
inline const bool hasHalves = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
                              __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("fma");
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define BRUME_WHOLE(Result, name, parameters, arguments)
#define BRUME_IF_WHOLE(name, arguments)
#else
inline const bool hasWhole = hasHalves && __builtin_cpu_supports("avx512f") &&
                             __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
                             __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
#define BRUME_WHOLE(Result, name, parameters, arguments)                             \
    __attribute__((target("arch=x86-64-v4"))) static Result name##Whole parameters { \
        return name##By<blur::Whole> arguments;                                      \
    }
#define BRUME_IF_WHOLE(name, arguments) \
    if (blur::hasWhole) return name##Whole arguments;
#endif
#define BRUME_WIDE(Result, name, parameters, arguments)                               \
    BRUME_WHOLE(Result, name, parameters, arguments)                                  \
    __attribute__((target("arch=x86-64-v3"))) static Result name##Halves parameters { \
        return name##By<blur::Halves> arguments;                                      \
    }                                                                                 \
    static Result name##Plain parameters { return name##By<blur::Plain> arguments; }  \
    static inline Result name parameters {                                            \
        BRUME_IF_WHOLE(name, arguments)                                               \
        return blur::hasHalves ? name##Halves arguments : name##Plain arguments;      \
    }
#else
constexpr bool hasHalves = false;
#define BRUME_WIDE(Result, name, parameters, arguments) \
    static inline Result name parameters { return name##By<blur::Plain> arguments; }
#endif

}  // namespace blur
