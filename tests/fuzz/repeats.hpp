// A mutator for the parsers of text: deep nesting and long runs, which libFuzzer's own steps, of some bytes
// each, do not come to. Included by one file of a target.
#pragma once

#include <algorithm>
#include <cstring>
#include <random>

#include "fuzz_input.hpp"

extern "C" size_t LLVMFuzzerMutate(uint8_t* data, size_t size, size_t maxSize);

namespace brume::fuzz {

/// Puts `count` more copies of the `length` bytes at `place` behind these.
inline size_t repeat(uint8_t* data, size_t size, size_t place, size_t length, size_t count) {
    uint8_t* const piece = data + place;
    std::memmove(piece + length * (count + 1), piece + length, size - place - length);
    for (size_t i = length; i < length * (count + 1); ++i) piece[i] = piece[i - length];
    return size + length * count;
}

}  // namespace brume::fuzz

/// One time in 32 repeats a piece of the input up to 2^16 times, half of these also a later piece as often,
/// as what opens and what closes; else mutates as usual,
/// long inputs mostly a piece of them, as each takes the time of hundreds.
extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t maxSize, unsigned seed) {
    constexpr size_t usual = 1 << 15;
    std::minstd_rand random(seed);
    const auto below = [&](size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(random); };
    const auto ofAnyScale = [&](int bits) { return (size_t(1) << below(size_t(bits) + 1)) - below(2); };
    if (size > usual && below(8) != 0) {
        std::memmove(data, data + below(size - usual), usual);
        size = usual;
    }
    if (size < 2 || below(32) != 0) return LLVMFuzzerMutate(data, size, maxSize);
    const size_t first = below(size), second = first + below(size - first);
    const size_t firstLength = std::clamp<size_t>(ofAnyScale(6), 1, std::max<size_t>(second - first, 1));
    const size_t secondLength = second > first ? below(2) * std::min(1 + below(4), size - second) : 0;
    const size_t room = (maxSize - size) / (firstLength + secondLength);
    const size_t count = std::min(ofAnyScale(16), room);
    // From behind, so that the first place stays.
    if (secondLength > 0) size = brume::fuzz::repeat(data, size, second, secondLength, count);
    return brume::fuzz::repeat(data, size, first, firstLength, count);
}
