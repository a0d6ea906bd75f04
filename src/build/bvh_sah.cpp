// Splits a node where the expected cost of tracing it is least; where no split pays and the leaf is
// small enough, it is a leaf.
#include "build/bvh_sah.h"

#include "build/grid_space.h"
#include "build/object_split.h"
#include "build/reinsertion.h"
#include "build/split.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace packet {

namespace {

// Of a node's references, to find a split.
constexpr std::size_t kFewestSamples = 4096;

class SahSplit {
public:
    SahSplit(const BuildOptions& options, const Parallel& parallel)
        : costs_(options), parallel_(parallel) {}

    std::optional<Halves> operator()(const NodeRange& node, int depth) const {
        if (is_surely_leaf(node, costs_)) return {};
        const ObjectSplit split = find_object_split(node, costs_, parallel_, kFewestSamples);
        if (is_leaf(node, split.cost, costs_)) return {};
        return split_objects(node, split, depth, parallel_);
    }

private:
    SahCosts costs_;
    const Parallel& parallel_;
};

// Fewer references are not worth sorting into cells.
constexpr std::size_t kFewestForCells = 2048;
// With so many cells a reference those that a surface passes through hold some 60 triangles each.
// Where triangles fill space more cells than one in kFewestPerCell references gain nothing: then
// there are an eighth of them.
constexpr double kCellsPerReference = 0.3;
constexpr std::size_t kFewestPerCell = 16;

/// References in the order of their cells.
struct CellOrder {
    ScratchVector<Reference> references;
    std::vector<NodeRange> cells;  ///< those that have any
};

/// The cell of each reference, by number, and how many each cell has.
struct CellCounts {
    ScratchVector<std::uint32_t> cell_of;
    std::vector<std::uint32_t> counts;

    CellCounts(std::span<const Reference> references, const GridSpace& space,
               const Parallel& parallel)
        : cell_of(references.size()), counts(space.cell_id_end()) {
        constexpr std::size_t kGrain = 16384;
        parallel.for_pieces(references.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                cell_of[i] = space.cell_id(centroid2(references[i]));
            }
        });
        for (const std::uint32_t cell : cell_of) ++counts[cell];
    }
    [[nodiscard]] std::size_t occupied() const {
        return counts.size() - static_cast<std::size_t>(std::ranges::count(counts, 0u));
    }
};

/// Sorts references by the number of their cell. Stable.
CellOrder sort_by_cell(std::span<const Reference> references, CellCounts cells,
                       const Parallel& parallel) {
    CellOrder out;
    out.references.resize(references.size());
    std::uint32_t first = 0;
    for (std::uint32_t& place : cells.counts) {
        const std::uint32_t count = std::exchange(place, first);
        if (count == 0) continue;
        out.cells.push_back({std::span(out.references).subspan(first, count), {}, 0});
        first += count;
    }
    for (std::size_t i = 0; i < references.size(); ++i) {
        out.references[cells.counts[cells.cell_of[i]]++] = references[i];
    }
    parallel.for_pieces(out.cells.size(), 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) {
            out.cells[c].bounds = measure(out.cells[c].refs, parallel);
        }
    });
    return out;
}

CellOrder sort_into_cells(std::span<const Reference> references, const Bounds3f& centroids,
                          const Parallel& parallel) {
    const double cell_count = kCellsPerReference * static_cast<double>(references.size());
    CellCounts cells(references, GridSpace(centroids, cell_count), parallel);
    if (kFewestPerCell * cells.occupied() > references.size()) {
        cells = CellCounts(references, GridSpace(centroids, cell_count / 8.0), parallel);
    }
    return sort_by_cell(references, std::move(cells), parallel);
}

/// A tree with a leaf for each cell.
Hierarchy build_above(std::span<const NodeRange> cells, const Parallel& parallel) {
    ScratchVector<Reference> boxes(cells.size());
    for (std::size_t c = 0; c < cells.size(); ++c) {
        const Bounds3f& box = cells[c].bounds.box;
        boxes[c] = {box.lower, static_cast<std::uint32_t>(c), box.upper};
    }
    BuildOptions options;
    options.max_leaf_size = 1;
    const Parallel unseen = parallel.part(parallel.threads(), 0.0);
    return TopDownBuilder(std::move(boxes), 0, unseen, SahSplit(options, unseen)).build();
}

bool all_fit(std::span<const Leaf> leaves, std::span<const NodeRange> cells) {
    return std::ranges::all_of(leaves, [&](const Leaf& leaf) {
        return fits_depth(leaf.depth, cells[leaf.id].refs.size());
    });
}

}  // namespace

Hierarchy build_bvh_sah(ScratchVector<Reference> references, const BuildOptions& options,
                        const Parallel& parallel) {
    Hierarchy out =
        TopDownBuilder(std::move(references), 0, parallel, SahSplit(options, parallel)).build();
    reinsert_subtrees(out, parallel);
    return out;
}

Hierarchy build_bvh_sah_by_cells(ScratchVector<Reference> references, const BuildOptions& options,
                                 const Parallel& parallel) {
    const auto build_plainly = [&] {
        return build_bvh_sah(std::move(references), options, parallel);
    };
    if (references.size() < kFewestForCells) return build_plainly();
    const Bounds3f centroids = measure(references, parallel).centroids;
    const glm::vec3 extent = centroids.extent();
    if (!std::isfinite(extent.x + extent.y + extent.z)) return build_plainly();
    CellOrder order = sort_into_cells(references, centroids, parallel);
    const Hierarchy above = build_above(order.cells, parallel);
    const std::vector<Leaf> leaves = leaves_of(above);
    if (!all_fit(leaves, order.cells)) return build_plainly();
    references = {};
    Hierarchy out =
        TopDownBuilder(std::move(order.references), 0, parallel, SahSplit(options, parallel))
            .build_below(above, leaves, order.cells);
    reinsert_subtrees(out, parallel);
    return out;
}

}  // namespace packet
