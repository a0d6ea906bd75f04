// Which cells of a grid triangles overlap, and those cells' triangles in order.
#pragma once

#include "build/grid_space.h"

#include <packet/accel.h>

#include <cstdint>
#include <vector>

namespace packet {

/// The triangles of a cell that has any: ids `first` to `first + count`.
struct CellList {
    std::uint32_t cell;  ///< as GridSpace numbers it
    std::uint32_t first, count;
};

/// What the cells hold. Lists are in the order of their cells' numbers, ids ascend in each.
struct CellLists {
    GridSpace space;
    ScratchVector<CellList> lists;
    ScratchVector<std::uint32_t> ids;  ///< of triangles
};

/// Cuts the box of the triangles into about `cells_per_triangle` each, or as many fewer as keep
/// references within options.max_reference_factor times the triangles, and sorts them into the
/// cells. A triangle is referred to by each cell that it overlaps, by an exact test, of those that
/// its box reaches into (GridSpace::range_of): each of its points lies in such a cell.
/// O(n + references), 12 bytes of scratch a reference and 24 a list, parallel; the result does not
/// depend on the number of threads.
[[nodiscard]] CellLists sort_into_cells(MeshView mesh, const ScratchVector<Reference>& references,
                                        double cells_per_triangle, const BuildOptions& options,
                                        const Parallel& parallel);

}  // namespace packet
