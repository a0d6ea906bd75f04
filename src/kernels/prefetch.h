// Fetching what a walk comes to later.
#pragma once

#include "core/macros.h"
#include "core/views.h"

#include <cstddef>

namespace packet {

/// The lines of what is visited later are fetched when it is pushed, since scenes seldom fit into
/// the second level's cache.
PACKET_INLINE void prefetch(const TreeView& tree, const WideChild& child) {
    const void* const at = child.is_leaf()
                               ? static_cast<const void*>(tree.blocks + child.link / kBlockSize)
                               : tree.wide_nodes + child.link;
    constexpr std::size_t kLines = sizeof(TriangleBlock) / 64;
    static_assert(sizeof(WideNode) <= sizeof(TriangleBlock));
    for (std::size_t i = 0; i < kLines; ++i) {
        __builtin_prefetch(static_cast<const char*>(at) + 64 * i);
    }
}

}  // namespace packet
