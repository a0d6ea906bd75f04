// Bounding volume hierarchy by the surface area heuristic over bins of centroids. Large subtrees
// then move (reinsertion.h).
#pragma once

#include "build/hierarchy.h"

#include <packet/accel.h>

namespace packet {

/// Builds over any boxes. Every leaf holds at most `options.max_leaf_size` references; no leaf is
/// deeper than kMaxDepth. O(n log n) time, 64 bytes of scratch a reference beside the references,
/// parallel; the result does not depend on the number of threads.
[[nodiscard]] Hierarchy build_bvh_sah(ScratchVector<Reference> references,
                                      const BuildOptions& options, const Parallel& parallel);

/// The same in less time. Many references are first sorted into cells of a grid over their
/// centroids; the tree's upper part has cells for leaves, and each cell's own part is built below.
/// Nodes of the upper part cannot cut a cell: the tree's expected cost is up to a seventh higher,
/// in some scenes lower. 36 bytes of scratch a reference more.
///
/// Garanzha, Premoze, Bely, Galaktionov. Grid-based SAH BVH construction on a GPU. The Visual
/// Computer 2011.
[[nodiscard]] Hierarchy build_bvh_sah_by_cells(ScratchVector<Reference> references,
                                               const BuildOptions& options,
                                               const Parallel& parallel);

}  // namespace packet
