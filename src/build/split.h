// What builders that sort references from the top down have in common: each splits a node's
// references in two, and those again; they differ only in where, and in whether they cut triangles.
#pragma once

#include "build/hierarchy.h"
#include "core/bits.h"
#include "core/views.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace packet {

using ReferenceSpan = std::span<Reference>;

/// Twice the centroid: the factor cancels in everything it is used for.
[[nodiscard]] inline glm::vec3 centroid2(const Reference& r) noexcept { return r.lower + r.upper; }

struct NodeBounds {
    Bounds3f box;
    Bounds3f centroids;  ///< doubled, as by centroid2

    void extend(const NodeBounds& other) noexcept {
        box.extend(other.box);
        centroids.extend(other.centroids);
    }
};

/// The references of a node while it is built.
struct NodeRange {
    ReferenceSpan refs;
    NodeBounds bounds;
    std::size_t room = 0;  ///< how many more fit behind `refs`: parts of triangles that are cut

    [[nodiscard]] std::size_t capacity() const noexcept { return refs.size() + room; }
};
using Halves = std::array<NodeRange, 2>;

/// Folds references into a Result: fold_piece(result, piece) for pieces that several threads share
/// if the references are many, then join(result, piece_result) in the order of the pieces.
template <class Result, class FoldPiece, class Join>
[[nodiscard]] Result fold_references(ReferenceSpan refs, const Parallel& parallel,
                                     FoldPiece fold_piece, Join join) {
    // 1 MiB of references: far more work than handing a piece to another thread.
    constexpr std::size_t kGrain = 32768;
    Result out{};
    if (refs.size() <= kGrain) {
        fold_piece(out, refs);
        return out;
    }
    std::vector<Result> pieces((refs.size() + kGrain - 1) / kGrain);
    parallel.for_pieces(refs.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        fold_piece(pieces[begin / kGrain], refs.subspan(begin, end - begin));
    });
    for (const Result& piece : pieces) join(out, piece);
    return out;
}

[[nodiscard]] NodeBounds measure(ReferenceSpan refs, const Parallel& parallel);

/// A split is allowed if the larger child can still be halved down to one reference within
/// kMaxDepth. Halving keeps the condition, so by induction no leaf is deeper than that.
[[nodiscard]] PACKET_INLINE bool fits_depth(int child_depth, std::size_t larger_child) noexcept {
    return child_depth + 64 - leading_zeros(std::uint64_t{larger_child} - 1) <= kMaxDepth;
}

/// Whether `first` of `count` references at `depth` may go to one side and the others to the other:
/// neither side is empty, and both fit.
[[nodiscard]] inline bool is_allowed(std::size_t first, std::size_t count, int depth) noexcept {
    return first != 0 && first != count && fits_depth(depth + 1, std::max(first, count - first));
}

/// Sorts half of the references to each side, by centroid along the axis on which centroids are
/// widest (or the box, if theirs are not known), then by id.
/// Returns where the second half starts.
[[nodiscard]] std::size_t halve(const NodeRange& node);

/// The first references and the others, with their bounds; each gets room in proportion to
/// its references and area.
[[nodiscard]] Halves divide(const NodeRange& node, std::size_t first, const Parallel& parallel);
[[nodiscard]] Halves divide(const NodeRange& node, std::size_t first, const NodeBounds& bounds0,
                            const NodeBounds& bounds1);

/// A leaf of one id.
struct Leaf {
    std::uint32_t node, id;
    int depth;
};

/// Those of a hierarchy whose leaves are such.
[[nodiscard]] std::vector<Leaf> leaves_of(const Hierarchy& hierarchy);

/// Builds by splitting. `split(node, depth)` sorts at least two references at `depth` to two sides,
/// which share their memory and room, or returns none for a leaf. It is called by several threads
/// at once; is_allowed() must hold of what it returns.
template <class Split>
class TopDownBuilder {
public:
    /// Splitting may add up to `room` references.
    TopDownBuilder(ScratchVector<Reference> references, std::size_t room, const Parallel& parallel,
                   Split split)
        : parallel_(parallel),
          split_(std::move(split)),
          count_(references.size()),
          references_(std::move(references)) {
        if (count_ == 0) return;
        references_.reserve(count_ + room);  // no more: resize() may double
        references_.resize(count_ + room);
        nodes_.resize(2 * references_.size() - 1);  // a leaf has a reference at least
    }

    [[nodiscard]] Hierarchy build() && {
        if (count_ == 0) return {};
        return build_by([&] { build_root(); });
    }
    /// Builds below `leaves` of a hierarchy whose ids are those of ranges. The ranges share out the
    /// references where these were before they were moved here, and fit the leaves' depths.
    [[nodiscard]] Hierarchy build_below(const Hierarchy& above, std::span<const Leaf> leaves,
                                        std::span<const NodeRange> ranges) && {
        return build_by([&] {
            std::ranges::copy(above.nodes, nodes_.begin());
            used_ = static_cast<std::uint32_t>(above.nodes.size());
            constexpr std::size_t kGrain = 64;
            parallel_.for_pieces(leaves.size(), kGrain, [&](std::size_t begin, std::size_t end) {
                build_ranges(leaves.subspan(begin, end - begin), ranges);
            });
        });
    }

private:
    // Below this a task costs more than the work it moves to another core.
    static constexpr std::size_t kTaskSize = 4096;

    /// Where a task puts nodes, of which a pair is a node's children. It takes places from all that
    /// there are by the hundred, so that tasks seldom meet, but never more than its references may
    /// need: then there are enough for all.
    class Places {
    public:
        Places(std::atomic<std::uint32_t>& all, std::size_t capacity)
            : all_(all), needed_(static_cast<std::uint32_t>(2 * capacity - 2)) {}

        std::uint32_t take_pair() {
            constexpr std::uint32_t kMost = 128;
            if (next_ == end_) {
                const std::uint32_t count = std::min(kMost, needed_);
                next_ = all_.fetch_add(count, std::memory_order_relaxed);
                end_ = next_ + count;
                needed_ -= count;
            }
            next_ += 2;
            return next_ - 2;
        }

    private:
        std::atomic<std::uint32_t>& all_;
        std::uint32_t needed_, next_ = 0, end_ = 0;
    };

    template <class Build>
    Hierarchy build_by(Build&& build) {
        Hierarchy out;
        parallel_.run([&] {
            build();
            out.ids = ids_of(references_, parallel_);
        });
        nodes_.resize(used_);
        out.nodes = std::move(nodes_);
        return out;
    }

    void build_root() {
        const ReferenceSpan refs = std::span(references_).first(count_);
        build_task(0, {refs, measure(refs, parallel_), references_.size() - count_}, 0);
    }

    void build_ranges(std::span<const Leaf> leaves, std::span<const NodeRange> ranges) {
        std::size_t capacity = 1;  // a range's root has its place
        for (const Leaf& leaf : leaves) capacity += ranges[leaf.id].capacity() - 1;
        Places places(used_, capacity);
        for (const Leaf& leaf : leaves) {
            build_node(leaf.node, ranges[leaf.id], leaf.depth, places);
            advance(ranges[leaf.id]);
        }
    }

    /// Splits large nodes, each in a task of its own.
    void build_task(std::uint32_t place, const NodeRange& node, int depth) {
        if (node.refs.size() <= kTaskSize) {
            Places places(used_, node.capacity());
            build_node(place, node, depth, places);
            advance(node);
            return;
        }
        const auto halves = split_(node, depth);
        if (!halves) return put_leaf(place, node), advance(node);
        const std::uint32_t pair = used_.fetch_add(2, std::memory_order_relaxed);
        put_inner(place, node, pair);
        parallel_.both([&] { build_task(pair, (*halves)[0], depth + 1); },
                       [&] { build_task(pair + 1, (*halves)[1], depth + 1); });
    }

    void build_node(std::uint32_t place, const NodeRange& node, int depth, Places& places) {
        std::optional<Halves> halves;
        if (node.refs.size() > 1) halves = split_(node, depth);
        if (!halves) return put_leaf(place, node);
        const std::uint32_t pair = places.take_pair();
        put_inner(place, node, pair);
        build_node(pair, (*halves)[0], depth + 1, places);
        build_node(pair + 1, (*halves)[1], depth + 1, places);
    }

    void put_leaf(std::uint32_t place, const NodeRange& node) {
        nodes_[place] = {node.bounds.box,
                         static_cast<std::uint32_t>(node.refs.data() - references_.data()), 0,
                         static_cast<std::uint32_t>(node.refs.size())};
    }
    void put_inner(std::uint32_t place, const NodeRange& node, std::uint32_t pair) {
        nodes_[place] = {node.bounds.box, pair, pair + 1, 0};
    }

    void advance(const NodeRange& node) const {
        parallel_.advance(static_cast<double>(node.capacity()) /
                          static_cast<double>(references_.size()));
    }

    const Parallel& parallel_;
    Split split_;
    std::size_t count_;
    ScratchVector<Reference> references_;
    ScratchVector<BuildNode> nodes_;
    std::atomic<std::uint32_t> used_ = 1;  ///< nodes; the root has the first
};

}  // namespace packet
