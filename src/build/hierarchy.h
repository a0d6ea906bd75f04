// What every builder of hierarchies hands on: nodes in any order over a list of what they hold.
// tree.h turns it into the arrays that are walked.
#pragma once

#include "build/references.h"

#include <cstdint>
#include <vector>

namespace packet {

/// An inner node has two children and count 0; a leaf holds ids `first` to `first + count`.
struct BuildNode {
    Bounds3f bounds;
    std::uint32_t first = 0;   ///< inner: index of the first child
    std::uint32_t second = 0;  ///< inner: index of the second child
    std::uint32_t count = 0;

    [[nodiscard]] constexpr bool is_leaf() const noexcept { return count != 0; }
    [[nodiscard]] std::uint32_t& child(int side) noexcept { return side == 0 ? first : second; }
};

struct Hierarchy {
    ScratchVector<BuildNode> nodes;    ///< nodes[0] is the root; unused slots are never referred to
    ScratchVector<std::uint32_t> ids;  ///< of what leaves hold: triangles or instances
    /// By node, whether it is a child in the 8-wide form, from builders that make that themselves:
    /// the others only lie between children and parent. The root is one. Empty: collapse() chooses.
    std::vector<bool> is_wide_child = {};
};

}  // namespace packet
