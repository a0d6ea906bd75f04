// A cell of space while a k-d tree is built: what it refers to, what cutting it would cost, and how
// a plane cuts it.
#pragma once

#include "build/cell.h"
#include "build/kd_plane.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace packet {

/// Where boxes begin and end along each axis, in the order in which a plane meets them; kd_events.h
/// says how they are stored.
using EventList = ScratchVector<std::uint64_t>;
using EventLists = std::array<EventList, 3>;

struct KdCell : Cell {
    EventLists events;  ///< kd-sah only
};

/// No cell is cut that is this deep in a tree over so many references. Wald and Havran: deeper cuts
/// do not pay.
[[nodiscard]] int max_cut_depth(std::size_t reference_count) noexcept;

/// By reference, the side it goes to if each gets half of them, by their centroids along the widest
/// axis: for what no plane parts, like triangles that share a vertex.
[[nodiscard]] std::vector<std::uint8_t> sides_of_halves(std::span<const Reference> references,
                                                        const Bounds3f& bounds);

/// Where one of the parent's references is now: 2 * index + side, or kCut.
using KdPlace = std::uint32_t;
inline constexpr KdPlace kCut = 0xFFFFFFFF;

/// The halves of a cell. References that were not cut come first, in their old order.
struct KdChildren {
    std::array<KdCell, 2> cell;
    std::array<std::size_t, 2> whole = {0, 0};  ///< how many are not cut
    std::vector<KdPlace> places;
};

/// Cuts references along with space. No point of a triangle is lost; a child is empty if what the
/// plane seemed to cut off is not there. The children share the spare references by their sizes.
/// On one thread; `parallel` is asked whether to go on.
[[nodiscard]] KdChildren cut_cell(MeshView mesh, const KdCell& cell, const KdPlane& plane,
                                  const Parallel& parallel);

/// Deals the references out to two children that may overlap, half to each.
[[nodiscard]] KdChildren halve_cell(const KdCell& cell, const Parallel& parallel);

}  // namespace packet
