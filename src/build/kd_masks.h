// The surface area heuristic for the cells within a small cell: each place where one of its boxes
// starts or ends has a word that tells which boxes start before it and one that tells which end
// behind. For any set of the boxes a plane there then costs two intersections of words to count.
//
// Zhou, Hou, Wang, Guo. Real-time KD-tree construction on graphics hardware. SIGGRAPH Asia 2008.
#pragma once

#include "build/kd_cell.h"
#include "build/kd_range.h"

namespace packet {

/// Of the references of a small cell, bit i for reference i.
using KdSet = std::uint64_t;
inline constexpr std::size_t kMaxSetSize = 64;

class KdMasks {
public:
    /// For at most kMaxSetSize references.
    explicit KdMasks(std::span<const Reference> references);

    /// The cheapest allowed plane for a cell that holds parts of the references of `set`, if it is
    /// cheaper than a leaf. Counts them as if they had not been cut further since.
    [[nodiscard]] KdPlane find_cheapest_plane(KdSet set, const KdRange& cell,
                                              const BuildOptions& options) const noexcept;

private:
    struct Place {
        float position;
        KdSet starts, ends;    ///< boxes that start or end here; flat ones do both
        KdSet before, behind;  ///< boxes that start before, and that end behind it
    };
    /// The places along an axis, in order.
    struct Axis {
        std::array<Place, 2 * kMaxSetSize> places;
        std::size_t count = 0;
    };
    static void fill(std::span<const Reference> references, int axis, Axis& out);
    static void sweep(const Axis& places, int axis, KdSet set, const KdRange& cell,
                      const KdCost& cost, KdPlane& best) noexcept;

    std::array<Axis, 3> axes_;
};

}  // namespace packet
