// From a hierarchy to the 8-wide form, where one ray meets 8 boxes at once. Subtrees are laid out
// by tasks: each plans its part, which tells how large it is, and writes it once all are planned.
#pragma once

#include "build/wide_cuts.h"

#include <packet/mesh.h>

#include <functional>
#include <span>
#include <vector>

namespace packet {

/// What items are: lanes of blocks of triangles, or the hierarchy's ids themselves.
enum class Items : std::uint8_t { kTriangles, kIds };

struct WideTree {
    ScratchVector<WideNode> nodes;
    ScratchVector<TriangleBlock> blocks;
    float leaf_spacing = 0.0f;  ///< as Tree::leaf_spacing
};

/// Nodes are in depth-first order but for those near the root, which come first. Leaves that fit
/// into a block do not straddle two; those that are near each other share blocks, so that these are
/// well filled. Told of each leaf of the hierarchy, `place_leaf(node, first item)`, if it is not
/// null, may be called by several threads at once. Parallel; the result does not depend on the
/// number of threads. `part` of the phase.
[[nodiscard]] WideTree collapse(const Hierarchy& hierarchy, const WideCuts& cuts, Items items,
                                MeshView mesh,
                                const std::function<void(std::uint32_t, std::uint32_t)>& place_leaf,
                                const Parallel& parallel, double part);

}  // namespace packet
