// How triangles get into the blocks that kernels meet them in.
#pragma once

#include "core/views.h"

#include <packet/mesh.h>

#include <algorithm>
#include <limits>

namespace packet {

/// A block that nothing hits.
[[nodiscard]] inline TriangleBlock make_empty_block() noexcept {
    TriangleBlock block;
    std::fill_n(&block.v[0][0][0], 9 * kBlockSize, std::numeric_limits<float>::quiet_NaN());
    std::fill_n(block.prim_id, kBlockSize, -1);
    return block;
}

inline void put_triangle(TriangleBlock& block, std::size_t lane, MeshView mesh,
                         std::uint32_t id) noexcept {
    const glm::uvec3 corners = mesh.triangles[id];
    for (int c = 0; c < 3; ++c) {
        for (int a = 0; a < 3; ++a) block.v[c][a][lane] = mesh.positions[corners[c]][a];
    }
    block.prim_id[lane] = static_cast<std::int32_t>(id);
}

/// Makes the lane one that nothing hits.
inline void put_nothing(TriangleBlock& block, std::size_t lane) noexcept {
    for (auto& corner : block.v) {
        for (auto& coordinate : corner) coordinate[lane] = std::numeric_limits<float>::quiet_NaN();
    }
    block.prim_id[lane] = -1;
}

}  // namespace packet
