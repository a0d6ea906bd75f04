// Boxes in registers of four lanes, x, y, z and one to spare: what builders do to every reference
// at every level of a tree is done to all axes at once. The only file here that names xsimd's
// types; it asks for no more than the baseline's instructions.
#pragma once

#include "build/references.h"
#include "core/macros.h"

#include <xsimd/xsimd.hpp>

#include <bit>
#include <cstdint>
#include <limits>

namespace packet {

using Lanes = xsimd::make_sized_batch_t<float, 4>;

[[nodiscard]] PACKET_INLINE Lanes load_lanes(const glm::vec3& v) noexcept {
    alignas(16) const float lane[4] = {v.x, v.y, v.z, 0.0f};
    return Lanes::load_aligned(lane);
}
[[nodiscard]] PACKET_INLINE glm::vec3 store_lanes(Lanes lanes) noexcept {
    alignas(16) float lane[4];
    lanes.store_aligned(lane);
    return {lane[0], lane[1], lane[2]};
}

/// The corners of a reference's box. The last lane of one holds the id's bits: it means nothing.
[[nodiscard]] PACKET_INLINE Lanes lower_lanes(const Reference& r) noexcept {
    return Lanes::load_unaligned(reinterpret_cast<const float*>(&r));
}
[[nodiscard]] PACKET_INLINE Lanes upper_lanes(const Reference& r) noexcept {
    return Lanes::load_unaligned(reinterpret_cast<const float*>(&r) + 4);
}

/// With 0 for the last lane.
[[nodiscard]] PACKET_INLINE Lanes without_last(Lanes lanes) noexcept {
    constexpr auto kAll = std::bit_cast<float>(0xFFFFFFFFu);
    alignas(16) static constexpr float kMask[4] = {kAll, kAll, kAll, 0.0f};
    return lanes & Lanes::load_aligned(kMask);
}

/// A box whose last lane means nothing; empty at first.
struct LaneBox {
    Lanes lower = Lanes(std::numeric_limits<float>::infinity());
    Lanes upper = Lanes(-std::numeric_limits<float>::infinity());

    PACKET_INLINE void extend(Lanes low, Lanes high) noexcept {
        lower = xsimd::min(lower, low);
        upper = xsimd::max(upper, high);
    }
    PACKET_INLINE void extend(const LaneBox& other) noexcept { extend(other.lower, other.upper); }
    [[nodiscard]] PACKET_INLINE Bounds3f bounds() const noexcept {
        return {store_lanes(lower), store_lanes(upper)};
    }
};

[[nodiscard]] PACKET_INLINE LaneBox lane_box(const Reference& r) noexcept {
    return {lower_lanes(r), upper_lanes(r)};
}
[[nodiscard]] PACKET_INLINE LaneBox lane_box(const Bounds3f& b) noexcept {
    return {load_lanes(b.lower), load_lanes(b.upper)};
}

/// As Bounds3f::half_area(), to the bit.
[[nodiscard]] PACKET_INLINE float half_area(const LaneBox& box) noexcept {
    const glm::vec3 e = store_lanes(box.upper - box.lower);
    return e.x * e.y + e.y * e.z + e.z * e.x;
}

/// Half the surfaces of three boxes; those of empty ones are 0. The last lane means nothing.
[[nodiscard]] PACKET_INLINE Lanes half_areas(const LaneBox (&box)[3]) noexcept {
    const Lanes zero(0.0f);
    const Lanes a = xsimd::max(box[0].upper - box[0].lower, zero);
    const Lanes b = xsimd::max(box[1].upper - box[1].lower, zero);
    const Lanes c = xsimd::max(box[2].upper - box[2].lower, zero);
    // Transposed: x of all boxes, y and z.
    const Lanes ac_xy = xsimd::zip_lo(a, c), bb_xy = xsimd::zip_lo(b, b);
    const Lanes x = xsimd::zip_lo(ac_xy, bb_xy), y = xsimd::zip_hi(ac_xy, bb_xy);
    const Lanes z = xsimd::zip_lo(xsimd::zip_hi(a, c), xsimd::zip_hi(b, b));
    return x * y + y * z + z * x;
}

}  // namespace packet
