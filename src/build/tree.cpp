#include "build/tree.h"

#include "build/collapse.h"
#include "build/triangle_block.h"

#include <packet/error.h>

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

namespace packet {

namespace {

// Of the time that making a tree of a hierarchy takes, about.
constexpr double kShareOfNodes = 0.3, kShareOfCollapse = 0.5;

Node make_node(const BuildNode& source) {
    Node node = {};
    for (int a = 0; a < 3; ++a) {
        node.plane[0][a] = source.bounds.lower[a];
        node.plane[1][a] = source.bounds.upper[a];
    }
    node.link = source.first;  // a leaf's first reference, until its items are placed
    node.count = source.count;
    return node;
}

/// Adds a node to the statistics: its cost counts as often as a random ray that meets the root's
/// box meets its own.
void count_node(const BuildNode& node, int depth, double root_area, const BuildOptions& options,
                BuildStats& stats) {
    const double share = static_cast<double>(node.bounds.half_area()) / root_area;
    stats.depth = std::max(stats.depth, depth);
    ++stats.node_count;
    stats.leaf_count += node.is_leaf();
    stats.sah_cost += share * (node.is_leaf() ? static_cast<double>(options.intersection_cost) *
                                                    static_cast<double>(node.count)
                                              : static_cast<double>(options.traversal_cost));
}

/// Of a large array what is not used is never touched, and so takes no memory, but copying it takes
/// long.
template <class T>
void trim(AlignedVector<T>& nodes) {
    constexpr std::size_t kLarge = std::size_t{4} << 20;
    if (nodes.capacity() * sizeof(T) < kLarge) nodes.shrink_to_fit();
}

/// The binary nodes, depth first. Yields which of them are wide children, if the builder says so.
/// Iterative: small stacks of threads are not ours to fill.
std::vector<bool> linearize(const Hierarchy& hierarchy, const BuildOptions& options,
                            const Parallel& parallel, Tree& tree) {
    constexpr std::size_t kCheckInterval = 4096;
    struct Pending {
        std::uint32_t source, parent;
        int depth;
    };
    constexpr std::uint32_t kNoParent = 0xFFFFFFFF;
    const double root_area =
        std::max(static_cast<double>(tree.bounds.half_area()), std::numeric_limits<double>::min());
    std::vector<bool> is_wide_child;
    tree.nodes.reserve(hierarchy.nodes.size());
    std::vector<Pending> stack = {{0, kNoParent, 0}};
    while (!stack.empty()) {
        const Pending p = stack.back();
        stack.pop_back();
        const BuildNode& source = hierarchy.nodes[p.source];
        const auto index = static_cast<std::uint32_t>(tree.nodes.size());
        if (index % kCheckInterval == 0) parallel.check();
        if (p.parent != kNoParent) tree.nodes[p.parent].link = index;
        tree.nodes.push_back(make_node(source));
        if (!hierarchy.is_wide_child.empty()) {
            is_wide_child.push_back(hierarchy.is_wide_child[p.source]);
        }
        count_node(source, p.depth, root_area, options, tree.stats);
        if (source.is_leaf()) continue;
        stack.push_back({source.second, index, p.depth + 1});
        stack.push_back({source.first, kNoParent, p.depth + 1});
    }
    trim(tree.nodes);
    return is_wide_child;
}

/// Both forms of the tree, and where the references become items.
Collapsed make_nodes(const Hierarchy& hierarchy, const BuildOptions& options,
                     std::uint32_t block_size, const Parallel& parallel, Tree& tree) {
    if (hierarchy.references.empty()) return {};
    tree.bounds = hierarchy.nodes[0].bounds;
    const std::vector<bool> is_wide_child = linearize(hierarchy, options, parallel, tree);
    parallel.advance(kShareOfNodes);
    Collapsed collapsed = collapse(tree.nodes, block_size, is_wide_child, parallel);
    parallel.advance(kShareOfCollapse);
    tree.wide_nodes = std::move(collapsed.nodes);
    trim(tree.wide_nodes);
    return collapsed;
}

/// Stores the triangles of up to kBlockSize items; nothing hits the other lanes.
void fill_block(TriangleBlock& block, std::span<const std::uint32_t> items, MeshView mesh,
                std::span<const Reference> references) {
    block = make_empty_block();
    for (std::size_t lane = 0; lane < items.size(); ++lane) {
        if (items[lane] != kNoReference) {
            put_triangle(block, lane, mesh, references[items[lane]].id);
        }
    }
}

}  // namespace

TreeView Tree::view() const noexcept {
    TreeView out;
    out.nodes = nodes.data();
    out.wide_nodes = wide_nodes.data();
    out.blocks = blocks.data();
    if (!treelets.begin.empty()) {
        out.treelet_begin = treelets.begin.data();
        out.treelet_of_node = treelets.of_node.data();
        out.most_treelet_exits = treelets.most_exits;
        out.treelet_count = static_cast<std::uint32_t>(treelets.begin.size() - 1);
    }
    out.grid = grid.view();
    out.node_count = static_cast<std::uint32_t>(nodes.size());
    for (int a = 0; a < 3 && !out.is_empty(); ++a) {
        out.lower[a] = bounds.lower[a];
        out.upper[a] = bounds.upper[a];
    }
    return out;
}

std::size_t Tree::byte_count() const noexcept {
    return nodes.size() * sizeof(Node) + wide_nodes.size() * sizeof(WideNode) +
           blocks.size() * sizeof(TriangleBlock) + grid.byte_count() +
           (treelets.begin.size() + treelets.of_node.size()) * sizeof(std::uint32_t);
}

Tree make_tree(const Hierarchy& hierarchy, MeshView mesh, const BuildOptions& options,
               const Parallel& parallel) {
    constexpr std::size_t kGrain = 512;
    Tree tree;
    const Collapsed collapsed = make_nodes(hierarchy, options, kBlockSize, parallel, tree);
    const std::span<const std::uint32_t> items = collapsed.reference_of_item;
    tree.blocks.resize((items.size() + kBlockSize - 1) / kBlockSize);
    parallel.run([&] {
        parallel.for_pieces(tree.blocks.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t b = begin; b < end; ++b) {
                const std::size_t first = b * kBlockSize;
                const auto count = std::min<std::size_t>(kBlockSize, items.size() - first);
                fill_block(tree.blocks[b], items.subspan(first, count), mesh, hierarchy.references);
            }
        });
    });
    tree.stats.bytes = tree.byte_count();
    return tree;
}

Tree make_tree(const Hierarchy& hierarchy, const BuildOptions& options, const Parallel& parallel) {
    Tree tree;
    // items are the references in their order
    (void)make_nodes(hierarchy, options, 1, parallel, tree);
    tree.stats.bytes = tree.byte_count();
    return tree;
}

void validate(const BuildOptions& options) {
    const auto check = [](bool good, const char* rule) {
        if (!good) throw Error(ErrorCode::kBadValue, rule);
    };
    check(options.max_leaf_size >= 1 && options.max_leaf_size <= 64,
          "BuildOptions::max_leaf_size must be 1 to 64");
    check(options.traversal_cost >= 0.0f && options.traversal_cost <= 1e6f,
          "BuildOptions::traversal_cost must be 0 to 1e6");
    check(options.intersection_cost > 0.0f && options.intersection_cost <= 1e6f,
          "BuildOptions::intersection_cost must be above 0, up to 1e6");
    check(options.max_reference_factor >= 1.0f && options.max_reference_factor <= 64.0f,
          "BuildOptions::max_reference_factor must be 1 to 64");
    check(options.spatial_budget >= 0.0f && options.spatial_budget <= 8.0f,
          "BuildOptions::spatial_budget must be 0 to 8");
    check(options.octree_levels >= 0 && options.octree_levels <= kMaxDepth / 3,
          "BuildOptions::octree_levels must be 0 to 21");
    check(options.grid_density >= 1.0f / 64.0f && options.grid_density <= 64.0f,
          "BuildOptions::grid_density must be 1/64 to 64");
    check(options.morton_bits == 0 || options.morton_bits == 30 || options.morton_bits == 63,
          "BuildOptions::morton_bits must be 0, 30 or 63");
}

}  // namespace packet
