// The order in which rays that go one way take a tree's treelets: each after the one above it, and
// of those below one the nearest first.
#pragma once

#include "core/views.h"

#include <packet/ray.h>

#include <cstdint>
#include <vector>

namespace packet {

/// Depth first; siblings by where their centres lie along `direction`, equal ones in the order of
/// the tree. O(t log t) of t treelets.
[[nodiscard]] std::vector<std::uint32_t> treelet_order(const TreeView& tree,
                                                       const glm::vec3& direction);

}  // namespace packet
