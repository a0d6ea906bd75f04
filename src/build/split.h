// What builders that sort references from the top down have in common: each splits a node's
// references in two, and those again; they differ only in where.
#pragma once

#include "build/hierarchy.h"
#include "core/views.h"

#include <algorithm>
#include <bit>
#include <cstddef>
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

    void extend(const Reference& r) noexcept {
        box.extend(r.bounds());
        centroids.extend(centroid2(r));
    }
    void extend(const NodeBounds& other) noexcept {
        box.extend(other.box);
        centroids.extend(other.centroids);
    }
};

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
[[nodiscard]] inline bool fits_depth(int child_depth, std::size_t larger_child) noexcept {
    return child_depth + static_cast<int>(std::bit_width(larger_child - 1)) <= kMaxDepth;
}

/// Whether `first` of `count` references at `depth` may go to one side and the others to the other:
/// neither side is empty, and both fit.
[[nodiscard]] inline bool is_allowed(std::size_t first, std::size_t count, int depth) noexcept {
    return first != 0 && first != count && fits_depth(depth + 1, std::max(first, count - first));
}

/// Sorts half of the references to each side, by centroid along the widest axis, then by id.
/// Returns where the second half starts.
[[nodiscard]] std::size_t halve(ReferenceSpan refs, const Bounds3f& centroids);

/// Builds by splitting. `split(refs, bounds, depth)` sorts at least two references at `depth` to
/// two sides and returns how many are on the first, or 0 for a leaf. It is called by several
/// threads at once; is_allowed() must hold of what it returns.
template <class Split>
class TopDownBuilder {
public:
    TopDownBuilder(AlignedVector<Reference> references, const Parallel& parallel, Split split)
        : parallel_(parallel), split_(std::move(split)), references_(std::move(references)) {
        // A subtree of n references has at most 2n - 1 nodes: its slots are known before its size
        // is.
        if (!references_.empty()) nodes_.resize(2 * references_.size() - 1);
    }

    [[nodiscard]] Hierarchy build() && {
        if (!references_.empty()) {
            parallel_.run([&] { build_node(0, references_, measure(references_, parallel_), 0); });
        }
        return {std::move(nodes_), std::move(references_)};
    }

private:
    void build_node(std::size_t slot, ReferenceSpan refs, const NodeBounds& bounds, int depth) {
        // Below this a task costs more than the work it moves to another core.
        constexpr std::size_t kTaskSize = 4096;
        BuildNode& node = nodes_[slot] = {};
        node.bounds = bounds.box;
        const std::size_t first = refs.size() == 1 ? 0 : split_(refs, bounds, depth);
        if (first == 0) {
            node.first = static_cast<std::uint32_t>(refs.data() - references_.data());
            node.count = static_cast<std::uint32_t>(refs.size());
            return;
        }
        const std::size_t slot0 = slot + 1, slot1 = slot + 2 * first;
        node.first = static_cast<std::uint32_t>(slot0);
        node.second = static_cast<std::uint32_t>(slot1);
        const auto build_child = [&](std::size_t child, ReferenceSpan items) {
            build_node(child, items, measure(items, parallel_), depth + 1);
            if (refs.size() > kTaskSize && items.size() <= kTaskSize) advance(items.size());
        };
        const auto build0 = [&] { build_child(slot0, refs.first(first)); };
        const auto build1 = [&] { build_child(slot1, refs.subspan(first)); };
        if (refs.size() > kTaskSize) {
            parallel_.both(build0, build1);
        } else {
            build0();
            build1();
        }
    }

    void advance(std::size_t references) const {
        parallel_.advance(static_cast<double>(references) /
                          static_cast<double>(references_.size()));
    }

    const Parallel& parallel_;
    Split split_;
    AlignedVector<Reference> references_;
    ScratchVector<BuildNode> nodes_;
};

}  // namespace packet
