#include "build/wide_cuts.h"

#include "build/sah_costs.h"
#include "core/macros.h"

#include <algorithm>
#include <bit>

namespace packet {

namespace {

// Expected cost of a wide node, and of a block of triangles. Half of the blocks are met for nothing
// and left early: docs/experiments.md#quality-of-hierarchies
constexpr float kNodeCost = 1.0f;
constexpr float kBlockCost = 1.0f;
// Nodes of a task, about, in balanced trees: 100 us of work.
constexpr std::size_t kTaskNodes = 4096;

constexpr float kInf = std::numeric_limits<float>::infinity();

/// The depth at which subtrees have kTaskNodes nodes, and fewer where others may have more.
int fork_depth(std::size_t node_count, const Parallel& parallel) {
    if (parallel.threads() == 1 && !parallel.is_watched()) return 0;
    return node_count <= kTaskNodes ? 0
                                    : static_cast<int>(std::bit_width(node_count / kTaskNodes)) + 2;
}

}  // namespace

WideCuts::WideCuts(const Hierarchy& hierarchy, std::uint32_t block_size, const Parallel& parallel,
                   double part)
    : hierarchy_(hierarchy),
      nodes_(hierarchy.nodes.data()),
      block_size_(block_size),
      parallel_(parallel),
      fork_depth_(fork_depth(hierarchy.nodes.size(), parallel)),
      part_(part / static_cast<double>(std::size_t{1} << fork_depth_)),
      cuts_(hierarchy.nodes.size()) {
    parallel.run([&] { root_ = weigh(0, 0); });
}

WideCuts::Weight WideCuts::weigh(std::uint32_t id, int depth) {
    const BuildNode& node = nodes_[id];
    Cut& cut = cuts_[id];
    if (depth == fork_depth_) parallel_.advance(part_);
    if (node.is_leaf()) return weigh_leaf(node, cut);
    Weight first, second;
    if (depth < fork_depth_) {
        parallel_.both([&] { first = weigh(node.first, depth + 1); },
                       [&] { second = weigh(node.second, depth + 1); });
    } else {
        first = weigh(node.first, depth + 1);
        second = weigh(node.second, depth + 1);
    }
    const float area = node.bounds.half_area();
    Weight out;
    out.items = first.items + second.items;
    out.height = 1 + std::max(first.height, second.height);
    out.leaf_count = first.leaf_count + second.leaf_count;
    out.inner_area = static_cast<double>(area) + first.inner_area + second.inner_area;
    out.block_area = first.block_area + second.block_area;
    cut = {0, out.items};
    if (!is_given()) choose(best_splits(first, second), area, out, cut);
    return out;
}

WideCuts::Weight WideCuts::weigh_leaf(const BuildNode& node, Cut& cut) const {
    const float area = node.bounds.half_area();
    const std::uint32_t blocks = (node.count + block_size_ - 1) / block_size_;
    Weight out;
    out.forest[0] = area * kBlockCost * static_cast<float>(blocks);
    out.items = node.count;
    out.height = 0;
    out.leaf_count = 1;
    out.inner_area = 0.0;
    out.block_area = static_cast<double>(area) * static_cast<double>(blocks);
    cut = {0, node.count};
    return out;
}

/// Costs of a leaf's forests are all the same, and others fall with the number of roots. Where more
/// than one number of roots for the first child is best, which one is taken does not matter.
WideCuts::Splits WideCuts::best_splits(const Weight& first, const Weight& second) {
    Splits out;
    if (second.height == 0) {
        for (std::uint32_t i = 1; i < kWideSize; ++i) {
            out.cost[i] = first.forest[first.height == 0 ? 0 : i - 1] + second.forest[0];
            out.first[i] = first.height == 0 ? 1 : i;
        }
        return out;
    }
    if (first.height == 0) {
        for (std::uint32_t i = 1; i < kWideSize; ++i) {
            out.cost[i] = first.forest[0] + second.forest[i - 1];
            out.first[i] = 1;
        }
        return out;
    }
    // At index i there are i + 1 roots. Fewer than one of the second's cost infinitely much.
    float seconds[2 * kWideSize];
    std::fill_n(seconds, kWideSize, kInf);
    std::copy_n(second.forest, kMostRoots, seconds + kWideSize);
    seconds[2 * kWideSize - 1] = kInf;
    std::fill_n(out.cost, kWideSize, kInf);
    std::fill_n(out.first, kWideSize, 1u);
    for (std::uint32_t k = 1; k < kWideSize; ++k) {
        for (std::uint32_t i = 0; i < kWideSize; ++i) {
            const float cost = first.forest[k - 1] + seconds[kWideSize + i - k];
            const bool is_better = cost < out.cost[i];
            out.cost[i] = is_better ? cost : out.cost[i];
            out.first[i] = is_better ? k : out.first[i];
        }
    }
    return out;
}

void WideCuts::choose(const Splits& splits, float area, Weight& out, Cut& cut) const {
    const float as_leaf = out.items <= block_size_ ? area * kBlockCost : kInf;
    const float as_node = area * kNodeCost + splits.cost[kWideSize - 1];
    out.forest[0] = std::min(as_leaf, as_node);
    if (as_leaf <= as_node) cut.forests |= kAsLeaf;
    for (int i = 1; i < kWideSize; ++i) {
        const bool is_node = i == kWideSize - 1;
        if (!is_node) out.forest[i] = std::min(out.forest[i - 1], splits.cost[i]);
        if (is_node || splits.cost[i] < out.forest[i - 1])
            cut.forests |= splits.first[i] << 3 * (i - 1);
    }
}

WideChildren WideCuts::children(std::uint32_t id) const {
    WideChildren out;
    if (is_given()) {
        gather_given(nodes_[id].first, out);
        gather_given(nodes_[id].second, out);
    } else {
        const int first = first_roots(cuts_[id], kWideSize);
        gather(nodes_[id].first, first, out);
        gather(nodes_[id].second, kWideSize - first, out);
    }
    return out;
}

/// Shows the subtree as at most `roots` trees, in order.
void WideCuts::gather(std::uint32_t id, int roots, WideChildren& out) const {
    const Cut& cut = cuts_[id];
    while (roots > 1 && first_roots(cut, roots) == 0) --roots;
    if (roots == 1) {
        out.id[out.count++] = id;
        return;
    }
    const int first = first_roots(cut, roots);
    gather(nodes_[id].first, first, out);
    gather(nodes_[id].second, roots - first, out);
}

void WideCuts::gather_given(std::uint32_t id, WideChildren& out) const {
    if (hierarchy_.is_wide_child[id]) {
        PACKET_ASSERT(out.count < kWideSize);
        out.id[out.count++] = id;
        return;
    }
    gather_given(nodes_[id].first, out);
    gather_given(nodes_[id].second, out);
}

/// A node's cost counts as often as a random ray that meets the root's box meets its own.
BuildStats WideCuts::stats(const BuildOptions& options) const {
    BuildStats out;
    out.leaf_count = root_.leaf_count;
    out.node_count = 2 * root_.leaf_count - 1;
    out.depth = root_.height;
    const double root_area = std::max(static_cast<double>(nodes_[0].bounds.half_area()),
                                      std::numeric_limits<double>::min());
    out.sah_cost =
        (static_cast<double>(options.traversal_cost) * root_.inner_area +
         static_cast<double>(kBlockTests * options.intersection_cost) * root_.block_area) /
        root_area;
    return out;
}

}  // namespace packet
