// From the binary tree to its 8-wide form, where one ray meets 8 boxes at once.
#pragma once

#include "build/tree.h"

#include <span>
#include <vector>

namespace packet {

/// An item that only fills a block up, so that a leaf starts the next.
inline constexpr std::uint32_t kNoReference = 0xFFFFFFFF;

struct Collapsed {
    AlignedVector<WideNode> nodes;
    ScratchVector<std::uint32_t> reference_of_item;
};

/// Joins nodes into wide ones, and leaves into wide leaves of up to `block_size` items, so that the
/// expected cost of a random ray is least, or as `is_wide_child` says by node, if it is not empty;
/// then places the items of each wide leaf so that it straddles as few blocks as it can. On entry
/// the leaves of `nodes` link to references, on return to items. The order of items is that of the
/// leaves. O(nodes), on
/// one thread; `parallel` is asked whether to go on.
[[nodiscard]] Collapsed collapse(std::span<Node> nodes, std::uint32_t block_size,
                                 const std::vector<bool>& is_wide_child, const Parallel& parallel);

}  // namespace packet
