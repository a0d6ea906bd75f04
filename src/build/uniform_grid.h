// Uniform grid: the box of a mesh cut into equal cells, each with a list of the triangles in it.
#pragma once

#include "build/tree.h"

namespace packet {

/// Builds over a mesh's triangles; options.grid_density says into how many cells. O(n + references)
/// time, 90 bytes a reference of memory while it builds, parallel; the result does not depend on
/// the number of threads.
[[nodiscard]] Tree build_uniform_grid(MeshView mesh, const ScratchVector<Reference>& references,
                                      const BuildOptions& options, const Parallel& parallel);

}  // namespace packet
