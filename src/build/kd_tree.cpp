// Every k-d tree but that of kd_levels.h is built by the same recursion: find a plane by the tree's
// rule, cut the cell, and again. Cells shrink to what they hold, so nodes are boxes as in any other
// tree and no space that is empty is ever in one. What no plane parts well is dealt out to two
// nodes that overlap.
//
// Wald, Havran. On building fast kd-trees for ray tracing, and on doing that in O(N log N).
// Interactive Ray Tracing 2006.
#include "build/kd_tree.h"

#include "build/kd_cell.h"
#include "build/kd_events.h"
#include "build/kd_levels.h"
#include "build/split.h"
#include "build/subtree.h"
#include "core/macros.h"

#include <packet/error.h>

#include <algorithm>
#include <optional>

namespace packet {

namespace {

// Below this a task costs more than the work it moves to another core.
constexpr std::size_t kTaskSize = 4096;

class Builder {
public:
    Builder(KdRule rule, MeshView mesh, const BuildOptions& options, const Parallel& parallel)
        : rule_(rule), mesh_(mesh), options_(options), parallel_(parallel) {}

    /// With at most `most` references.
    Hierarchy build(ScratchVector<Reference> references, std::size_t most) {
        if (references.empty()) return {};
        max_cut_depth_ = max_cut_depth(references.size());
        KdCell root;
        fill_root(root, std::move(references), options_, most);
        Subtree tree;
        parallel_.run([&] {
            if (rule_ == KdRule::kSah) root.events = make_events(root.references, parallel_);
            build_node(std::move(root), tree);
        });
        return to_hierarchy(std::move(tree), parallel_);
    }

private:
    void build_node(KdCell cell, Subtree& out) {
        const auto slot = static_cast<std::uint32_t>(out.nodes.size());
        out.nodes.push_back({cell.bounds});
        const std::size_t count = cell.references.size();
        std::optional<KdChildren> children = divide(cell);
        if (!children) {
            out.fill_leaf(slot, cell.references);
            return;
        }
        cell = {};  // it would otherwise stay while all below is built
        if (count > kTaskSize) {
            // Its parent was as large, so this is the root of its subtree.
            PACKET_ASSERT(slot == 0);
            Subtree &tree0 = out.hang(slot, 0), &tree1 = out.hang(slot, 1);
            parallel_.both([&] { build_task(std::move(children->cell[0]), tree0); },
                           [&] { build_task(std::move(children->cell[1]), tree1); });
            return;
        }
        out.nodes[slot].first = static_cast<std::uint32_t>(out.nodes.size());
        build_node(std::move(children->cell[0]), out);
        out.nodes[slot].second = static_cast<std::uint32_t>(out.nodes.size());
        build_node(std::move(children->cell[1]), out);
    }

    void build_task(KdCell cell, Subtree& out) {
        const double work = cell.references.size() > kTaskSize ? 0.0 : cell.work;
        build_node(std::move(cell), out);
        parallel_.advance(work);
    }

    /// The two cells to go on with, or none for a leaf. May shrink the cell on the way.
    std::optional<KdChildren> divide(KdCell& cell) const {
        for (;;) {
            parallel_.check();
            const std::size_t count = cell.references.size();
            if (count == 1) return {};
            const KdPlane plane = cell.depth < max_cut_depth_ ? find_plane(cell) : KdPlane{};
            const bool is_small = count <= static_cast<std::size_t>(options_.max_leaf_size);
            if (!plane.is_cut() && is_small) return {};
            KdChildren children = plane.is_cut() ? cut_cell(mesh_, cell, plane, parallel_)
                                                 : halve_cell(cell, parallel_);
            if (!fit_depth(children)) {
                if (is_small) return {};
                children = halve_cell(cell, parallel_);
            }
            if (rule_ == KdRule::kSah) split_events(cell.events, children, parallel_);
            auto& [cell0, cell1] = children.cell;
            if (!cell0.references.empty() && !cell1.references.empty()) return children;
            // A node of one child is that child.
            cell = std::move(cell0.references.empty() ? cell1 : cell0);
        }
    }

    static bool fit_depth(const KdChildren& children) {
        return fits_depth(children.cell[0].depth, std::max(children.cell[0].references.size(),
                                                           children.cell[1].references.size()));
    }

    KdPlane find_plane(const KdCell& cell) const {
        if (rule_ == KdRule::kSah) return find_cheapest_plane(cell, options_, parallel_);
        const KdCost cost(cell, options_);
        // An axis along which cutting does not pay leaves its turn to the next.
        for (int turn = 0; turn < 3; ++turn) {
            const int axis = (cell.depth + turn) % 3;
            KdPlane plane;
            plane.axis = axis;
            plane.position = rule_ == KdRule::kMedian ? median(cell, axis) : middle(cell, axis);
            KdCounts counts;
            for (const Reference& r : cell.references) {
                const int side = plane.side_of(r);
                counts.side[0] += side != 1;
                counts.side[1] += side != 0;
            }
            plane.cost = cost.cut(axis, plane.position, plane.position, counts);
            if (counts.allow_cut(cell) && plane.cost < cost.leaf()) return plane;
        }
        return {};
    }

    static float middle(const KdCell& cell, int axis) { return cell.bounds.center()[axis]; }

    static float median(const KdCell& cell, int axis) {
        std::vector<float> centroids;
        centroids.reserve(cell.references.size());
        for (const Reference& r : cell.references) centroids.push_back(r.bounds().center()[axis]);
        const auto half = centroids.begin() + static_cast<std::ptrdiff_t>(centroids.size() / 2);
        std::nth_element(centroids.begin(), half, centroids.end());
        // Between the two in the middle, so that a plane at a median cuts no more than it must.
        const float below =
            half == centroids.begin() ? *half : *std::max_element(centroids.begin(), half);
        return 0.5f * below + 0.5f * *half;
    }

    KdRule rule_;
    MeshView mesh_;
    const BuildOptions& options_;
    const Parallel& parallel_;
    int max_cut_depth_ = 0;
};

}  // namespace

Hierarchy build_kd_tree(KdRule rule, MeshView mesh, ScratchVector<Reference> references,
                        const BuildOptions& options, const Parallel& parallel) {
    const bool by_levels = rule == KdRule::kSah && options.kd_build == KdBuild::kBreadthFirst;
    const std::size_t most =
        rule == KdRule::kSah && !by_levels ? kMaxEventReferences : kMaxReferences;
    if (references.size() > most) {
        throw Error(ErrorCode::kTooLarge,
                    "a k-d tree refers to at most " + std::to_string(most) + " triangles");
    }
    if (by_levels) return build_kd_levels(mesh, std::move(references), options, parallel);
    return Builder(rule, mesh, options, parallel).build(std::move(references), most);
}

}  // namespace packet
