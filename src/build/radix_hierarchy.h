// The hierarchy over a radix tree, as its nodes make it one by one, in whatever order and on
// whatever device: these steps are the same for the CPU's threads and those of CUDA.
//
// Karras. Maximizing parallelism in the construction of BVHs, octrees, and k-d trees. HPG 2012.
#pragma once

#include "build/hierarchy.h"
#include "build/radix_tree.h"

#include <packet/accel.h>

#include <algorithm>
#include <cstdint>

namespace packet {

/// When a node is a leaf: when that is cheaper, and it is not too large.
struct LeafRule {
    float traversal_cost, intersection_cost;
    std::uint32_t max_leaf_size;

    explicit LeafRule(const BuildOptions& options)
        : traversal_cost(options.traversal_cost),
          intersection_cost(options.intersection_cost),
          max_leaf_size(static_cast<std::uint32_t>(options.max_leaf_size)) {}
};

/// What a node's parent needs to know of it beside its box.
struct RadixSubtree {
    std::uint32_t first, count;  ///< the references it covers
    float cost;                  ///< as in BuildStats::sah_cost, times the area of the root
    int height;                  ///< edges to its deepest leaf
};

/// Arrays over n sorted references. Inner nodes have the slots below n - 1, and leaf i has slot
/// n - 1 + i.
struct RadixHierarchy {
    BuildNode* nodes;
    std::uint32_t* parents;  ///< by slot; the root has none
    RadixSubtree* subtrees;  ///< by slot, of inner nodes
    std::uint32_t count;     ///< n

    [[nodiscard]] constexpr std::uint32_t first_leaf() const { return count - 1; }

    /// Tells an inner node and its children of each other.
    constexpr void link(std::uint32_t slot, const RadixNode& range) const {
        const std::uint32_t first =
            range.split == range.first ? first_leaf() + range.split : range.split;
        const std::uint32_t second =
            range.split + 1 == range.last ? first_leaf() + range.last : range.split + 1;
        nodes[slot].first = first;
        nodes[slot].second = second;
        nodes[slot].count = 0;
        parents[first] = parents[second] = slot;
        subtrees[slot].first = range.first;
        subtrees[slot].count = range.last - range.first + 1;
    }

    constexpr void make_leaf(std::uint32_t item, const Reference& reference) const {
        BuildNode& node = nodes[first_leaf() + item];
        node.bounds = reference.bounds();
        node.first = item;
        node.second = 0;
        node.count = 1;
    }

    /// Fills the box of an inner node whose children are finished. It is a leaf if the rule says
    /// so.
    constexpr void finish(std::uint32_t slot, const LeafRule& rule) const {
        BuildNode& node = nodes[slot];
        RadixSubtree& subtree = subtrees[slot];
        node.bounds = nodes[node.first].bounds;
        node.bounds.extend(nodes[node.second].bounds);
        const RadixSubtree first = subtree_at(node.first, rule);
        const RadixSubtree second = subtree_at(node.second, rule);
        const float area = node.bounds.half_area();
        const float leaf_cost = rule.intersection_cost * area * static_cast<float>(subtree.count);
        subtree.cost = rule.traversal_cost * area + first.cost + second.cost;
        subtree.height = 1 + std::max(first.height, second.height);
        if (subtree.count > rule.max_leaf_size) return;
        if (subtree.cost < leaf_cost) return;
        subtree.cost = leaf_cost;
        subtree.height = 0;
        node.first = subtree.first;
        node.count = subtree.count;
    }

private:
    [[nodiscard]] constexpr RadixSubtree subtree_at(std::uint32_t slot,
                                                    const LeafRule& rule) const {
        if (slot < first_leaf()) return subtrees[slot];
        const float area = nodes[slot].bounds.half_area();
        return {nodes[slot].first, 1, rule.intersection_cost * area, 0};
    }
};

}  // namespace packet
