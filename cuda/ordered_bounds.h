// Boxes that many threads extend at once. Atomics know least and greatest of integers only, so
// floats become integers of the same order. (-0 comes before 0 there; what is joined should have no
// -0.)
#pragma once

#include "device.h"

#include <packet/bounds.h>

#include <bit>
#include <cstdint>

namespace packet::cuda {

[[nodiscard]] constexpr std::uint32_t to_ordered(float x) noexcept {
    const auto bits = std::bit_cast<std::uint32_t>(x);
    return (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
}
[[nodiscard]] constexpr float from_ordered(std::uint32_t ordered) noexcept {
    const bool positive = (ordered & 0x80000000u) != 0;
    return std::bit_cast<float>(positive ? ordered & 0x7FFFFFFFu : ~ordered);
}

struct OrderedBounds {
    std::uint32_t lower[3], upper[3];

    /// As Bounds3f is at first.
    [[nodiscard]] static constexpr OrderedBounds empty() noexcept { return from(Bounds3f{}); }
    [[nodiscard]] static constexpr OrderedBounds from(const Bounds3f& box) noexcept {
        return {{to_ordered(box.lower.x), to_ordered(box.lower.y), to_ordered(box.lower.z)},
                {to_ordered(box.upper.x), to_ordered(box.upper.y), to_ordered(box.upper.z)}};
    }
    [[nodiscard]] constexpr Bounds3f bounds() const noexcept {
        return {{from_ordered(lower[0]), from_ordered(lower[1]), from_ordered(lower[2])},
                {from_ordered(upper[0]), from_ordered(upper[1]), from_ordered(upper[2])}};
    }
};

/// The warp's least or greatest, in all its lanes.
PACKET_DEVICE std::uint32_t warp_min(std::uint32_t value) {
    for (int bit = 16; bit != 0; bit /= 2) {
        const std::uint32_t other = __shfl_xor_sync(kFullWarp, value, bit);
        value = other < value ? other : value;
    }
    return value;
}
PACKET_DEVICE std::uint32_t warp_max(std::uint32_t value) { return ~warp_min(~value); }

/// One lane extends the box.
PACKET_DEVICE void extend_atomically(OrderedBounds& box, const OrderedBounds& by) {
    for (int a = 0; a < 3; ++a) {
        atomicMin(&box.lower[a], by.lower[a]);
        atomicMax(&box.upper[a], by.upper[a]);
    }
}
/// All lanes of the warp extend the box together, by one atomic for all of them.
PACKET_DEVICE void extend_by_warp(OrderedBounds& box, const OrderedBounds& by) {
    for (int a = 0; a < 3; ++a) {
        const std::uint32_t lower = warp_min(by.lower[a]), upper = warp_max(by.upper[a]);
        if (lane_id() == 0) {
            atomicMin(&box.lower[a], lower);
            atomicMax(&box.upper[a], upper);
        }
    }
}

}  // namespace packet::cuda
