// k-d trees: planes cut space, and the triangles with it, until few are left in a cell.
#pragma once

#include "build/hierarchy.h"

#include <packet/accel.h>

namespace packet {

/// Where a cell is cut.
enum class KdRule {
    kMidpoint,  ///< in the middle, axes in turn
    kMedian,    ///< at the median of its references' centroids, axes in turn
    kSah        ///< where the expected cost of tracing is least, over all axes
};

/// Builds over triangles. Each is referred to in every leaf whose cell it reaches into, by the box
/// of its part in there; every point of it is in one of these boxes. There are at most
/// options.max_reference_factor references a triangle. Every leaf holds at most
/// `options.max_leaf_size` of them; no leaf is deeper than kMaxDepth. O(n log n) time; parallel;
/// the result does not depend on the number of threads. Throws Error{kTooLarge} for more than 2^30
/// triangles by kSah and sorted events.
[[nodiscard]] Hierarchy build_kd_tree(KdRule rule, MeshView mesh,
                                      ScratchVector<Reference> references,
                                      const BuildOptions& options, const Parallel& parallel);

}  // namespace packet
