// Sorts references by the Morton codes of their centroids and builds the radix tree over the codes,
// with its boxes, from the leaves up: large ranges are parted where their tree parts them, and
// each part that is small enough is built by one task from right to left.
//
// Lauterbach et al. Fast BVH construction on GPUs. Eurographics 2009.
// Karras. Maximizing parallelism in the construction of BVHs, octrees, and k-d trees. HPG 2012.
#include "build/bvh_morton.h"

#include "build/lane_box.h"
#include "build/radix_hierarchy.h"
#include "build/split.h"
#include "core/macros.h"
#include "core/morton.h"
#include "schedule/radix_sort.h"

#include <algorithm>
#include <atomic>

namespace packet {

namespace {

// Pieces of loops whose work is a few dozen nanoseconds an item.
constexpr std::size_t kGrain = 8192;
// References of a subtree that one task builds: its nodes stay in the second level's cache.
constexpr std::uint32_t kTaskSize = 4096;
// References whose boxes are fetched ahead: they lie anywhere.
constexpr std::uint32_t kAhead = 8;

// Of a build's time.
constexpr double kShareOfSort = 0.5;

/// A subtree whose root has no place yet.
struct Rooted {
    LaneBox box;
    RadixSubtree subtree;
    std::uint32_t first, second;  ///< places of the root's children, if it is no leaf

    [[nodiscard]] BuildNode root() const {
        if (subtree.height == 0) return {box.bounds(), subtree.first, 0, subtree.count};
        return {box.bounds(), first, second, 0};
    }
};

/// The inner node or leaf that two subtrees make, whose roots are, or will be, at these places.
PACKET_INLINE Rooted join(const Rooted& a, const Rooted& b, std::uint32_t place_a,
                          std::uint32_t place_b, const LeafRule& rule) {
    LaneBox box = a.box;
    box.extend(b.box);
    return {box, rule.join(a.subtree, b.subtree, half_area(box)), place_a, place_b};
}

/// Builds the subtree over a range of sorted items from right to left. Of neighbours, those whose
/// codes have most bits in common are joined first, so a stack of subtrees that still lack their
/// left neighbour is all that is needed, and no search. Nodes come about in the reverse of
/// depth-first order, in which they are read later on.
///
/// Apetrei. Fast and simple agglomerative LBVH construction. CGVC 2014.
template <class Code>
class RangeBuilder {
public:
    RangeBuilder(std::span<const MortonItem<Code>> items, std::span<const Reference> references,
                 const RadixKeys<Code>& keys, const LeafRule& rule, std::span<std::uint32_t> ids)
        : items_(items), references_(references), keys_(keys), rule_(rule), ids_(ids) {}

    /// Over items `first` to `last`, whose ids it fills in. Children are in nodes(), and referred
    /// to by their place there.
    Rooted build(std::uint32_t first, std::uint32_t last) {
        nodes_.resize(2 * std::size_t{last - first + 1});
        used_ = 0;
        int depth = 0;
        for (std::uint32_t i = last + 1; i-- > first;) {
            const int bits = i == first ? -1 : keys_.common_bits(i - 1, i);
            Entry left = {make_leaf(i), used_, bits};
            for (; depth > 0 && stack_[depth - 1].bits > bits; --depth) {
                join_right(left, stack_[depth - 1]);
            }
            stack_[depth++] = left;
        }
        return stack_[0].rooted;
    }
    /// Pairs of children, the second before the first.
    [[nodiscard]] std::span<const BuildNode> nodes() const {
        return std::span(nodes_).first(used_);
    }

private:
    struct Entry {
        Rooted rooted;
        std::uint32_t begin;  ///< of its nodes, which are the last ones but for those above
        int bits;             ///< in common with its left neighbour
    };

    PACKET_INLINE Rooted make_leaf(std::uint32_t item) const {
        if (item >= kAhead) __builtin_prefetch(&references_[items_[item - kAhead].index]);
        const Reference& reference = references_[items_[item].index];
        const LaneBox box = {without_last(lower_lanes(reference)), upper_lanes(reference)};
        ids_[item] = reference.id;
        return {box, rule_.leaf(item, half_area(box)), 0, 0};
    }
    /// The last one with its right neighbour, the one before it.
    PACKET_INLINE void join_right(Entry& left, const Entry& right) {
        const Rooted joined = join(left.rooted, right.rooted, used_ + 1, used_, rule_);
        if (joined.subtree.height == 0) {
            used_ = right.begin;
        } else {
            nodes_[used_++] = right.rooted.root();
            nodes_[used_++] = left.rooted.root();
        }
        left.rooted = joined;
        left.begin = right.begin;
    }

    std::span<const MortonItem<Code>> items_;
    std::span<const Reference> references_;
    const RadixKeys<Code>& keys_;
    const LeafRule& rule_;
    std::span<std::uint32_t> ids_;  ///< by item
    ScratchVector<BuildNode> nodes_;
    std::uint32_t used_ = 0;
    Entry stack_[kMortonBits<Code> + 33];  ///< each lacks a bit of the key that the last one has
};

template <class Code>
class Builder {
    using Item = MortonItem<Code>;

public:
    Builder(ScratchVector<Reference> references, const BuildOptions& options,
            const Parallel& parallel)
        : rule_(options),
          parallel_(parallel),
          count_(references.size()),
          references_(std::move(references)) {}

    /// For at least two references.
    Hierarchy build() {
        sort();
        parallel_.advance(kShareOfSort);
        Hierarchy out;
        nodes_.resize(2 * count_ - 1);
        out.ids.resize(count_);
        ids_ = out.ids;
        // Only where codes that differ in nearly every bit meet many that are equal.
        if (build_nodes(0) > kMaxDepth) {
            build_nodes(dropped_bits_for_depth(kMortonBits<Code>, count_));
        }
        nodes_.resize(used_);
        out.nodes = std::move(nodes_);
        return out;
    }

private:
    /// Fills sorted_.
    void sort() {
        const MortonGrid<Code> grid(measure(references_, parallel_).centroids);
        items_.resize(2 * count_);  // one array, which is worth more to those that come next
        const auto items = std::span(items_).first(count_),
                   scratch = std::span(items_).last(count_);
        parallel_.for_pieces(count_, kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                items[i] = {grid.code(centroid2(references_[i])), static_cast<std::uint32_t>(i)};
            }
        });
        sorted_ = radix_sort<Item>(items, scratch, kMortonBits<Code>, parallel_,
                                   [](const Item& item) { return item.code; });
    }

    /// Returns the height of the tree.
    int build_nodes(int dropped_bits) {
        used_ = 1;
        const RadixKeys<Code> keys(sorted_, dropped_bits);
        const Rooted all = build_range(keys, 0, static_cast<std::uint32_t>(count_ - 1));
        nodes_[0] = all.root();
        return all.subtree.height;
    }

    /// Large subtrees' parts are built by tasks of their own.
    Rooted build_range(const RadixKeys<Code>& keys, std::uint32_t first, std::uint32_t last) {
        if (last - first < kTaskSize) return build_task(keys, first, last);
        const std::uint32_t split = keys.split(first, last);
        Rooted a, b;
        parallel_.both([&] { a = build_range(keys, first, split); },
                       [&] { b = build_range(keys, split + 1, last); });
        const std::uint32_t pair = used_.fetch_add(2, std::memory_order_relaxed);
        nodes_[pair] = a.root();
        nodes_[pair + 1] = b.root();
        return join(a, b, pair, pair + 1, rule_);
    }

    Rooted build_task(const RadixKeys<Code>& keys, std::uint32_t first, std::uint32_t last) {
        RangeBuilder<Code> builder(sorted_, references_, keys, rule_, ids_);
        Rooted out = builder.build(first, last);
        const auto count = static_cast<std::uint32_t>(builder.nodes().size());
        const std::uint32_t last_place =
            used_.fetch_add(count, std::memory_order_relaxed) + count - 1;
        for (std::uint32_t i = 0; i < count; ++i) {
            BuildNode node = builder.nodes()[i];
            if (!node.is_leaf()) {
                node.first = last_place - node.first;
                node.second = last_place - node.second;
            }
            nodes_[last_place - i] = node;
        }
        out.first = last_place - out.first;
        out.second = last_place - out.second;
        parallel_.advance((1.0 - kShareOfSort) * static_cast<double>(last - first + 1) /
                          static_cast<double>(count_));
        return out;
    }

    LeafRule rule_;
    const Parallel& parallel_;
    std::size_t count_;
    ScratchVector<Reference> references_;
    ScratchVector<Item> items_;
    std::span<const Item> sorted_;
    ScratchVector<BuildNode> nodes_;
    std::span<std::uint32_t> ids_;         ///< of the hierarchy, by item
    std::atomic<std::uint32_t> used_ = 1;  ///< nodes; the root has the first
};

/// The tree over one reference, or none.
Hierarchy build_trivial(const ScratchVector<Reference>& references) {
    Hierarchy out;
    for (const Reference& r : references) out.nodes.push_back({r.bounds(), 0, 0, 1});
    for (const Reference& r : references) out.ids.push_back(r.id);
    return out;
}

}  // namespace

int chosen_morton_bits(std::size_t references, const BuildOptions& options) {
    // Up to this, 30 bits do as well as 63 (a million triangles of terrain, city, hairball, soup:
    // SAH cost within 0.1%; uneven scenes of 1 to 2 million, a kitchen, a dragon, a stadium: within
    // 0.5%) and sort in half the passes over half the memory.
    constexpr std::size_t kMostFor30Bits = 4000000;
    if (options.morton_bits != 0) return options.morton_bits;
    return references <= kMostFor30Bits ? 30 : 63;
}

Hierarchy build_bvh_morton(ScratchVector<Reference> references, const BuildOptions& options,
                           const Parallel& parallel) {
    if (references.size() < 2) return build_trivial(references);
    const int bits = chosen_morton_bits(references.size(), options);
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
