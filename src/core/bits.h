// Counts of bits, for both sides. On a device those of <bit> must not be called: they are
// constexpr, so nvcc takes them, but what they call exists on the host only, and without a word it
// yields nonsense.
#pragma once

#include "core/macros.h"

#include <bit>
#include <cstdint>

namespace packet {

/// How many zeros come before the highest bit that is set; all bits of 0.
[[nodiscard]] PACKET_INLINE int leading_zeros(std::uint32_t x) noexcept {
#if defined(__CUDA_ARCH__)
    return __clz(static_cast<int>(x));
#else
    return std::countl_zero(x);
#endif
}
[[nodiscard]] PACKET_INLINE int leading_zeros(std::uint64_t x) noexcept {
#if defined(__CUDA_ARCH__)
    return __clzll(static_cast<long long>(x));
#else
    return std::countl_zero(x);
#endif
}

/// How many bits are set.
[[nodiscard]] PACKET_INLINE int set_bits(std::uint64_t x) noexcept {
#if defined(__CUDA_ARCH__)
    return __popcll(x);
#else
    return std::popcount(x);
#endif
}

/// The least power of 2 that is not below x, up to 2^63; 1 for 0.
[[nodiscard]] PACKET_INLINE std::uint64_t ceil_to_power_of_2(std::uint64_t x) noexcept {
    return x <= 1 ? 1 : std::uint64_t{1} << (64 - leading_zeros(x - 1));
}

}  // namespace packet
