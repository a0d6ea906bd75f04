#include "build/grid_of_trees.h"

#include "build/bvh_sah.h"
#include "build/grid_layout.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace packet {

namespace {

// The grid has this many of the cells that a uniform grid would have. Four times as many build more
// slowly, for they cut more triangles, and trace more slowly, for trees find what is near faster.
constexpr double kCellShare = 1.0 / 128.0;
// Two blocks: testing both costs about as much as a node that tells which of them to test.
constexpr std::uint32_t kLongestList = 16;
// Of the build's time, about.
constexpr double kShareOfGrid = 0.3, kShareOfTrees = 0.7;
// Trees of more references than this are built by all threads, one after the other.
constexpr std::uint32_t kSharedTree = 65536;

/// Where triangles' references are, by id: behind skipped ones not where their ids say.
class ReferenceOf {
public:
    ReferenceOf(MeshView mesh, const ScratchVector<Reference>& references, const Parallel& parallel)
        : references_(references) {
        if (references.size() == mesh.triangles.size()) return;
        place_.resize(mesh.triangles.size());
        constexpr std::size_t kGrain = 65536;
        parallel.for_pieces(references.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                place_[references[i].id] = static_cast<std::uint32_t>(i);
            }
        });
    }

    [[nodiscard]] const Reference& operator()(std::uint32_t id) const {
        return references_[place_.empty() ? id : place_[id]];
    }

private:
    const ScratchVector<Reference>& references_;
    ScratchVector<std::uint32_t> place_;
};

/// What of its box is in a cell: cutting the triangle itself costs more than it gains.
Reference clip_to(const Bounds3f& cell, const Reference& reference) {
    return {glm::max(reference.lower, cell.lower), reference.id,
            glm::min(reference.upper, cell.upper)};
}

class TreesBuilder {
public:
    TreesBuilder(const CellLists& cells, MeshView mesh, const ScratchVector<Reference>& references,
                 const BuildOptions& options, const Parallel& parallel)
        : cells_(cells),
          mesh_(mesh),
          reference_of_(mesh, references, parallel),
          options_(options),
          parallel_(parallel) {
        for (std::size_t i = 0; i < cells.lists.size(); ++i) {
            if (cells.lists[i].count <= kLongestList) continue;
            crowded_.push_back(i);
            reference_count_ += cells.lists[i].count;
        }
    }

    /// Adds the trees to a grid that has only lists.
    void add_to(Tree& out) {
        trees_.resize(crowded_.size());
        for (std::size_t i = 0; i < trees_.size(); ++i) {
            if (list(i).count > kSharedTree) trees_[i] = build(list(i), parallel_.threads());
        }
        parallel_.for_pieces(trees_.size(), 1, [&](std::size_t i, std::size_t) {
            if (list(i).count <= kSharedTree) trees_[i] = build(list(i), 1);
        });
        place(out);
        parallel_.for_pieces(trees_.size(), 1, [&](std::size_t i, std::size_t) {
            const GridTree& begin = out.grid.trees[i];
            copy(trees_[i].nodes, out.nodes, begin.node);
            copy(trees_[i].wide_nodes, out.wide_nodes, begin.wide_node);
            copy(trees_[i].blocks, out.blocks, begin.block);
            trees_[i] = {};
        });
    }

private:
    [[nodiscard]] const CellList& list(std::size_t tree) const {
        return cells_.lists[crowded_[tree]];
    }

    [[nodiscard]] Tree build(const CellList& in, int threads) const {
        // Hierarchy and tree advance it by a whole each.
        const double share = kShareOfTrees / 2.0 * static_cast<double>(in.count) /
                             static_cast<double>(reference_count_);
        const Parallel parallel = parallel_.part(threads, share);
        const Bounds3f cell = cells_.space.box_of(cells_.space.cell_of(in.cell));
        ScratchVector<Reference> references(in.count);
        for (std::size_t i = 0; i < in.count; ++i) {
            references[i] = clip_to(cell, reference_of_(cells_.ids[in.first + i]));
        }
        return make_tree(build_bvh_sah_by_cells(std::move(references), options_, parallel), mesh_,
                         options_, parallel);
    }

    /// Makes room for the trees behind what there is, and adds up their statistics.
    void place(Tree& out) const {
        std::size_t nodes = 0, wide_nodes = 0, blocks = out.blocks.size();
        const double box_area = std::max(static_cast<double>(out.bounds.half_area()), 1e-300);
        for (std::size_t i = 0; i < trees_.size(); ++i) {
            const Tree& tree = trees_[i];
            out.grid.cells[crowded_[i]] = {static_cast<std::uint32_t>(i), 0};
            out.grid.trees.push_back({static_cast<std::uint32_t>(nodes),
                                      static_cast<std::uint32_t>(wide_nodes),
                                      static_cast<std::uint32_t>(blocks)});
            nodes += tree.nodes.size();
            wide_nodes += tree.wide_nodes.size();
            blocks += tree.blocks.size();
            out.stats.depth = std::max(out.stats.depth, tree.stats.depth);
            out.stats.node_count += tree.stats.node_count;
            out.stats.leaf_count += tree.stats.leaf_count - 1;  // its cell is none
            out.stats.sah_cost +=
                tree.stats.sah_cost * static_cast<double>(tree.bounds.half_area()) / box_area;
        }
        out.nodes.resize(nodes);
        out.wide_nodes.resize(wide_nodes);
        out.blocks.resize(blocks);
    }

    template <class From, class To>
    static void copy(const From& from, To& to, std::uint32_t begin) {
        std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(begin));
    }

    const CellLists& cells_;
    MeshView mesh_;
    ReferenceOf reference_of_;
    const BuildOptions& options_;  ///< of the trees
    const Parallel& parallel_;
    std::vector<std::size_t> crowded_;  ///< lists that become trees
    std::size_t reference_count_ = 0;   ///< in these
    std::vector<Tree> trees_;           ///< theirs
};

}  // namespace

Tree build_grid_of_trees(MeshView mesh, const ScratchVector<Reference>& references,
                         const BuildOptions& options, const Parallel& parallel) {
    Tree out;
    if (references.empty()) return out;
    parallel.run([&] {
        const Parallel grid = parallel.part(parallel.threads(), kShareOfGrid);
        const CellLists cells =
            sort_into_cells(mesh, references,
                            kCellShare * static_cast<double>(options.grid_density), options, grid);
        out = make_grid(cells, kLongestList, mesh, grid);
        out.stats.sah_cost = expected_cost(cells, kLongestList, options);
        TreesBuilder(cells, mesh, references, options, parallel).add_to(out);
    });
    out.stats.bytes = out.byte_count();
    return out;
}

}  // namespace packet
