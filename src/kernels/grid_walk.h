// Walks a grid with one ray: a march over bricks of 4 x 4 x 4 cells, and, in those that are not
// empty, a march over cells. Both are the same march over planes of the same floats: a brick that
// holds a cell is entered no later, so none that is met is missed.
#pragma once

#include "kernels/grid_cell.h"
#include "kernels/grid_march.h"

namespace packet {

/// Which way a ray goes through bricks and cells: where those that it meets first are, and how far
/// the next ones are, in the order of GridView::bricks and in the bits of a brick.
template <class Isa>
struct GridRay {
    MarchAxis bricks[3];
    int guess[3];  ///< the brick that the ray is in where the march starts, about
    std::int32_t first_brick = 0, brick_step[3];
    std::uint32_t flipped = 0;  ///< bits of cells are numbered backwards along axes that these span
    float start;                ///< where the march starts: at the grid, tnear or later

    /// Starts at `from` or later.
    PACKET_INLINE GridRay(const GridView& grid, const SingleRay& ray, float from)
        : start(ray.tnear > from ? ray.tnear : from) {
        std::int32_t step = 1;
        for (int a = 0; a < 3; ++a) {
            const int count = grid.brick_count[a];
            const bool negative = ray.is_backward(a);
            bricks[a] = {negative ? grid.planes[a] + count * kBrickSide : grid.planes[a],
                         negative ? -kBrickSide : kBrickSide,
                         count,
                         ray.box_org[negative ? 1 : 0][a],
                         ray.box_org[negative ? 0 : 1][a],
                         ray.reciprocal[a]};
            first_brick += negative ? (count - 1) * step : 0;
            brick_step[a] = negative ? -step : step;
            flipped |= negative ? 3u << 2 * a : 0u;
            step *= count;
            const float enter = bricks[a].enter(0);
            start = enter > start ? enter : start;
        }
        for (int a = 0; a < 3; ++a) {
            const float at_start = ray.box_org[0][a] + start / ray.reciprocal[a];
            const float way = __builtin_fabsf(at_start - bricks[a].planes[0]);
            const float last = static_cast<float>(bricks[a].count - 1);
            const float at = way * grid.bricks_per_unit[a];
            guess[a] = static_cast<int>(at < last ? at : last);  // last for NaN, too
        }
    }
};

/// The cells that a brick's march meets.
template <class Isa>
PACKET_INLINE MarchAxis cells_of_brick(const MarchAxis& bricks, int brick) {
    MarchAxis out = bricks;
    out.planes += brick * bricks.stride;
    out.stride = bricks.stride / kBrickSide;
    out.count = kBrickSide;
    return out;
}

/// The cell of a brick's bit, which is set.
PACKET_INLINE const GridCell& cell_of_bit(const GridView& grid, const GridBrick& brick,
                                          std::uint32_t bit) {
    const std::uint64_t before = brick.occupied & ((std::uint64_t{1} << bit) - 1);
    return grid.cells[brick.first_cell + static_cast<std::uint32_t>(__builtin_popcountll(before))];
}

/// Calls visit(brick, bit) for each cell that holds something and that the ray meets from `start`
/// on, bricks in order of entry and in each the cells in theirs, until `best_t`.
template <class Isa, class Stats, class Visit>
PACKET_INLINE void march_grid(const GridView& grid, const GridRay<Isa>& ray, const float& best_t,
                              Stats& stats, Visit&& visit) {
    const int no_guess[3] = {0, 0, 0};
    march(ray.bricks, ray.guess, ray.start, best_t, [&](int x, int y, int z, float t) {
        const GridBrick& brick = grid.bricks[ray.first_brick + x * ray.brick_step[0] +
                                             y * ray.brick_step[1] + z * ray.brick_step[2]];
        stats.visit(1, 1);
        if (brick.occupied == 0) return;
        const MarchAxis cells[3] = {cells_of_brick<Isa>(ray.bricks[0], x),
                                    cells_of_brick<Isa>(ray.bricks[1], y),
                                    cells_of_brick<Isa>(ray.bricks[2], z)};
        march(cells, no_guess, t, best_t, [&](int i, int j, int k, float) {
            const std::uint32_t bit = static_cast<std::uint32_t>(i + 4 * j + 16 * k) ^ ray.flipped;
            stats.visit(1, 1);
            if ((brick.occupied >> bit & 1) != 0) visit(brick, bit);
        });
    });
}

/// The ray, which is usable, meets what is in the grid from `from` on.
template <Query query, class Isa, class Stats>
[[gnu::noinline]] void walk_grid(const TreeView& tree, const SingleRay& ray, float from,
                                 std::int32_t instance_id, BestHits<1, Isa>& best, Stats& stats) {
    const GridRay<Isa> way(tree.grid, ray, from);
    const float& best_t = best.t.r[0];
    if (!(way.start <= best_t)) return;
    Mailbox<Isa> mailbox;
    march_grid(tree.grid, way, best_t, stats, [&](const GridBrick& brick, std::uint32_t bit) {
        meet_cell<query>(tree, cell_of_bit(tree.grid, brick, bit), ray, instance_id, mailbox, best,
                         stats);
    });
}

}  // namespace packet
