#include "build/tree.h"

#include "build/collapse.h"

#include <packet/error.h>

#include <functional>
#include <span>
#include <vector>

namespace packet {

namespace {

// Of the time that making a tree of a hierarchy takes, about.
constexpr double kShareOfCuts = 0.2, kShareOfCollapse = 0.8;

Node make_node(const BuildNode& source, std::uint32_t link) {
    Node node = {};
    for (int a = 0; a < 3; ++a) {
        node.plane[0][a] = source.bounds.lower[a];
        node.plane[1][a] = source.bounds.upper[a];
    }
    node.link = link;
    node.count = source.count;
    return node;
}

/// The binary nodes, depth first. Iterative: small stacks of threads are not ours to fill.
ScratchVector<Node> linearize(const Hierarchy& hierarchy, std::size_t node_count,
                              std::span<const std::uint32_t> first_item, const Parallel& parallel) {
    constexpr std::size_t kCheckInterval = 4096;
    struct Pending {
        std::uint32_t source, parent;
    };
    constexpr std::uint32_t kNoParent = 0xFFFFFFFF;
    ScratchVector<Node> out(node_count);
    std::vector<Pending> stack = {{0, kNoParent}};
    for (std::uint32_t index = 0; !stack.empty(); ++index) {
        const Pending p = stack.back();
        stack.pop_back();
        const BuildNode& source = hierarchy.nodes[p.source];
        if (index % kCheckInterval == 0) parallel.check();
        if (p.parent != kNoParent) out[p.parent].link = index;
        out[index] = make_node(source, source.is_leaf() ? first_item[p.source] : 0);
        if (source.is_leaf()) continue;
        stack.push_back({source.second, index});
        stack.push_back({source.first, kNoParent});
    }
    return out;
}

Tree lay_out(const Hierarchy& hierarchy, Items items, MeshView mesh, const BuildOptions& options,
             const Parallel& parallel) {
    Tree tree;
    if (hierarchy.ids.empty()) return tree;
    const std::uint32_t block_size = items == Items::kTriangles ? kBlockSize : 1;
    const WideCuts cuts(hierarchy, block_size, parallel, kShareOfCuts);
    tree.bounds = hierarchy.nodes[0].bounds;
    tree.stats = cuts.stats(options);
    ScratchVector<std::uint32_t> first_item(options.keep_binary_nodes ? hierarchy.nodes.size() : 0);
    std::function<void(std::uint32_t, std::uint32_t)> place_leaf;
    if (options.keep_binary_nodes) {
        place_leaf = [&](std::uint32_t node, std::uint32_t item) { first_item[node] = item; };
    }
    WideTree wide;
    parallel.run([&] {
        wide = collapse(hierarchy, cuts, items, mesh, place_leaf, parallel, kShareOfCollapse);
    });
    tree.wide_nodes = std::move(wide.nodes);
    tree.blocks = std::move(wide.blocks);
    tree.leaf_spacing = wide.leaf_spacing;
    if (options.keep_binary_nodes) {
        tree.nodes = linearize(hierarchy, tree.stats.node_count, first_item, parallel);
    }
    tree.stats.bytes = tree.byte_count();
    return tree;
}

}  // namespace

TreeView Tree::view() const noexcept {
    TreeView out;
    out.nodes = nodes.empty() ? nullptr : nodes.data();
    out.wide_nodes = wide_nodes.data();
    out.blocks = blocks.data();
    if (!treelets.begin.empty()) {
        out.treelet_begin = treelets.begin.data();
        out.treelet_of_node = treelets.of_node.data();
        out.treelet_roots = treelets.roots.data();
        out.most_treelet_exits = treelets.most_exits;
        out.treelet_count = static_cast<std::uint32_t>(treelets.begin.size() - 1);
    }
    out.grid = grid.view();
    out.node_count = static_cast<std::uint32_t>(nodes.empty() ? wide_nodes.size() : nodes.size());
    out.byte_count = wide_nodes.size() * sizeof(WideNode) + blocks.size() * sizeof(TriangleBlock);
    for (int a = 0; a < 3 && !out.is_empty(); ++a) {
        out.lower[a] = bounds.lower[a];
        out.upper[a] = bounds.upper[a];
    }
    return out;
}

std::size_t Tree::byte_count() const noexcept {
    return nodes.size() * sizeof(Node) + wide_nodes.size() * sizeof(WideNode) +
           blocks.size() * sizeof(TriangleBlock) + grid.byte_count() +
           (treelets.begin.size() + treelets.of_node.size()) * sizeof(std::uint32_t) +
           treelets.roots.size() * sizeof(TreeletRoot);
}

Tree make_tree(const Hierarchy& hierarchy, MeshView mesh, const BuildOptions& options,
               const Parallel& parallel) {
    return lay_out(hierarchy, Items::kTriangles, mesh, options, parallel);
}

Tree make_tree(const Hierarchy& hierarchy, const BuildOptions& options, const Parallel& parallel) {
    return lay_out(hierarchy, Items::kIds, {}, options, parallel);
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
