// The surface area heuristic for the cells within a small cell: each place where one of its boxes
// starts or ends has a word that tells which boxes start before it and one that tells which end
// behind. For any set of the boxes a plane there then costs two intersections of words to count.
//
// Zhou, Hou, Wang, Guo. Real-time KD-tree construction on graphics hardware. SIGGRAPH Asia 2008.
#pragma once

#include "build/kd_plane.h"
#include "build/kd_range.h"
#include "core/bits.h"

#include <array>
#include <cstdint>
#include <span>

namespace packet {

/// Of the references of a small cell, bit i for reference i.
using KdSet = std::uint64_t;
inline constexpr std::size_t kMaxSetSize = 64;

/// A place where boxes start or end.
struct KdMaskPlace {
    float position;
    KdSet starts, ends;    ///< boxes that start or end here; flat ones do both
    KdSet before, behind;  ///< boxes that start before, and that end behind it

    /// Whether the place is one of a cell that holds parts of `set`. Cuts have moved the others.
    [[nodiscard]] PACKET_INLINE bool is_of(KdSet set, const Bounds3f& cell,
                                           int axis) const noexcept {
        return ((starts | ends) & set) != 0 && cell.lower[axis] <= position &&
               position <= cell.upper[axis];
    }
};

/// Looks at the planes across one axis at a place of a cell of `set`. Of the boxes that start
/// behind it, `next_start` is the first.
PACKET_INLINE void consider_planes(const KdMaskPlace& place, KdSet set, float next_start, int axis,
                                   KdSearch<KdRange>& search) noexcept {
    const float p = place.position;
    const auto below = static_cast<std::size_t>(set_bits(place.before & set));
    const auto above = static_cast<std::size_t>(set_bits(place.behind & set));
    const KdSet in_plane = set & ~(place.before | place.behind);
    const std::size_t flat = in_plane == 0 ? 0 : static_cast<std::size_t>(set_bits(in_plane));
    if ((place.starts & place.behind & set) != 0) next_start = p;
    // Nothing lies between a plane that cuts nothing and where the next box starts.
    const bool is_gap = below + flat + above == search.cell.count;
    search.consider(axis, p, p, is_gap ? next_start : p, {{below + flat, above}}, 0);
    if (flat != 0) search.consider(axis, p, p, p, {{below, above + flat}}, 1);
}

class KdMasks {
public:
    /// For at most kMaxSetSize references.
    explicit KdMasks(std::span<const Reference> references);

    /// The cheapest allowed plane for a cell that holds parts of the references of `set`, if it is
    /// cheaper than a leaf. Counts them as if they had not been cut further since.
    [[nodiscard]] KdPlane find_cheapest_plane(KdSet set, const KdRange& cell,
                                              const KdPrices& prices) const noexcept;

private:
    /// The places along an axis, in order.
    struct Axis {
        std::array<KdMaskPlace, 2 * kMaxSetSize> places;
        std::size_t count = 0;
    };
    static void fill(std::span<const Reference> references, int axis, Axis& out);
    static void sweep(const Axis& places, int axis, KdSet set, KdSearch<KdRange>& search) noexcept;

    std::array<Axis, 3> axes_;
};

}  // namespace packet
