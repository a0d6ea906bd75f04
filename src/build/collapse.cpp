// A wide node's children are a cut through the binary tree below it. Some builders know their cuts.
// For the others dynamic programming finds the best: the cost of showing a subtree as a forest of
// at most k trees follows from those of its two children with fewer.
//
// Ylitie, Karras, Laine. Efficient incoherent ray traversal on GPUs through compressed wide BVHs.
// High-Performance Graphics 2017.
#include "build/collapse.h"

#include "core/macros.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

namespace packet {

namespace {

// Expected cost of a wide node, and of a block of triangles. Instructions would say 1 to 4, but
// half of the blocks are met for nothing and left early; from 2 to 3 speeds do not differ.
constexpr float kNodeCost = 1.0f;
constexpr float kBlockCost = 2.0f;
// Nodes: some hundred microseconds of work.
constexpr std::size_t kCheckInterval = 4096;

/// The children of a wide node, in order.
struct Children {
    std::uint32_t id[kWideSize];
    int count = 0;
};

/// The cuts of least cost.
class BestCuts {
public:
    BestCuts(std::span<const Node> nodes, std::uint32_t block_size, const Parallel& parallel)
        : nodes_(nodes), block_size_(block_size), costs_(nodes.size()) {
        // Children come after their parent in depth-first order: backwards is bottom-up.
        for (std::size_t i = nodes.size(); i-- > 0;) {
            if (i % kCheckInterval == 0) parallel.check();
            weigh(static_cast<std::uint32_t>(i));
        }
    }

    /// A subtree that becomes one child: a leaf if it has no children, or is cheaper so.
    [[nodiscard]] bool is_leaf(std::uint32_t id) const {
        return nodes_[id].is_leaf() || costs_[id].forest[0] == costs_[id].leaf;
    }
    [[nodiscard]] std::uint32_t item_count(std::uint32_t id) const { return costs_[id].items; }
    [[nodiscard]] Children children(std::uint32_t id) const {
        Children out;
        gather_both(id, kWideSize, out);
        return out;
    }

private:
    /// What a subtree costs as a forest of at most 1 to kMostRoots trees, and its items.
    struct Cost {
        static constexpr int kMostRoots = kWideSize - 1;  // one at least is on the other side
        float forest[kMostRoots];
        float split_in_8;  ///< the best cut of an inner node into 8 children
        float leaf;        ///< as one leaf, +inf if that is too large
        std::uint32_t items;
    };

    [[nodiscard]] std::uint32_t second(std::uint32_t node) const { return nodes_[node].link; }

    [[nodiscard]] static float half_area(const Node& node) {
        const float x = node.plane[1][0] - node.plane[0][0];
        const float y = node.plane[1][1] - node.plane[0][1];
        const float z = node.plane[1][2] - node.plane[0][2];
        return x * y + y * z + z * x;
    }

    /// Cheapest way to show an inner node's children as `roots` trees, and how many go to the
    /// first.
    struct Cut {
        float cost = std::numeric_limits<float>::infinity();
        int first = 1;
    };
    [[nodiscard]] Cut best_cut(std::uint32_t node, int roots) const {
        const Cost &a = costs_[node + 1], &b = costs_[second(node)];
        Cut best;
        for (int k = 1; k < roots; ++k) {
            const float cost = a.forest[k - 1] + b.forest[roots - k - 1];
            if (cost < best.cost) best = {cost, k};
        }
        return best;
    }

    void weigh(std::uint32_t id) {
        const Node& node = nodes_[id];
        Cost& cost = costs_[id];
        const float area = half_area(node);
        if (node.is_leaf()) {
            cost.items = node.count;
            const std::uint32_t blocks = (node.count + block_size_ - 1) / block_size_;
            cost.leaf = area * kBlockCost * static_cast<float>(blocks);
            std::fill_n(cost.forest, Cost::kMostRoots, cost.leaf);
            return;
        }
        cost.items = costs_[id + 1].items + costs_[second(id)].items;
        cost.leaf =
            cost.items <= block_size_ ? area * kBlockCost : std::numeric_limits<float>::infinity();
        cost.split_in_8 = best_cut(id, kWideSize).cost;
        cost.forest[0] = std::min(cost.leaf, area * kNodeCost + cost.split_in_8);
        for (int roots = 2; roots <= Cost::kMostRoots; ++roots) {
            cost.forest[roots - 1] = std::min(cost.forest[roots - 2], best_cut(id, roots).cost);
        }
    }

    /// Shows the subtree as at most `roots` trees, in order.
    void gather(std::uint32_t id, int roots, Children& out) const {
        const Cost& cost = costs_[id];
        while (roots > 1 && cost.forest[roots - 1] == cost.forest[roots - 2]) --roots;
        if (roots == 1 || nodes_[id].is_leaf()) {
            out.id[out.count++] = id;
            return;
        }
        gather_both(id, roots, out);
    }
    void gather_both(std::uint32_t id, int roots, Children& out) const {
        const int first = best_cut(id, roots).first;
        gather(id + 1, first, out);
        gather(second(id), roots - first, out);
    }

    std::span<const Node> nodes_;
    std::uint32_t block_size_;
    ScratchVector<Cost> costs_;
};

/// The cuts that a builder made.
class GivenCuts {
public:
    GivenCuts(std::span<const Node> nodes, const std::vector<bool>& is_wide_child)
        : nodes_(nodes), is_wide_child_(is_wide_child) {}

    [[nodiscard]] bool is_leaf(std::uint32_t id) const { return nodes_[id].is_leaf(); }
    [[nodiscard]] std::uint32_t item_count(std::uint32_t id) const { return nodes_[id].count; }
    [[nodiscard]] Children children(std::uint32_t id) const {
        Children out;
        gather(id + 1, out);
        gather(nodes_[id].link, out);
        return out;
    }

private:
    void gather(std::uint32_t id, Children& out) const {
        if (is_wide_child_[id]) {
            PACKET_ASSERT(out.count < kWideSize);
            out.id[out.count++] = id;
            return;
        }
        gather(id + 1, out);
        gather(nodes_[id].link, out);
    }

    std::span<const Node> nodes_;
    const std::vector<bool>& is_wide_child_;
};

/// Writes wide nodes, and places the items of their leaves.
template <class Cuts>
class Writer {
public:
    Writer(std::span<Node> nodes, std::uint32_t block_size, Cuts cuts, const Parallel& parallel)
        : nodes_(nodes), block_size_(block_size), cuts_(std::move(cuts)), parallel_(parallel) {}

    Collapsed write() {
        if (!nodes_.empty()) emit(0);
        return std::move(out_);
    }

private:
    /// Appends the wide node of a subtree, and those below it, and returns its index.
    std::uint32_t emit(std::uint32_t id) {
        Children children;
        if (cuts_.is_leaf(id)) {
            children.id[children.count++] = id;  // only the root: it is a node with one child
        } else {
            children = cuts_.children(id);
        }
        const auto index = static_cast<std::uint32_t>(out_.nodes.size());
        if (index % kCheckInterval == 0) parallel_.check();
        out_.nodes.push_back(empty_node());
        for (int i = 0; i < children.count; ++i) {
            const std::uint32_t child = children.id[i];
            const bool leaf = cuts_.is_leaf(child);
            const std::uint32_t link = leaf ? place_items(child) : emit(child);
            WideNode& node = out_.nodes[index];
            for (int a = 0; a < 3; ++a) {
                node.plane[0][a][i] = nodes_[child].plane[0][a];
                node.plane[1][a][i] = nodes_[child].plane[1][a];
            }
            node.child[i] = {link, leaf ? cuts_.item_count(child) : 0};
        }
        return index;
    }

    /// Gives the items of a wide leaf their places and returns the first.
    std::uint32_t place_items(std::uint32_t id) {
        auto& items = out_.reference_of_item;
        const std::size_t used = items.size() % block_size_;
        if (used != 0 && used + cuts_.item_count(id) > block_size_) {
            items.insert(items.end(), block_size_ - used, kNoReference);
        }
        const auto first = static_cast<std::uint32_t>(items.size());
        place_leaves(id);
        return first;
    }

    void place_leaves(std::uint32_t id) {
        Node& node = nodes_[id];
        if (!node.is_leaf()) {
            place_leaves(id + 1);
            place_leaves(node.link);
            return;
        }
        const std::uint32_t first_reference = node.link;
        node.link = static_cast<std::uint32_t>(out_.reference_of_item.size());
        for (std::uint32_t i = 0; i < node.count; ++i) {
            out_.reference_of_item.push_back(first_reference + i);
        }
    }

    static WideNode empty_node() {
        WideNode node = {};
        std::fill_n(&node.plane[0][0][0], 3 * kWideSize, std::numeric_limits<float>::infinity());
        std::fill_n(&node.plane[1][0][0], 3 * kWideSize, -std::numeric_limits<float>::infinity());
        std::fill_n(node.child, kWideSize, WideChild{0, 1});
        return node;
    }

    std::span<Node> nodes_;
    std::uint32_t block_size_;
    Cuts cuts_;
    const Parallel& parallel_;
    Collapsed out_;
};

}  // namespace

Collapsed collapse(std::span<Node> nodes, std::uint32_t block_size,
                   const std::vector<bool>& is_wide_child, const Parallel& parallel) {
    const auto write = [&](auto cuts) {
        return Writer(nodes, block_size, std::move(cuts), parallel).write();
    };
    return is_wide_child.empty() ? write(BestCuts(nodes, block_size, parallel))
                                 : write(GivenCuts(nodes, is_wide_child));
}

}  // namespace packet
