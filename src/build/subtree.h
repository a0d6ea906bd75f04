// What one task builds of a hierarchy, where tasks do not know how much the others will build.
#pragma once

#include "build/hierarchy.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace packet {

/// As in Hierarchy, but for children that other tasks build.
struct Subtree {
    struct Hanging {
        std::uint32_t parent;  ///< a node here
        int side;              ///< which child of it
        std::unique_ptr<Subtree> tree;
    };
    std::vector<BuildNode> nodes;  ///< nodes[0] is the root
    std::vector<std::uint32_t> ids;
    std::vector<bool> is_wide_child;
    std::vector<Hanging> hanging;

    /// Makes a node a leaf of `items`.
    void fill_leaf(std::uint32_t node, const ScratchVector<Reference>& items) {
        nodes[node].first = static_cast<std::uint32_t>(ids.size());
        nodes[node].count = static_cast<std::uint32_t>(items.size());
        for (const Reference& item : items) ids.push_back(item.id);
    }
    /// Hangs a subtree, yet to be filled, on a node.
    Subtree& hang(std::uint32_t parent, int side) {
        hanging.push_back({parent, side, std::make_unique<Subtree>()});
        return *hanging.back().tree;
    }
};

/// Moves a subtree and what hangs on it to the hierarchy's end. Yields the root's index there.
inline std::uint32_t append(Subtree& from, Hierarchy& to, const Parallel& parallel) {
    parallel.check();
    const auto base = static_cast<std::uint32_t>(to.nodes.size());
    const auto first = static_cast<std::uint32_t>(to.ids.size());
    for (BuildNode node : from.nodes) {
        node.first += node.is_leaf() ? first : base;
        node.second += base;
        to.nodes.push_back(node);
    }
    to.ids.insert(to.ids.end(), from.ids.begin(), from.ids.end());
    to.is_wide_child.insert(to.is_wide_child.end(), from.is_wide_child.begin(),
                            from.is_wide_child.end());
    for (const Subtree::Hanging& hanging : from.hanging) {
        const std::uint32_t root = append(*hanging.tree, to, parallel);
        to.nodes[base + hanging.parent].child(hanging.side) = root;
    }
    from = {};
    return base;
}

/// Adds up what a subtree and what hangs on it hold.
inline void count(const Subtree& tree, std::size_t& nodes, std::size_t& ids) {
    nodes += tree.nodes.size();
    ids += tree.ids.size();
    for (const Subtree::Hanging& hanging : tree.hanging) count(*hanging.tree, nodes, ids);
}

[[nodiscard]] inline Hierarchy to_hierarchy(Subtree tree, const Parallel& parallel) {
    Hierarchy out;
    std::size_t nodes = 0, ids = 0;
    count(tree, nodes, ids);
    out.nodes.reserve(nodes);
    out.ids.reserve(ids);
    append(tree, out, parallel);
    return out;
}

}  // namespace packet
