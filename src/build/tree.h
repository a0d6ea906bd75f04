// The tree that kernels walk, as the arrays of core/views.h, and how builders' hierarchies get
// there.
#pragma once

#include "build/grid.h"
#include "build/hierarchy.h"
#include "core/views.h"

#include <packet/accel.h>

#include <limits>
#include <vector>

namespace packet {

/// How a tree's wide nodes are cut into treelets (treelets.h).
struct Treelets {
    std::vector<std::uint32_t> begin;    ///< treelet t is nodes begin[t] to begin[t + 1]
    std::vector<std::uint32_t> of_node;  ///< treelets by node
    std::vector<TreeletRoot> roots;
    std::uint32_t most_exits = 0;  ///< links that leave a treelet
};

/// Owns what a TreeView shows: a tree, or a grid.
struct Tree {
    ScratchVector<Node> nodes;  ///< empty unless BuildOptions::keep_binary_nodes
    ScratchVector<WideNode> wide_nodes;
    Treelets treelets;  ///< empty if the tree is not cut
    ScratchVector<TriangleBlock> blocks;
    Grid grid;  ///< empty but for grids
    Bounds3f bounds;
    BuildStats stats;
    /// How far apart, about, rays meet different leaves: the side of the leaves that a random ray
    /// meets, in the mean, divided by the root of how many these are. Infinite for grids.
    float leaf_spacing = std::numeric_limits<float>::infinity();

    [[nodiscard]] TreeView view() const noexcept;
    [[nodiscard]] std::size_t byte_count() const noexcept;
};

/// Lays the hierarchy out as wide nodes, its triangles as blocks; and as binary nodes, depth first,
/// if the options say so. Fills node, leaf, depth, byte and cost statistics. O(n), parallel.
[[nodiscard]] Tree make_tree(const Hierarchy& hierarchy, MeshView mesh, const BuildOptions& options,
                             const Parallel& parallel);

/// Lays out only nodes; items of the leaves are the hierarchy's ids.
[[nodiscard]] Tree make_tree(const Hierarchy& hierarchy, const BuildOptions& options,
                             const Parallel& parallel);

/// Builds the structure that `options.accel` names. Triangles that can never be hit are left out
/// and counted. The mesh may be destroyed afterwards. Throws Error as validate() and for bad
/// options. Reports progress as `options` say.
[[nodiscard]] Tree build_tree(MeshView mesh, const BuildOptions& options);

/// The same as part of a larger job, of which it is `share`.
[[nodiscard]] Tree build_tree(MeshView mesh, const BuildOptions& options, Progress& progress,
                              double share);

/// Throws Error{kBadValue} that names the option out of its documented range.
void validate(const BuildOptions& options);

}  // namespace packet
