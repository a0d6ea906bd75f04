// From the binary tree to its 8-wide form, where one ray meets 8 boxes at once.
#pragma once

#include "build/tree.h"

#include <vector>

namespace packet {

/// Where the references of a leaf of the binary tree go: items `first_item` and on.
struct LeafPlace {
    std::uint32_t first_reference, count, first_item;
};

struct Collapsed {
    AlignedVector<WideNode> nodes;
    std::vector<LeafPlace> places;  ///< in depth-first order of the leaves
    std::uint32_t item_count = 0;   ///< gaps included
};

/// Joins nodes into wide ones, and leaves into wide leaves of up to `block_size` items, so that the
/// expected cost of a random ray is least; then places the items of each wide leaf so that it
/// straddles as few blocks as it can. On entry the leaves of `nodes` link to references, on return to
/// items. The order of items is that of the leaves. O(nodes).
[[nodiscard]] Collapsed collapse(std::span<Node> nodes, std::uint32_t block_size);

}  // namespace packet
