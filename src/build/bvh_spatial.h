// Bounding volume hierarchy with spatial splits: where children would overlap, triangles are cut.
// Large subtrees then move (reinsertion.h). Where that costs more than no cuts at all, there are
// none.
#pragma once

#include "build/hierarchy.h"

#include <packet/accel.h>

namespace packet {

/// Builds over triangles, of which `references` holds one each. Each is referred to in several
/// leaves, by the boxes of its parts; every point of it is in one of these boxes. There are at most
/// 1 + options.spatial_budget references a triangle. Every leaf holds at most
/// `options.max_leaf_size`; no leaf is deeper than kMaxDepth. O(n log n) time, parallel; the result
/// does not depend on the number of threads.
[[nodiscard]] Hierarchy build_bvh_spatial(MeshView mesh, ScratchVector<Reference> references,
                                          const BuildOptions& options, const Parallel& parallel);

}  // namespace packet
