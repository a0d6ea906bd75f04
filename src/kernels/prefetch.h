// Fetching what a walk comes to later.
#pragma once

#include "core/macros.h"
#include "core/views.h"

#include <cstddef>

namespace packet {

/// The lines of what is visited later are fetched ahead, since scenes seldom fit into the second
/// level's cache.
PACKET_INLINE void prefetch(const TreeView& tree, const WideChild& child) {
    // No branch: whether a child is a leaf is anybody's guess.
    const auto* const leaf = reinterpret_cast<const char*>(tree.blocks + child.link / kBlockSize);
    const auto* const node =
        reinterpret_cast<const char*>(tree.wide_nodes) + sizeof(WideNode) * std::size_t{child.link};
    const auto is_leaf = static_cast<std::ptrdiff_t>(child.is_leaf());
    const char* const at = node + (leaf - node) * is_leaf;
    constexpr std::ptrdiff_t kLine = 64, kNodeLines = sizeof(WideNode) / kLine;
    static_assert(sizeof(TriangleBlock) == (kNodeLines + 1) * kLine);
    for (std::ptrdiff_t i = 0; i < kNodeLines; ++i) __builtin_prefetch(at + kLine * i);
    // The last line of a block; of a node the first one again, which takes nothing.
    __builtin_prefetch(at + kLine * kNodeLines * is_leaf);
}

}  // namespace packet
