#include "build/tree.h"

#include <packet/error.h>

#include <algorithm>
#include <limits>
#include <span>

namespace packet {

namespace {

constexpr std::uint32_t kNoReference = 0xFFFFFFFF;
constexpr glm::vec3 kNowhere(std::numeric_limits<float>::quiet_NaN());

/// Depth-first placement of a hierarchy's nodes, and of the items of its leaves by a policy.
class Linearizer {
public:
    Linearizer(const Hierarchy& hierarchy, const BuildOptions& options, std::uint32_t block_size)
        : hierarchy_(hierarchy), options_(options), block_size_(block_size) {}

    void run(Tree& tree) {
        if (hierarchy_.references.empty()) return;
        tree.bounds = hierarchy_.nodes[0].bounds;
        tree.nodes.reserve(hierarchy_.nodes.size());
        reference_of_item_.reserve(hierarchy_.references.size());
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

    /// By item; kNoReference where a block is filled up so that a leaf starts the next.
    [[nodiscard]] std::span<const std::uint32_t> references_of_items() const {
        return reference_of_item_;
    }

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
        const std::size_t used = reference_of_item_.size() % block_size_;
        if (used != 0 && used + leaf.count > block_size_) {
            reference_of_item_.insert(reference_of_item_.end(), block_size_ - used, kNoReference);
        }
        const auto first_item = static_cast<std::uint32_t>(reference_of_item_.size());
        for (std::uint32_t i = 0; i < leaf.count; ++i) reference_of_item_.push_back(leaf.first + i);
        return first_item;
    }

    const Hierarchy& hierarchy_;
    const BuildOptions& options_;
    std::uint32_t block_size_;
    double root_area_ = 1.0;
    AlignedVector<std::uint32_t> reference_of_item_;
};

/// Stores the triangles of up to kBlockSize items; nothing hits the other lanes.
void fill_block(TriangleBlock& block, std::span<const std::uint32_t> items, MeshView mesh,
                std::span<const Reference> references) {
    for (std::size_t lane = 0; lane < kBlockSize; ++lane) {
        const bool is_used = lane < items.size() && items[lane] != kNoReference;
        glm::vec3 corners[3] = {kNowhere, kNowhere, kNowhere};
        block.prim_id[lane] = -1;
        if (is_used) {
            const std::uint32_t id = references[items[lane]].id;
            for (int c = 0; c < 3; ++c) corners[c] = mesh.positions[mesh.triangles[id][c]];
            block.prim_id[lane] = static_cast<std::int32_t>(id);
        }
        for (int c = 0; c < 3; ++c) {
            for (int a = 0; a < 3; ++a) block.v[c][a][lane] = corners[c][a];
        }
    }
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
    constexpr std::size_t kGrain = 512;
    Tree tree;
    Linearizer linearizer(hierarchy, options, kBlockSize);
    linearizer.run(tree);
    const auto items = linearizer.references_of_items();
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
    check(options.morton_bits == 0 || options.morton_bits == 30 || options.morton_bits == 63,
          "BuildOptions::morton_bits must be 0, 30 or 63");
}

}  // namespace packet
