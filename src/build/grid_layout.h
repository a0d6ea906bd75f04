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

/// With what probability a random ray that meets the grid meets a certain cell: the ratio of their
/// areas. (Cells are all about the same size.)
[[nodiscard]] double cell_share(const GridSpace& space);

}  // namespace packet
