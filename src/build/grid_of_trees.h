// A coarse grid whose crowded cells hold trees of their own: it builds about as fast as a grid, and
// a small dense mesh in a large sparse one (the teapot in the stadium) does not crowd a few cells.
#pragma once

#include "build/tree.h"

namespace packet {

/// Builds over a mesh's triangles: a grid of fewer cells than options.grid_density says, and in
/// cells with more than a few triangles a tree by the surface area heuristic over the parts of
/// triangles in the cell. O(n log n) time, parallel; the result does not depend on the number of
/// threads.
[[nodiscard]] Tree build_grid_of_trees(MeshView mesh, const ScratchVector<Reference>& references,
                                       const BuildOptions& options, const Parallel& parallel);

}  // namespace packet
