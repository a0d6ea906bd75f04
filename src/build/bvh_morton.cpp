// Sorts references by the Morton codes of their centroids, builds the radix tree over the codes,
// all nodes at once, and its boxes from the leaves up: of the two children of a node, the one that
// is done last goes on with the node.
//
// Lauterbach et al. Fast BVH construction on GPUs. Eurographics 2009.
// Karras. Maximizing parallelism in the construction of BVHs, octrees, and k-d trees. HPG 2012.
#include "build/bvh_morton.h"

#include "build/radix_tree.h"
#include "build/split.h"
#include "core/morton.h"
#include "schedule/radix_sort.h"

#include <algorithm>
#include <atomic>

namespace packet {

namespace {

// Pieces of loops whose work is a few dozen nanoseconds an item.
constexpr std::size_t kGrain = 8192;

// Of a build's time; the two loops over nodes take about as long as each other.
constexpr double kShareOfSort = 0.5, kShareOfLoop = 0.25;

/// What a node's parent needs to know of it beside its box.
struct Subtree {
    std::uint32_t first, count;  ///< the references it covers
    float cost;                  ///< as in BuildStats::sah_cost, times the area of the root
    int height;                  ///< edges to its deepest leaf
};

template <class Code>
class Builder {
    using Item = MortonItem<Code>;

public:
    Builder(AlignedVector<Reference> references, const BuildOptions& options,
            const Parallel& parallel)
        : options_(options),
          parallel_(parallel),
          count_(references.size()),
          unsorted_(std::move(references)) {}

    /// For at least two references.
    Hierarchy build() {
        sort();
        parallel_.advance(kShareOfSort);
        nodes_.resize(2 * count_ - 1);
        parents_.resize(2 * count_ - 1);
        subtrees_.resize(count_ - 1);
        build_nodes(0);
        // Only where codes that differ in nearly every bit meet many that are equal.
        if (subtrees_[0].height > kMaxDepth) {
            build_nodes(dropped_bits_for_depth(kMortonBits<Code>, count_));
        }
        return {std::move(nodes_), std::move(references_)};
    }

private:
    /// Fills items_, sorted, and references_ in their order.
    void sort() {
        const MortonGrid<Code> grid(measure(unsorted_, parallel_).centroids);
        ScratchVector<Item> items(count_), scratch(count_);
        parallel_.for_pieces(count_, kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                items[i] = {grid.code(centroid2(unsorted_[i])), static_cast<std::uint32_t>(i)};
            }
        });
        const std::span<Item> sorted =
            radix_sort<Item>(items, scratch, kMortonBits<Code>, parallel_,
                             [](const Item& item) { return item.code; });
        items_ = std::move(sorted.data() == items.data() ? items : scratch);
        references_.resize(count_);
        parallel_.for_pieces(count_, kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) references_[i] = unsorted_[items_[i].index];
        });
        unsorted_ = {};
    }

    /// Inner nodes have the slots below this, and leaf i has this one plus i.
    [[nodiscard]] std::size_t first_leaf() const { return count_ - 1; }

    void build_nodes(int dropped_bits) {
        const RadixKeys<Code> keys(items_, dropped_bits);
        parallel_.for_pieces(count_ - 1, kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                link(i, radix_node(keys, static_cast<std::uint32_t>(i)));
            }
            advance(end - begin);
        });
        std::vector<std::atomic<std::uint8_t>> is_one_child_done(count_ - 1);
        parallel_.for_pieces(count_, kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) climb(first_leaf() + i, is_one_child_done);
            advance(end - begin);
        });
    }

    void advance(std::size_t items) const {
        parallel_.advance(kShareOfLoop * static_cast<double>(items) / static_cast<double>(count_));
    }

    void link(std::size_t slot, const RadixNode& range) {
        const std::size_t first =
            range.split == range.first ? first_leaf() + range.split : range.split;
        const std::size_t second =
            range.split + 1 == range.last ? first_leaf() + range.last : range.split + 1;
        nodes_[slot].first = static_cast<std::uint32_t>(first);
        nodes_[slot].second = static_cast<std::uint32_t>(second);
        nodes_[slot].count = 0;
        parents_[first] = parents_[second] = static_cast<std::uint32_t>(slot);
        subtrees_[slot].first = range.first;
        subtrees_[slot].count = range.last - range.first + 1;
    }

    /// Finishes a leaf, and those ancestors whose other descendants are finished.
    void climb(std::size_t slot, std::span<std::atomic<std::uint8_t>> is_one_child_done) {
        const std::size_t item = slot - first_leaf();
        nodes_[slot].bounds = references_[item].bounds();
        nodes_[slot].first = static_cast<std::uint32_t>(item);
        nodes_[slot].count = 1;
        while (slot != 0) {
            slot = parents_[slot];
            // Releases this child to the thread that comes second, or acquires the other child.
            if (is_one_child_done[slot].exchange(1, std::memory_order_acq_rel) == 0) return;
            finish(nodes_[slot], subtrees_[slot]);
        }
    }

    /// Fills the box of a node whose children are finished. It is a leaf if that is cheaper.
    void finish(BuildNode& node, Subtree& subtree) const {
        node.bounds = nodes_[node.first].bounds;
        node.bounds.extend(nodes_[node.second].bounds);
        const Subtree first = subtree_at(node.first), second = subtree_at(node.second);
        const float area = node.bounds.half_area();
        const float leaf_cost =
            options_.intersection_cost * area * static_cast<float>(subtree.count);
        subtree.cost = options_.traversal_cost * area + first.cost + second.cost;
        subtree.height = 1 + std::max(first.height, second.height);
        if (subtree.count > static_cast<std::uint32_t>(options_.max_leaf_size)) return;
        if (subtree.cost < leaf_cost) return;
        subtree.cost = leaf_cost;
        subtree.height = 0;
        node.first = subtree.first;
        node.count = subtree.count;
    }

    [[nodiscard]] Subtree subtree_at(std::size_t slot) const {
        if (slot < first_leaf()) return subtrees_[slot];
        const float area = nodes_[slot].bounds.half_area();
        return {nodes_[slot].first, 1, options_.intersection_cost * area, 0};
    }

    const BuildOptions& options_;
    const Parallel& parallel_;
    std::size_t count_;
    AlignedVector<Reference> unsorted_, references_;
    ScratchVector<Item> items_;
    ScratchVector<BuildNode> nodes_;
    ScratchVector<std::uint32_t> parents_;  ///< by slot; the root has none
    ScratchVector<Subtree> subtrees_;       ///< by slot, of inner nodes
};

/// The tree over one reference, or none.
Hierarchy build_trivial(AlignedVector<Reference> references) {
    Hierarchy out;
    for (const Reference& r : references) out.nodes.push_back({r.bounds(), 0, 0, 1});
    out.references = std::move(references);
    return out;
}

/// Up to this, 30 bits do as well as 63 for evenly spread triangles (SAH cost within 0.1%, in
/// terrain and city) and sort in half the passes. Kept well below where they differ, for uneven
/// scenes.
constexpr std::size_t kMostFor30Bits = 100000;

}  // namespace

Hierarchy build_bvh_morton(AlignedVector<Reference> references, const BuildOptions& options,
                           const Parallel& parallel) {
    if (references.size() < 2) return build_trivial(std::move(references));
    const int bits = options.morton_bits != 0              ? options.morton_bits
                     : references.size() <= kMostFor30Bits ? 30
                                                           : 63;
    Hierarchy out;
    parallel.run([&] {
        if (bits == 30) {
            out = Builder<std::uint32_t>(std::move(references), options, parallel).build();
        } else {
            out = Builder<std::uint64_t>(std::move(references), options, parallel).build();
        }
    });
    return out;
}

}  // namespace packet
