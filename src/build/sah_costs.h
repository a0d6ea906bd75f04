// What the surface area heuristic expects hierarchies of boxes to cost. Kernels meet a block of
// triangles at once, so a leaf costs as much as the blocks it fills, however full they are.
#pragma once

#include "core/views.h"

#include <packet/accel.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace packet {

/// Single triangles that cost as much as a block, if a node of two children costs as one.
/// docs/experiments.md#quality-of-hierarchies
inline constexpr float kBlockTests = 2.0f;

struct SahCosts {
    float node, block;
    std::uint32_t block_size;  ///< items that are met at once
    std::uint32_t max_leaf_size;

    /// Blocks are no larger than leaves.
    explicit SahCosts(const BuildOptions& options)
        : node(options.traversal_cost),
          block(kBlockTests * options.intersection_cost),
          block_size(static_cast<std::uint32_t>(std::min(kBlockSize, options.max_leaf_size))),
          max_leaf_size(static_cast<std::uint32_t>(options.max_leaf_size)) {}

    [[nodiscard]] constexpr float leaf(float area, std::uint32_t count) const noexcept {
        const std::uint32_t blocks = count <= block_size ? 1 : (count - 1) / block_size + 1;
        return block * area * static_cast<float>(blocks);
    }
    /// Whether the halves of so many count by the blocks they fill, as leaves do. More would only
    /// be parted where that fills blocks: for all up to 64 it was 7% slower in Crytek Sponza.
    [[nodiscard]] constexpr bool counts_blocks(std::size_t count) const noexcept {
        return count <= std::max(2 * block_size, max_leaf_size);
    }
};

}  // namespace packet
