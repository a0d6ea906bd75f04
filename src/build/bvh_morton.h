// Linear bounding volume hierarchy: triangles sorted along a curve through space, and a tree over
// the digits of where they are on it. The fastest to build.
#pragma once

#include "build/hierarchy.h"

#include <packet/accel.h>

namespace packet {

/// Builds over any boxes, by the Morton codes of their centroids (options.morton_bits). Subtrees of
/// at most `options.max_leaf_size` references become leaves where the costs in `options` say that
/// these are cheaper. No leaf is deeper than kMaxDepth. O(n) time but for the searches of a node's
/// range, which are O(log n) and mostly short; 120 bytes of nodes and scratch a reference beside
/// the references; parallel throughout, and the result does not depend on the number of threads.
[[nodiscard]] Hierarchy build_bvh_morton(ScratchVector<Reference> references,
                                         const BuildOptions& options, const Parallel& parallel);

/// How many bits the codes of so many references have: 30 or 63.
[[nodiscard]] int chosen_morton_bits(std::size_t references, const BuildOptions& options);

}  // namespace packet
