// The binary radix tree over sorted Morton codes: each node covers a range of them, and splits it
// where the highest bit in which its first and last differ turns from 0 to 1. Each node finds its
// range by itself, from the codes around it.
//
// Karras. Maximizing parallelism in the construction of BVHs, octrees, and k-d trees. HPG 2012.
#pragma once

#include "core/bits.h"
#include "core/views.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace packet {

/// A Morton code and the index of what it belongs to.
template <class Code>
struct MortonItem {
    Code code;
    std::uint32_t index;
};

/// What an inner node covers: items `first` to `last`, those up to `split` by the first child. A
/// child with one item is that leaf; else it is inner node `split` or `split + 1`.
struct RadixNode {
    std::uint32_t first, last, split;

    friend bool operator==(const RadixNode&, const RadixNode&) = default;
};

/// How many leading bits keys i and j have in common. Keys are codes, of which the low
/// `dropped_bits` are taken as equal, and then the bits of their position, which tell equal codes
/// apart.
template <class Code>
[[nodiscard]] PACKET_INLINE int common_bits(Code code_i, Code code_j, std::int64_t i,
                                            std::int64_t j, int dropped_bits) noexcept {
    constexpr int kCodeBits = 8 * sizeof(Code);
    const Code difference = (code_i ^ code_j) >> dropped_bits;
    if (difference != 0) return leading_zeros(difference);
    return kCodeBits + leading_zeros(static_cast<std::uint32_t>(i ^ j));
}

/// Sorted keys.
template <class Code>
class RadixKeys {
public:
    explicit RadixKeys(std::span<const MortonItem<Code>> sorted, int dropped_bits = 0)
        : sorted_(sorted), dropped_bits_(dropped_bits) {}

    [[nodiscard]] std::size_t size() const noexcept { return sorted_.size(); }

    /// -1 if there is no j.
    [[nodiscard]] int common_bits(std::int64_t i, std::int64_t j) const noexcept {
        if (j < 0 || j >= static_cast<std::int64_t>(size())) return -1;
        return packet::common_bits(code(i), code(j), i, j, dropped_bits_);
    }
    /// Where the tree parts the range: the last item that goes to the first child.
    [[nodiscard]] std::uint32_t split(std::uint32_t first, std::uint32_t last) const noexcept {
        const int bits = common_bits(first, last);
        std::uint32_t end = last;  // the first that has no more in common with `first`
        while (end - first > 1) {
            const std::uint32_t middle = first + (end - first) / 2;
            if (common_bits(first, middle) > bits) {
                first = middle;
            } else {
                end = middle;
            }
        }
        return first;
    }

private:
    [[nodiscard]] Code code(std::int64_t i) const noexcept {
        return sorted_[static_cast<std::size_t>(i)].code;
    }

    std::span<const MortonItem<Code>> sorted_;
    int dropped_bits_;
};

/// How many low bits of `code_bits` to drop so that the tree over n codes is no deeper than
/// kMaxDepth whatever they are. Each edge on the way down goes to a lower bit of the key, and the
/// key then has at most kMaxDepth that are not the same for all: those of the code, and the
/// bit_width(n - 1) of a position.
[[nodiscard]] constexpr int dropped_bits_for_depth(int code_bits, std::size_t n) noexcept {
    return std::max(0, code_bits + static_cast<int>(std::bit_width(n - 1)) - kMaxDepth);
}

/// Inner node i of the n - 1 over n keys; node 0 is the root, over all. O(log n). `Keys` has
/// common_bits() as RadixKeys.
template <class Keys>
[[nodiscard]] constexpr RadixNode radix_node(const Keys& keys, std::uint32_t index) noexcept {
    const std::int64_t i = index;
    // The range extends from i to the side whose neighbour has more in common with it.
    const std::int64_t d = keys.common_bits(i, i + 1) > keys.common_bits(i, i - 1) ? 1 : -1;
    // What lies within has more bits in common with i than the other neighbour has.
    const int outside = keys.common_bits(i, i - d);
    std::int64_t most = 2;
    while (keys.common_bits(i, i + most * d) > outside) most *= 2;
    std::int64_t length = 0;
    for (std::int64_t step = most / 2; step > 0; step /= 2) {
        if (keys.common_bits(i, i + (length + step) * d) > outside) length += step;
    }
    const std::int64_t end = i + length * d;
    // The last one that has more in common with i than the end has is next to the split.
    const int within = keys.common_bits(i, end);
    std::int64_t same = 0;
    const std::uint64_t steps = ceil_to_power_of_2(static_cast<std::uint64_t>(length));
    for (auto step = static_cast<std::int64_t>(steps / 2); step > 0; step /= 2) {
        if (keys.common_bits(i, i + (same + step) * d) > within) same += step;
    }
    const std::int64_t split = i + same * d + std::min<std::int64_t>(d, 0);
    return {static_cast<std::uint32_t>(std::min(i, end)),
            static_cast<std::uint32_t>(std::max(i, end)), static_cast<std::uint32_t>(split)};
}

}  // namespace packet
