// From sorted lists of a grid's cells to the arrays that are walked.
#pragma once

#include "build/grid_references.h"
#include "build/tree.h"

namespace packet {

/// Lays out the lists of up to `longest` triangles as blocks; one that fits into a block does not
/// straddle two. The cells of others are left open: {0, 0}. Fills the statistics but for cost and
/// bytes. There is at least one list. O(bricks + triangles of lists), blocks in parallel.
[[nodiscard]] Tree make_grid(const CellLists& cells, std::uint32_t longest, MeshView mesh,
                             const Parallel& parallel);

/// As BuildStats::sah_cost: each cell as a node, and the blocks of lists of up to `longest`.
[[nodiscard]] double expected_cost(const CellLists& cells, std::uint32_t longest,
                                   const BuildOptions& options);

}  // namespace packet
