#include "build/tree.h"

#include <packet/error.h>

#include <algorithm>
#include <limits>

namespace packet {

namespace {

/// Depth-first placement of a hierarchy's nodes, and of the items of its leaves by a policy.
class Linearizer {
public:
    Linearizer(const Hierarchy& hierarchy, const BuildOptions& options, std::uint32_t block_size)
        : hierarchy_(hierarchy), options_(options), block_size_(block_size) {}

    /// A leaf's references and the first item they become.
    struct LeafItems {
        std::uint32_t first_reference, count, first_item;
    };

    void run(Tree& tree) {
        if (hierarchy_.references.empty()) return;
        tree.bounds = hierarchy_.nodes[0].bounds;
        root_area_ = std::max(static_cast<double>(tree.bounds.half_area()),
                              std::numeric_limits<double>::min());
        // Iterative: the depth is bounded, but small stacks of threads are not ours to fill.
        struct Pending {
            std::uint32_t source, parent;
            int depth;
        };
        constexpr std::uint32_t kNoParent = 0xFFFFFFFF;
        std::vector<Pending> stack = {{0, kNoParent, 0}};
        while (!stack.empty()) {
            const Pending p = stack.back();
            stack.pop_back();
            const BuildNode& source = hierarchy_.nodes[p.source];
            const auto index = static_cast<std::uint32_t>(tree.nodes.size());
            if (p.parent != kNoParent) tree.nodes[p.parent].link = index;
            tree.nodes.push_back(make_node(source, p.depth, tree.stats));
            if (source.is_leaf()) continue;
            stack.push_back({source.second, index, p.depth + 1});
            stack.push_back({source.first, kNoParent, p.depth + 1});
        }
        tree.nodes.shrink_to_fit();
        tree.stats.node_count = tree.nodes.size();
    }

    [[nodiscard]] const std::vector<LeafItems>& leaves() const { return leaves_; }
    [[nodiscard]] std::uint32_t item_count() const { return item_count_; }

private:
    Node make_node(const BuildNode& source, int depth, BuildStats& stats) {
        const double share = static_cast<double>(source.bounds.half_area()) / root_area_;
        Node node = {};
        for (int a = 0; a < 3; ++a) {
            node.plane[0][a] = source.bounds.lower[a];
            node.plane[1][a] = source.bounds.upper[a];
        }
        node.count = source.count;
        stats.depth = std::max(stats.depth, depth);
        if (source.is_leaf()) {
            node.link = place_leaf(source);
            ++stats.leaf_count;
            stats.sah_cost += share * static_cast<double>(options_.intersection_cost) *
                              static_cast<double>(source.count);
        } else {
            stats.sah_cost += share * static_cast<double>(options_.traversal_cost);
        }
        return node;
    }

    std::uint32_t place_leaf(const BuildNode& leaf) {
        const std::uint32_t used = item_count_ % block_size_;
        if (used != 0 && used + leaf.count > block_size_) item_count_ += block_size_ - used;
        leaves_.push_back({leaf.first, leaf.count, item_count_});
        item_count_ += leaf.count;
        return leaves_.back().first_item;
    }

    const Hierarchy& hierarchy_;
    const BuildOptions& options_;
    std::uint32_t block_size_;
    double root_area_ = 1.0;
    std::uint32_t item_count_ = 0;
    std::vector<LeafItems> leaves_;
};

/// A block that nothing hits.
TriangleBlock empty_block() {
    TriangleBlock block;
    std::fill_n(&block.v[0][0][0], 9 * kBlockSize, std::numeric_limits<float>::quiet_NaN());
    std::fill_n(block.prim_id, kBlockSize, -1);
    return block;
}

void store_triangle(TriangleBlock& block, std::uint32_t lane, MeshView mesh, std::uint32_t id) {
    for (int corner = 0; corner < 3; ++corner) {
        const glm::vec3& position = mesh.positions[mesh.triangles[id][corner]];
        for (int a = 0; a < 3; ++a) block.v[corner][a][lane] = position[a];
    }
    block.prim_id[lane] = static_cast<std::int32_t>(id);
}

}  // namespace

TreeView Tree::view() const noexcept {
    TreeView out;
    out.nodes = nodes.data();
    out.blocks = blocks.data();
    out.node_count = static_cast<std::uint32_t>(nodes.size());
    for (int a = 0; a < 3 && !nodes.empty(); ++a) {
        out.lower[a] = bounds.lower[a];
        out.upper[a] = bounds.upper[a];
    }
    return out;
}

Tree make_tree(const Hierarchy& hierarchy, MeshView mesh, const BuildOptions& options,
               const Parallel& parallel) {
    constexpr std::size_t kGrain = 4096;
    Tree tree;
    Linearizer linearizer(hierarchy, options, kBlockSize);
    linearizer.run(tree);
    tree.blocks.assign((linearizer.item_count() + kBlockSize - 1) / kBlockSize, empty_block());
    const auto& leaves = linearizer.leaves();
    parallel.run([&] {
        parallel.for_pieces(leaves.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t l = begin; l < end; ++l) {
                for (std::uint32_t i = 0; i < leaves[l].count; ++i) {
                    const std::uint32_t item = leaves[l].first_item + i;
                    store_triangle(tree.blocks[item / kBlockSize], item % kBlockSize, mesh,
                                   hierarchy.references[leaves[l].first_reference + i].id);
                }
            }
        });
    });
    tree.stats.bytes =
        tree.nodes.size() * sizeof(Node) + tree.blocks.size() * sizeof(TriangleBlock);
    return tree;
}

Tree make_tree(const Hierarchy& hierarchy, const BuildOptions& options) {
    Tree tree;
    Linearizer(hierarchy, options, 1).run(tree);
    tree.stats.bytes = tree.nodes.size() * sizeof(Node);
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
}

}  // namespace packet
