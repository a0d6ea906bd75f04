// A wide node's children are a cut through the binary tree below it. Some builders know their cuts.
// For the others dynamic programming finds the best: the cost of showing a subtree as a forest of
// at most k trees follows from those of its two children with fewer.
//
// Ylitie, Karras, Laine. Efficient incoherent ray traversal on GPUs through compressed wide BVHs.
// High-Performance Graphics 2017.
#pragma once

#include "build/hierarchy.h"
#include "core/views.h"

#include <packet/accel.h>

#include <cstdint>
#include <limits>

namespace packet {

/// The children of a wide node, in order.
struct WideChildren {
    std::uint32_t id[kWideSize];
    int count = 0;
};

/// How a hierarchy becomes a tree of wide nodes whose expected cost for a random ray is least, or
/// the one that its builder chose. Leaves are joined to wide leaves of up to `block_size` items.
class WideCuts {
public:
    /// O(nodes), parallel; `part` of the phase. The hierarchy must outlive this, and not be empty.
    WideCuts(const Hierarchy& hierarchy, std::uint32_t block_size, const Parallel& parallel,
             double part);

    /// A subtree that becomes one child: a leaf if it has no children, or is cheaper so.
    [[nodiscard]] bool is_leaf(std::uint32_t id) const noexcept {
        return nodes_[id].is_leaf() || (!is_given() && (cuts_[id].forests & kAsLeaf) != 0);
    }
    [[nodiscard]] std::uint32_t item_count(std::uint32_t id) const noexcept {
        return cuts_[id].items;
    }
    /// Of a subtree that is not a leaf.
    [[nodiscard]] WideChildren children(std::uint32_t id) const;

    /// Node, leaf, depth and cost statistics of the binary tree.
    [[nodiscard]] BuildStats stats(const BuildOptions& options) const;

private:
    static constexpr int kMostRoots = kWideSize - 1;  // one at least is on the other side
    static constexpr std::uint32_t kAsLeaf = 1u << 31;

    /// How a subtree is best shown as at most 2 to 8 trees: by 3 bits each, of which the lowest are
    /// for 2, how many go to its first child, or 0 if one tree less costs no more.
    struct Cut {
        std::uint32_t forests, items;
    };
    /// What a subtree costs as a forest of at most 1 to kMostRoots trees, of which a leaf only has
    /// the first, and what it is made of.
    struct Weight {
        float forest[kMostRoots];
        std::uint32_t items;
        int height;
        std::size_t leaf_count;
        double inner_area, block_area;  ///< sums: of inner nodes' boxes, and of leaves' by block
    };

    [[nodiscard]] bool is_given() const noexcept { return !hierarchy_.is_wide_child.empty(); }
    [[nodiscard]] static int first_roots(const Cut& cut, int roots) noexcept {
        return static_cast<int>(cut.forests >> 3 * (roots - 2) & 7u);
    }
    Weight weigh(std::uint32_t id, int depth);
    Weight weigh_leaf(const BuildNode& node, Cut& cut) const;
    /// The cheapest ways to show two subtrees as 2 to 8 trees, from index 1 on, and how many of
    /// these are the first's.
    struct Splits {
        float cost[kWideSize];
        std::uint32_t first[kWideSize];
    };
    static Splits best_splits(const Weight& first, const Weight& second);
    void choose(const Splits& splits, float area, Weight& out, Cut& cut) const;
    void gather(std::uint32_t id, int roots, WideChildren& out) const;
    void gather_given(std::uint32_t id, WideChildren& out) const;

    const Hierarchy& hierarchy_;
    const BuildNode* nodes_;
    std::uint32_t block_size_;
    const Parallel& parallel_;
    int fork_depth_;  ///< tasks begin at nodes of this depth
    double part_;     ///< of the phase, by task
    ScratchVector<Cut> cuts_;
    Weight root_;
};

}  // namespace packet
