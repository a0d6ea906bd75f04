// Checks what builders promise of a tree.
#pragma once

#include "build/tree.h"

namespace packet {

/// Whether leaves of such a tree hold parts of triangles, so that several may hold one's.
[[nodiscard]] bool cuts_triangles(AccelKind kind) noexcept;

/// Checks that the tree is one of that kind over all triangles of the mesh that can be hit: nodes
/// in depth-first order, no deeper than kMaxDepth; boxes in their parents'; every item of a leaf a
/// triangle that its box holds, or overlaps where triangles are cut; every triangle in one leaf, or
/// more where they are cut; lanes without a triangle never hit; the 8-wide form with the same
/// leaves; and statistics that agree. Throws Error{kBadValue} that names the first node, wide node
/// or item at fault and what it is. O(nodes + triangles) time and memory.
void validate(const Tree& tree, MeshView mesh, AccelKind kind);

}  // namespace packet
