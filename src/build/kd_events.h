// The surface area heuristic over every place where the box of a triangle's part begins or ends.
// The places are sorted once; a cut only filters them and merges in those of the parts it made, so
// a tree of n references takes O(n log n).
//
// Wald, Havran. On building fast kd-trees for ray tracing, and on doing that in O(N log N).
// Interactive Ray Tracing 2006.
#pragma once

#include "build/kd_cell.h"

namespace packet {

/// Events name references by 30 bits.
inline constexpr std::size_t kMaxEventReferences = std::size_t{1} << 30;

[[nodiscard]] EventLists make_events(const ScratchVector<Reference>& references,
                                     const Parallel& parallel);

/// The cheapest allowed plane, if it is cheaper than a leaf; it needs `cell.events`.
[[nodiscard]] KdPlane find_cheapest_plane(const KdCell& cell, const BuildOptions& options,
                                          const Parallel& parallel);

/// Hands the parent's events down to the children.
void split_events(const EventLists& parent, KdChildren& children, const Parallel& parallel);

}  // namespace packet
