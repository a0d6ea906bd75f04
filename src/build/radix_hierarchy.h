// The hierarchy over a radix tree, as its nodes make it one by one, in whatever order and on
// whatever device: these steps are the same for the CPU's threads and those of CUDA.
//
// Karras. Maximizing parallelism in the construction of BVHs, octrees, and k-d trees. HPG 2012.
#pragma once

#include "build/hierarchy.h"
#include "build/radix_tree.h"
#include "build/sah_costs.h"

#include <packet/accel.h>

#include <algorithm>
#include <cstdint>

namespace packet {

/// What a node's parent needs to know of it beside its box.
struct RadixSubtree {
    std::uint32_t first, count;  ///< the references it covers
    float cost;                  ///< as in BuildStats::sah_cost, times the area of the root
    int height;                  ///< edges to its deepest leaf
};

/// When a node is a leaf: when that is cheaper, and it is not too large.
struct LeafRule {
    SahCosts costs;

    /// A node of two subtrees. It is a leaf, of height 0, if the rule says so.
    [[nodiscard]] constexpr RadixSubtree join(const RadixSubtree& a, const RadixSubtree& b,
                                              float area) const {
        const std::uint32_t count = a.count + b.count;
        const float as_node = costs.node * area + a.cost + b.cost;
        if (count <= costs.max_leaf_size) {
            const float as_leaf = costs.leaf(area, count);
            if (!(as_node < as_leaf)) return {a.first, count, as_leaf, 0};
        }
        return {a.first, count, as_node, 1 + std::max(a.height, b.height)};
    }
    [[nodiscard]] constexpr RadixSubtree leaf(std::uint32_t item, float area) const {
        return {item, 1, costs.leaf(area, 1), 0};
    }

    explicit LeafRule(const BuildOptions& options) : costs(options) {}
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
        subtree = rule.join(subtree_at(node.first, rule), subtree_at(node.second, rule),
                            node.bounds.half_area());
        if (subtree.height != 0) return;
        node.first = subtree.first;
        node.count = subtree.count;
    }

private:
    [[nodiscard]] constexpr RadixSubtree subtree_at(std::uint32_t slot,
                                                    const LeafRule& rule) const {
        if (slot < first_leaf()) return subtrees[slot];
        return rule.leaf(nodes[slot].first, nodes[slot].bounds.half_area());
    }
};

}  // namespace packet
