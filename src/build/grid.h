// A grid as builders own it: what a GridView shows.
#pragma once

#include "core/aligned_vector.h"
#include "core/views.h"

#include <cstddef>

namespace packet {

struct Grid {
    AlignedVector<float> planes[3];
    int brick_count[3] = {0, 0, 0};
    float bricks_per_unit[3] = {0, 0, 0};
    AlignedVector<GridBrick> bricks;
    AlignedVector<GridCell> cells;
    AlignedVector<GridTree> trees;

    [[nodiscard]] bool empty() const noexcept { return bricks.empty(); }
    [[nodiscard]] std::size_t byte_count() const noexcept {
        std::size_t bytes = bricks.size() * sizeof(GridBrick) + cells.size() * sizeof(GridCell) +
                            trees.size() * sizeof(GridTree);
        for (const AlignedVector<float>& p : planes) bytes += p.size() * sizeof(float);
        return bytes;
    }
    [[nodiscard]] GridView view() const noexcept {
        GridView out;
        if (empty()) return out;
        for (int a = 0; a < 3; ++a) {
            out.planes[a] = planes[a].data();
            out.brick_count[a] = brick_count[a];
            out.bricks_per_unit[a] = bricks_per_unit[a];
        }
        out.bricks = bricks.data();
        out.cells = cells.data();
        out.trees = trees.data();
        return out;
    }
};

}  // namespace packet
