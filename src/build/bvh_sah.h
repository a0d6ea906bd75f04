// Bounding volume hierarchy by the surface area heuristic over bins of centroids.
#pragma once

#include "build/hierarchy.h"

#include <packet/accel.h>

namespace packet {

/// Builds over any boxes. Every leaf holds at most `options.max_leaf_size` references; no leaf is
/// deeper than kMaxDepth. O(n log n) time, 64 bytes of scratch a reference beside the references,
/// parallel; the result does not depend on the number of threads.
[[nodiscard]] Hierarchy build_bvh_sah(ScratchVector<Reference> references,
                                      const BuildOptions& options, const Parallel& parallel);

}  // namespace packet
