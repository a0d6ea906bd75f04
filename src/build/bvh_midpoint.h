// Bounding volume hierarchy by the middle of the centroids: quick to build and easy to follow.
#pragma once

#include "build/hierarchy.h"

#include <packet/accel.h>

namespace packet {

/// Builds over any boxes. Each node is split along the axis of the centroids' greatest variance at
/// the middle of their bounds, down to leaves of at most `options.max_leaf_size` references; where
/// that separates nothing, or would lead deeper than kMaxDepth, it is halved. The costs in
/// `options` play no part. O(n log n) time for evenly spread references, O(n kMaxDepth) at worst,
/// 72 bytes of nodes a reference, parallel; the result does not depend on the number of threads.
[[nodiscard]] Hierarchy build_bvh_midpoint(ScratchVector<Reference> references,
                                           const BuildOptions& options, const Parallel& parallel);

}  // namespace packet
