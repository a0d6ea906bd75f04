#include "build/kd_small_stage.h"

#include "build/clip.h"
#include "build/kd_cell.h"
#include "build/kd_masks.h"
#include "build/split.h"
#include "core/macros.h"

#include <algorithm>
#include <utility>

namespace packet {

namespace {

static_assert(kMaxSmallCell <= kMaxSetSize);

// Small cells of a task: about a millisecond of work.
constexpr std::size_t kGrain = 32;

/// A cell within a small cell.
struct SetCell : KdRange {
    KdSet set = 0;
};

/// A reference, or what cuts have left of it.
struct Part {
    Reference reference;
    std::uint32_t bit;  ///< in sets
};

/// Neighbouring small cells, and what becomes of them: indices are within.
struct Task {
    const KdLevel* level;
    std::size_t first_cell, last_cell;
    std::vector<BuildNode> nodes;
    std::vector<Reference> references;
    std::vector<std::uint32_t> roots;                 ///< by small cell
    std::size_t first_node = 0, first_reference = 0;  ///< in the hierarchy

    [[nodiscard]] std::span<const KdRange> cells() const {
        return std::span(level->cells).subspan(first_cell, last_cell - first_cell);
    }
};

class Builder {
public:
    Builder(MeshView mesh, const BuildOptions& options, int max_cut_depth, Task& out)
        : mesh_(mesh), options_(options), max_cut_depth_(max_cut_depth), out_(out) {}

    /// Appends all that becomes of a small cell.
    void build(std::span<const Reference> references, const KdRange& root) {
        const KdMasks masks(references);
        SetCell cell{root};
        cell.node = static_cast<std::uint32_t>(out_.nodes.size());
        out_.roots.push_back(cell.node);
        out_.nodes.emplace_back();
        for (std::uint32_t i = 0; i < references.size(); ++i) {
            pending_parts_.push_back({references[i], i});
            cell.set |= KdSet{1} << i;
        }
        pending_.push_back(cell);
        while (!pending_.empty()) build_node(masks, pop());
    }

private:
    /// Moves the last pending cell's references to parts_.
    SetCell pop() {
        const SetCell cell = pending_.back();
        pending_.pop_back();
        const auto first = pending_parts_.end() - static_cast<std::ptrdiff_t>(cell.count);
        parts_.assign(first, pending_parts_.end());
        pending_parts_.erase(first, pending_parts_.end());
        return cell;
    }

    void build_node(const KdMasks& masks, SetCell cell) {
        const bool is_leaf = !divide(masks, cell);
        BuildNode& node = out_.nodes[cell.node];
        node.bounds = cell.bounds;
        if (is_leaf) {
            node.first = static_cast<std::uint32_t>(out_.references.size());
            node.count = static_cast<std::uint32_t>(parts_.size());
            for (const Part& part : parts_) out_.references.push_back(part.reference);
            return;
        }
        node.first = static_cast<std::uint32_t>(out_.nodes.size());
        node.second = node.first + 1;
        for (std::uint32_t s = 0; s < 2; ++s) child_[s].node = node.first + s;
        out_.nodes.resize(out_.nodes.size() + 2);
        for (const std::size_t s : {1u, 0u}) {  // the first child is built first
            pending_.push_back(child_[s]);
            pending_parts_.insert(pending_parts_.end(), child_parts_[s].begin(),
                                  child_parts_[s].end());
        }
    }

    /// Whether the cell is cut, into the children. May shrink it on the way.
    bool divide(const KdMasks& masks, SetCell& cell) {
        while (cell.count > 1) {
            KdPlane plane;
            if (cell.depth < max_cut_depth_) {
                plane = masks.find_cheapest_plane(cell.set, cell, options_);
            }
            const bool is_small = cell.count <= static_cast<std::size_t>(options_.max_leaf_size);
            if (!plane.is_cut() && is_small) return false;
            part(cell, plane);
            if (!fits_depth(cell.depth + 1, std::max(child_[0].count, child_[1].count))) {
                if (is_small) return false;
                part(cell, {});
            }
            share_out<SetCell>(cell, child_);
            if (child_[0].count != 0 && child_[1].count != 0) return true;
            // A node of one child is that child.
            const std::size_t side = child_[0].count == 0 ? 1 : 0;
            child_[side].node = cell.node;
            cell = child_[side];
            parts_.swap(child_parts_[side]);
        }
        return false;
    }

    /// Parts the references by the plane or, without one, into halves.
    void part(const SetCell& cell, const KdPlane& plane) {
        for (std::size_t s = 0; s < 2; ++s) {
            child_[s] = {};
            child_[s].depth = cell.depth + 1;
            child_parts_[s].clear();
        }
        if (plane.is_cut()) {
            for (const Part& part : parts_) cut(part, plane);
            return;
        }
        std::vector<Reference> references;
        for (const Part& part : parts_) references.push_back(part.reference);
        const std::vector<std::uint8_t> sides = sides_of_halves(references, cell.bounds);
        for (std::size_t i = 0; i < parts_.size(); ++i) add(sides[i], parts_[i]);
    }

    void cut(const Part& part, const KdPlane& plane) {
        const int side = plane.side_of(part.reference);
        if (side != kBothSides) return add(static_cast<std::size_t>(side), part);
        const CutReference cut = cut_reference(mesh_, part.reference, plane.axis, plane.position);
        for (std::size_t s = 0; s < 2; ++s) {
            if (!cut.side[s].bounds().empty()) add(s, {cut.side[s], part.bit});
        }
    }

    void add(std::size_t side, const Part& part) {
        SetCell& child = child_[side];
        ++child.count;
        child.set |= KdSet{1} << part.bit;
        child.bounds.extend(part.reference.bounds());
        child_parts_[side].push_back(part);
    }

    MeshView mesh_;
    const BuildOptions& options_;
    int max_cut_depth_;
    Task& out_;
    std::vector<SetCell> pending_;
    std::vector<Part> pending_parts_;  ///< the pending cells' references, in their order
    std::vector<Part> parts_;          ///< the references of the cell that is divided
    std::array<SetCell, 2> child_;
    std::array<std::vector<Part>, 2> child_parts_;
};

std::vector<Task> make_tasks(std::span<const KdLevel> levels) {
    std::vector<Task> tasks;
    for (const KdLevel& level : levels) {
        for (std::size_t i = 0; i < level.cells.size(); i += kGrain) {
            tasks.push_back({&level, i, std::min(i + kGrain, level.cells.size()), {}, {}, {}});
        }
    }
    return tasks;
}

/// Copies to the hierarchy what has become of the task's cells.
void emit(Task& task, Hierarchy& out) {
    for (std::size_t i = 0; i < task.references.size(); ++i) {
        out.ids[task.first_reference + i] = task.references[i].id;
    }
    BuildNode* const nodes = out.nodes.data() + task.first_node;
    for (std::size_t i = 0; i < task.nodes.size(); ++i) {
        const BuildNode& node = nodes[i] = task.nodes[i];
        const std::size_t base = node.is_leaf() ? task.first_reference : task.first_node;
        nodes[i].first += static_cast<std::uint32_t>(base);
        if (!node.is_leaf()) nodes[i].second += static_cast<std::uint32_t>(task.first_node);
    }
    const std::span<const KdRange> cells = task.cells();
    for (std::size_t i = 0; i < cells.size(); ++i) out.nodes[cells[i].node] = nodes[task.roots[i]];
    task = {};
}

}  // namespace

Hierarchy run_small_stage(MeshView mesh, KdLargeStage large, int max_cut_depth,
                          const BuildOptions& options, const Parallel& parallel, double share) {
    std::vector<Task> tasks = make_tasks(large.small);
    parallel.for_pieces(tasks.size(), 1, [&](std::size_t i, std::size_t) {
        Builder builder(mesh, options, max_cut_depth, tasks[i]);
        double work = 0.0;
        for (const KdRange& cell : tasks[i].cells()) {
            builder.build(tasks[i].level->references_of(cell), cell);
            work += cell.work;
        }
        parallel.advance(share * work);
    });
    std::size_t node_count = large.nodes.size(), reference_count = 0;
    for (Task& task : tasks) {
        task.first_node = node_count;
        task.first_reference = reference_count;
        node_count += task.nodes.size();
        reference_count += task.references.size();
    }
    Hierarchy out{std::move(large.nodes), {}};
    out.nodes.resize(node_count);
    out.ids.resize(reference_count);
    parallel.for_pieces(tasks.size(), 1, [&](std::size_t i, std::size_t) { emit(tasks[i], out); });
    return out;
}

}  // namespace packet
