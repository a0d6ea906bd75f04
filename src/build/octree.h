// Octree: space is cut in the middle of all three axes at once, until few triangles are left in a
// cell.
#pragma once

#include "build/hierarchy.h"

#include <packet/accel.h>

namespace packet {

/// Builds over triangles. Each is referred to in every leaf whose cell it overlaps, by the box of
/// its part in there; every point of it is in one of these boxes. Cells are
/// 2^-options.octree_levels of the root's at least, and there are at most
/// options.max_reference_factor references a triangle; what is still too many for a leaf then is
/// dealt out to nodes that may overlap. Every leaf holds at most `options.max_leaf_size`
/// references; no leaf is deeper than kMaxDepth. Brings its own 8-wide form, a node for each cell.
/// O(n log n) time; parallel; the result does not depend on the number of threads.
[[nodiscard]] Hierarchy build_octree(MeshView mesh, ScratchVector<Reference> references,
                                     const BuildOptions& options, const Parallel& parallel);

}  // namespace packet
