// Stable parallel sort by an integer key, least significant digit first. Each pass counts digits in
// pieces, adds up where the digits of each piece go, and moves the pieces' items there.
//
// Satish, Harris, Garland. Designing efficient sorting algorithms for manycore GPUs. IPDPS 2009.
#pragma once

#include "core/macros.h"
#include "schedule/parallel.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace packet {

/// How many items have each digit of kBits bits. The first-level cache is to hold a line for each
/// digit: 8 bits are right for any, 9 where that saves a pass.
template <int kBits>
using RadixCounts = std::array<std::uint32_t, 1u << kBits>;

/// Turns counts of digits, by piece, into the place of each piece's first item of each digit.
/// Returns whether all items have the same digit.
template <int kBits>
bool scan_digits(std::span<RadixCounts<kBits>> pieces, std::size_t item_count) {
    std::uint32_t place = 0;
    bool is_one_digit = false;
    for (std::size_t digit = 0; digit < std::size_t{1} << kBits; ++digit) {
        const std::uint32_t first = place;
        for (RadixCounts<kBits>& counts : pieces) place += std::exchange(counts[digit], place);
        is_one_digit |= place - first == item_count;
    }
    return is_one_digit;
}

/// Sorts `items` by the low `bits` bits of key(item), an unsigned integer; equal ones keep their
/// order. `scratch` is as large as `items`, of fewer than 2^32; the one of the two spans that is
/// returned holds the result, the other one nothing of use. O(n bits) time, parallel.
template <class Item, int kDigitBits = 8, class KeyOf>
[[nodiscard]] std::span<Item> radix_sort(std::span<Item> items, std::span<Item> scratch, int bits,
                                         const Parallel& parallel, KeyOf key) {
    PACKET_ASSERT(scratch.size() == items.size());
    // Large against the counts of a piece, small enough for a few pieces a thread.
    constexpr std::size_t kGrain = 65536;
    std::vector<RadixCounts<kDigitBits>> places((items.size() + kGrain - 1) / kGrain);
    for (int shift = 0; shift < bits; shift += kDigitBits) {
        const auto digit = [&](const Item& item) {
            return static_cast<std::size_t>(key(item) >> shift) % (std::size_t{1} << kDigitBits);
        };
        parallel.for_pieces(items.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            RadixCounts<kDigitBits> counts{};
            for (std::size_t i = begin; i < end; ++i) ++counts[digit(items[i])];
            places[begin / kGrain] = counts;
        });
        if (scan_digits<kDigitBits>(places, items.size())) continue;
        parallel.for_pieces(items.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            RadixCounts<kDigitBits> next = places[begin / kGrain];
            for (std::size_t i = begin; i < end; ++i) scratch[next[digit(items[i])]++] = items[i];
        });
        std::swap(items, scratch);
    }
    return items;
}

}  // namespace packet
