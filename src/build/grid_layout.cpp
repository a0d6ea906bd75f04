#include "build/grid_layout.h"

#include "build/sah_costs.h"
#include "build/triangle_block.h"

#include <algorithm>
#include <vector>

namespace packet {

namespace {

// Lists of cells a task lays out: some 100 us of work.
constexpr std::size_t kGrain = 1024;
// Of the time that a grid takes, about.
constexpr double kShareOfLayout = 0.3;

/// The planes of the space, and its bricks with the bits of the cells that have lists.
Grid make_bricks(const CellLists& cells) {
    Grid grid;
    const GridSpace& space = cells.space;
    for (int a = 0; a < 3; ++a) {
        grid.planes[a] = space.planes(a);
        grid.brick_count[a] = space.brick_side(a);
        grid.bricks_per_unit[a] = space.bricks_per_unit(a);
    }
    grid.bricks.resize(space.brick_count());
    for (std::size_t i = cells.lists.size(); i-- > 0;) {  // so that the first of a brick stays
        const std::uint32_t cell = cells.lists[i].cell;
        GridBrick& brick = grid.bricks[cell / 64];
        brick.occupied |= std::uint64_t{1} << cell % 64;
        brick.first_cell = static_cast<std::uint32_t>(i);
    }
    return grid;
}

/// Where the next list of `count` items starts if `used` items are placed.
std::size_t place_list(std::size_t used, std::size_t count) {
    const std::size_t in_block = used % kBlockSize;
    return in_block != 0 && in_block + count > kBlockSize ? used + kBlockSize - in_block : used;
}

/// Lists that a task lays out, in blocks of their own.
struct Piece {
    std::size_t begin, end;       ///< of the lists
    std::size_t first_block = 0;  ///< of the blocks
    std::size_t block_count = 0;
};

std::vector<Piece> place_pieces(const CellLists& cells, std::uint32_t longest,
                                const Parallel& parallel) {
    std::vector<Piece> pieces((cells.lists.size() + kGrain - 1) / kGrain);
    parallel.for_pieces(cells.lists.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        std::size_t used = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const std::uint32_t count = cells.lists[i].count;
            if (count <= longest) used = place_list(used, count) + count;
        }
        pieces[begin / kGrain] = {begin, end, 0, (used + kBlockSize - 1) / kBlockSize};
    });
    for (std::size_t i = 1; i < pieces.size(); ++i) {
        pieces[i].first_block = pieces[i - 1].first_block + pieces[i - 1].block_count;
    }
    return pieces;
}

void lay_out(const CellLists& cells, std::uint32_t longest, const Piece& piece, MeshView mesh,
             Tree& out) {
    const TriangleBlock empty = make_empty_block();
    std::size_t used = piece.first_block * kBlockSize;
    for (std::size_t i = piece.begin; i < piece.end; ++i) {
        const CellList& list = cells.lists[i];
        if (list.count > longest) continue;
        used = place_list(used, list.count);
        out.grid.cells[i] = {static_cast<std::uint32_t>(used), list.count};
        for (std::uint32_t k = 0; k < list.count; ++k, ++used) {
            TriangleBlock& block = out.blocks[used / kBlockSize];
            if (used % kBlockSize == 0) block = empty;
            put_triangle(block, used % kBlockSize, mesh, cells.ids[list.first + k]);
        }
    }
}

/// With what probability a random ray that meets the grid meets a certain cell: the ratio of their
/// areas. (Cells are all about the same size.)
double cell_share(const GridSpace& space) {
    const glm::dvec3 box(space.bounds().extent());
    const glm::dvec3 cell = box / glm::dvec3(space.side(0), space.side(1), space.side(2));
    const auto area = [](const glm::dvec3& e) { return e.x * e.y + e.y * e.z + e.z * e.x; };
    return area(box) > 0.0 ? area(cell) / area(box) : 1.0;
}

}  // namespace

Tree make_grid(const CellLists& cells, std::uint32_t longest, MeshView mesh,
               const Parallel& parallel) {
    Tree out;
    out.grid = make_bricks(cells);
    out.bounds = cells.space.bounds();
    const std::vector<Piece> pieces = place_pieces(cells, longest, parallel);
    out.grid.cells.resize(cells.lists.size());
    out.blocks.resize(pieces.back().first_block + pieces.back().block_count);
    parallel.for_pieces(pieces.size(), 1, [&](std::size_t i, std::size_t) {
        lay_out(cells, longest, pieces[i], mesh, out);
        parallel.advance(kShareOfLayout / static_cast<double>(pieces.size()));
    });
    out.stats.node_count = cells.space.cell_count();
    out.stats.leaf_count = cells.lists.size();
    return out;
}

double expected_cost(const CellLists& cells, std::uint32_t longest, const BuildOptions& options) {
    std::size_t blocks = 0;
    for (const CellList& list : cells.lists) {
        if (list.count <= longest) blocks += (list.count + kBlockSize - 1) / kBlockSize;
    }
    const double of_cells =
        static_cast<double>(options.traversal_cost) * static_cast<double>(cells.space.cell_count());
    const double of_blocks =
        static_cast<double>(kBlockTests * options.intersection_cost) * static_cast<double>(blocks);
    return cell_share(cells.space) * (of_cells + of_blocks);
}

}  // namespace packet
