#include "build/kd_small_stage.h"

#include "build/clip.h"
#include "build/kd_masks.h"
#include "build/split.h"
#include "build/subtree.h"
#include "core/macros.h"

#include <algorithm>
#include <optional>

namespace packet {

namespace {

static_assert(kMaxSmallCell <= kMaxSetSize);

// Small cells of a task: a millisecond of work.
constexpr std::size_t kGrain = 32;

/// A cell within a small cell. Its references are on top of a stack.
struct SmallCell : KdRange {
    KdSet set = 0;
};

struct Part {
    Reference reference;
    std::uint32_t bit;
};

struct Children {
    std::array<SmallCell, 2> cell;
    std::array<std::array<Part, kMaxSmallCell>, 2> parts;

    void add(std::size_t side, const Part& part) {
        SmallCell& child = cell[side];
        parts[side][child.count++] = part;
        child.set |= KdSet{1} << part.bit;
        child.bounds.extend(part.reference.bounds());
    }
};

class Builder {
public:
    Builder(MeshView mesh, const BuildOptions& options, int max_cut_depth, Subtree& out)
        : mesh_(mesh), options_(options), max_cut_depth_(max_cut_depth), out_(out) {}

    void build(std::span<const Reference> references, const KdRange& root) {
        const KdMasks masks(references);
        SmallCell cell{root};
        for (std::uint32_t i = 0; i < references.size(); ++i) {
            stack_parts_.push_back({references[i], i});
            cell.set |= KdSet{1} << i;
        }
        cell.node = add_node();
        push(cell);
        while (!stack_.empty()) build_top(masks);
    }

private:
    std::uint32_t add_node() {
        out_.nodes.push_back({});
        return static_cast<std::uint32_t>(out_.nodes.size() - 1);
    }
    void push(const SmallCell& cell) { stack_.push_back(cell); }

    void build_top(const KdMasks& masks) {
        SmallCell cell = stack_.back();
        stack_.pop_back();
        std::array<Part, kMaxSmallCell> parts;
        const auto first = stack_parts_.end() - static_cast<std::ptrdiff_t>(cell.count);
        std::copy(first, stack_parts_.end(), parts.begin());
        stack_parts_.erase(first, stack_parts_.end());
        Children children;
        const bool has_two = divide(cell, parts, masks, children);
        BuildNode& node = out_.nodes[cell.node];
        node.bounds = cell.bounds;
        if (!has_two) {
            node.first = static_cast<std::uint32_t>(out_.references.size());
            node.count = static_cast<std::uint32_t>(cell.count);
            for (std::size_t i = 0; i < cell.count; ++i) {
                out_.references.push_back(parts[i].reference);
            }
            return;
        }
        node.first = static_cast<std::uint32_t>(out_.nodes.size());
        node.second = node.first + 1;
        for (auto& child : children.cell) child.node = add_node();
        for (std::size_t s : {1u, 0u}) {
            const auto& p = children.parts[s];
            stack_parts_.insert(stack_parts_.end(), p.begin(),
                                p.begin() + static_cast<std::ptrdiff_t>(children.cell[s].count));
            push(children.cell[s]);
        }
    }

    bool divide(SmallCell& cell, std::array<Part, kMaxSmallCell>& parts, const KdMasks& masks,
                Children& children) {
        for (;;) {
            if (cell.count == 1) return false;
            KdPlane plane;
            if (cell.depth < max_cut_depth_)
                plane = masks.find_cheapest_plane(cell.set, cell, options_);
            const bool is_small = cell.count <= static_cast<std::size_t>(options_.max_leaf_size);
            if (!plane.is_cut() && is_small) return false;
            children.cell = {};
            if (plane.is_cut()) {
                cut(cell, parts, plane, children);
            } else {
                deal(cell, parts, children);
            }
            if (!fits_depth(cell.depth + 1,
                            std::max(children.cell[0].count, children.cell[1].count))) {
                if (is_small) return false;
                children.cell = {};
                deal(cell, parts, children);
            }
            for (SmallCell& child : children.cell) child.depth = cell.depth + 1;
            share_out<SmallCell>(cell, children.cell);
            if (children.cell[0].count != 0 && children.cell[1].count != 0) return true;
            const std::size_t s = children.cell[0].count == 0 ? 1 : 0;
            children.cell[s].node = cell.node;
            cell = children.cell[s];
            parts = children.parts[s];
        }
    }

    void cut(const SmallCell& cell, const std::array<Part, kMaxSmallCell>& parts,
             const KdPlane& plane, Children& children) {
        for (std::size_t i = 0; i < cell.count; ++i) {
            const Part& part = parts[i];
            const int side = plane.side_of(part.reference);
            if (side != kBothSides) {
                children.add(static_cast<std::size_t>(side), part);
                continue;
            }
            const CutReference cut =
                cut_reference(mesh_, part.reference, plane.axis, plane.position);
            for (std::size_t s = 0; s < 2; ++s) {
                if (!cut.side[s].bounds().empty()) children.add(s, {cut.side[s], part.bit});
            }
        }
    }

    void deal(const SmallCell& cell, const std::array<Part, kMaxSmallCell>& parts,
              Children& children) {
        std::array<Reference, kMaxSmallCell> references;
        for (std::size_t i = 0; i < cell.count; ++i) references[i] = parts[i].reference;
        const auto sides =
            halve(std::span<const Reference>(references.data(), cell.count), cell.bounds);
        for (std::size_t i = 0; i < cell.count; ++i) children.add(sides[i], parts[i]);
    }

    MeshView mesh_;
    const BuildOptions& options_;
    int max_cut_depth_;
    Subtree& out_;
    std::vector<SmallCell> stack_;
    std::vector<Part> stack_parts_;
};

}  // namespace

Hierarchy run_small_stage(MeshView mesh, KdLargeStage large, int max_cut_depth,
                          const BuildOptions& options, const Parallel& parallel, double share) {
    Hierarchy out{std::move(large.nodes), {}};
    struct Task {
        const KdLevel* level;
        std::size_t first, last;
        std::vector<std::pair<std::uint32_t, std::uint32_t>> roots;
        Subtree tree;
        std::size_t node_base = 0, reference_base = 0;
    };
    std::vector<Task> tasks;
    for (const KdLevel& level : large.small) {
        for (std::size_t i = 0; i < level.cells.size(); i += kGrain) {
            tasks.push_back({&level, i, std::min(i + kGrain, level.cells.size()), {}, {}});
        }
    }
    parallel.for_pieces(tasks.size(), 1, [&](std::size_t t, std::size_t) {
        Task& task = tasks[t];
        Builder builder(mesh, options, max_cut_depth, task.tree);
        double work = 0.0;
        for (std::size_t i = task.first; i < task.last; ++i) {
            const KdRange& cell = task.level->cells[i];
            task.roots.emplace_back(cell.node, static_cast<std::uint32_t>(task.tree.nodes.size()));
            builder.build(task.level->references_of(cell), cell);
            work += cell.work;
        }
        parallel.advance(share * work);
    });
    std::size_t nodes = out.nodes.size(), references = 0;
    for (Task& task : tasks) {
        task.node_base = nodes;
        task.reference_base = references;
        nodes += task.tree.nodes.size();
        references += task.tree.references.size();
    }
    out.nodes.resize(nodes);
    out.references.resize(references);
    parallel.for_pieces(tasks.size(), 1, [&](std::size_t t, std::size_t) {
        Task& task = tasks[t];
        std::copy(task.tree.references.begin(), task.tree.references.end(),
                  out.references.begin() + static_cast<std::ptrdiff_t>(task.reference_base));
        BuildNode* to = out.nodes.data() + task.node_base;
        for (std::size_t i = 0; i < task.tree.nodes.size(); ++i) {
            BuildNode node = task.tree.nodes[i];
            node.first +=
                static_cast<std::uint32_t>(node.is_leaf() ? task.reference_base : task.node_base);
            node.second += static_cast<std::uint32_t>(task.node_base);
            to[i] = node;
        }
        for (const auto& [slot, root] : task.roots) out.nodes[slot] = to[root];
        task.tree = {};
    });
    return out;
}

}  // namespace packet
