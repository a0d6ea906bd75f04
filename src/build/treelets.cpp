#include "build/treelets.h"

#include "core/macros.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

namespace packet {

namespace {

constexpr std::size_t kCheckInterval = 4096;  // nodes: a millisecond of work or less

[[nodiscard]] bool is_inner(const WideNode& node, int child) {
    return node.child[child].count == 0;
}

/// Half of the surface of a child's box.
[[nodiscard]] double area_of(const WideNode& node, int child) {
    double side[3];
    for (int a = 0; a < 3; ++a) {
        side[a] = static_cast<double>(node.plane[1][a][child]) -
                  static_cast<double>(node.plane[0][a][child]);
    }
    return side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
}

/// Half of the surface of the box of all children.
[[nodiscard]] double area_of(const WideNode& node) {
    double side[3];
    for (int a = 0; a < 3; ++a) {
        side[a] =
            static_cast<double>(*std::max_element(node.plane[1][a], node.plane[1][a] + kWideSize)) -
            static_cast<double>(*std::min_element(node.plane[0][a], node.plane[0][a] + kWideSize));
    }
    return side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
}

/// By node the area of its box, which its parent knows. That of the root does not matter for where
/// to cut, as it is a treelet's root whatever comes.
[[nodiscard]] std::vector<double> areas_of(std::span<const WideNode> nodes) {
    std::vector<double> out(nodes.size(), 0.0);
    for (const WideNode& node : nodes) {
        for (int c = 0; c < kWideSize; ++c) {
            if (is_inner(node, c)) out[node.child[c].link] = area_of(node, c);
        }
    }
    return out;
}

/// What a treelet grows by: the node below it whose box is largest, and so is met most.
class GrowingTreelet {
    /// Of equal ones the first node comes first, so that there is one order.
    [[nodiscard]] auto less() const {
        return [this](std::uint32_t a, std::uint32_t b) {
            return areas_[a] < areas_[b] || (areas_[a] == areas_[b] && a > b);
        };
    }

public:
    GrowingTreelet(std::span<const WideNode> nodes, std::span<const double> areas,
                   std::size_t most_bytes)
        : nodes_(nodes), areas_(areas), most_bytes_(most_bytes) {}

    void start(std::uint32_t root) {
        below_.clear();
        bytes_ = 0;
        take(root);
    }
    /// The node it grew by, or kNone.
    [[nodiscard]] std::uint32_t grow() {
        if (below_.empty()) return kNone;
        const std::uint32_t next = below_.front();
        if (bytes_ + bytes_with_blocks(nodes_[next]) > most_bytes_) return kNone;
        std::pop_heap(below_.begin(), below_.end(), less());
        below_.pop_back();
        take(next);
        return next;
    }
    /// Nodes that hang below it, the largest first, the others in no order.
    [[nodiscard]] std::span<const std::uint32_t> below() const { return below_; }

    static constexpr std::uint32_t kNone = 0xFFFFFFFF;

private:
    void take(std::uint32_t node) {
        bytes_ += bytes_with_blocks(nodes_[node]);
        for (int c = 0; c < kWideSize; ++c) {
            if (!is_inner(nodes_[node], c)) continue;
            below_.push_back(nodes_[node].child[c].link);
            std::push_heap(below_.begin(), below_.end(), less());
        }
    }
    std::span<const WideNode> nodes_;
    std::span<const double> areas_;
    std::size_t most_bytes_, bytes_ = 0;
    std::vector<std::uint32_t> below_;
};

/// Where the nodes go, treelet by treelet.
class Layout {
public:
    Layout(std::span<const WideNode> nodes, const std::vector<bool>& is_root)
        : nodes_(nodes), is_root_(is_root), place_(nodes.size()) {
        std::vector<std::uint32_t> roots = {0};
        while (!roots.empty()) {
            const std::uint32_t root = roots.back();
            roots.pop_back();
            treelets_.begin.push_back(next_);
            const std::size_t first_below = roots.size();
            place(root, roots);
            treelets_.most_exits = std::max(treelets_.most_exits,
                                            static_cast<std::uint32_t>(roots.size() - first_below));
            std::reverse(roots.begin() + static_cast<std::ptrdiff_t>(first_below), roots.end());
        }
        treelets_.begin.push_back(next_);
    }

    /// The nodes in their places, with links to places.
    [[nodiscard]] ScratchVector<WideNode> moved(const Parallel& parallel) const {
        ScratchVector<WideNode> out(nodes_.size());
        for (std::size_t i = 0; i < nodes_.size(); ++i) {
            if (i % kCheckInterval == 0) parallel.check();
            WideNode& node = out[place_[i]];
            node = nodes_[i];
            for (int c = 0; c < kWideSize; ++c) {
                if (is_inner(node, c)) node.child[c].link = place_[node.child[c].link];
            }
        }
        return out;
    }
    [[nodiscard]] Treelets treelets() && {
        treelets_.of_node.resize(nodes_.size());
        for (std::size_t t = 0; t + 1 < treelets_.begin.size(); ++t) {
            std::fill(treelets_.of_node.begin() + treelets_.begin[t],
                      treelets_.of_node.begin() + treelets_.begin[t + 1],
                      static_cast<std::uint32_t>(t));
        }
        return std::move(treelets_);
    }

private:
    /// A treelet's nodes, depth first; appends the roots below it.
    void place(std::uint32_t root, std::vector<std::uint32_t>& roots) {
        std::vector<std::uint32_t> pending = {root};
        while (!pending.empty()) {
            const std::uint32_t node = pending.back();
            pending.pop_back();
            place_[node] = next_++;
            for (int c = kWideSize; c-- > 0;) {
                if (!is_inner(nodes_[node], c)) continue;
                const std::uint32_t child = nodes_[node].child[c].link;
                if (!is_root_[child]) pending.push_back(child);
            }
            for (int c = 0; c < kWideSize; ++c) {
                if (is_inner(nodes_[node], c) && is_root_[nodes_[node].child[c].link]) {
                    roots.push_back(nodes_[node].child[c].link);
                }
            }
        }
    }

    std::span<const WideNode> nodes_;
    const std::vector<bool>& is_root_;
    std::vector<std::uint32_t> place_;
    Treelets treelets_;
    std::uint32_t next_ = 0;
};

}  // namespace

// The expected number of treelets that a ray enters is the sum of their roots' areas, in shares of
// the tree's. From the leaves up, each node is tried as a root: its treelet grows by the largest
// node below it, and is best where its area and the least sums of what is then below it add up to
// least. Then, from the root down, those that are best become treelets. Each treelet has a price of
// its own, or there would be thousands of a few nodes each, at which few rays wait: if all were as
// large as they may be, their prices would come to one more entry of each ray.
std::vector<bool> treelet_roots_by_area(std::span<const WideNode> nodes, std::size_t most_bytes,
                                        const Parallel& parallel) {
    const std::vector<double> areas = areas_of(nodes);
    const double root_area = area_of(nodes[0]);
    std::size_t bytes = 0;
    for (const WideNode& node : nodes) bytes += bytes_with_blocks(node);
    const double price = root_area * static_cast<double>(most_bytes) /
                         static_cast<double>(std::max(bytes, most_bytes));
    std::vector<double> least(nodes.size()), least_below(nodes.size());
    std::vector<std::uint32_t> steps(nodes.size());
    GrowingTreelet treelet(nodes, areas, most_bytes);
    for (std::size_t i = nodes.size(); i-- > 0;) {
        if (i % kCheckInterval == 0) parallel.check();
        treelet.start(static_cast<std::uint32_t>(i));
        double below = 0.0;
        for (const std::uint32_t child : treelet.below()) below += least[child];
        least_below[i] = below;
        double best = below;
        std::uint32_t step = 0;
        for (std::uint32_t next; (next = treelet.grow()) != GrowingTreelet::kNone;) {
            ++step;
            below += least_below[next] - least[next];
            if (below > best) continue;  // as good is better: there are fewer treelets
            best = below;
            steps[i] = step;
        }
        least[i] = areas[i] + price + best;
    }
    std::vector<bool> is_root(nodes.size(), false);
    std::vector<std::uint32_t> roots = {0};
    while (!roots.empty()) {
        const std::uint32_t root = roots.back();
        roots.pop_back();
        is_root[root] = true;
        treelet.start(root);
        for (std::uint32_t step = 0; step < steps[root]; ++step) (void)treelet.grow();
        roots.insert(roots.end(), treelet.below().begin(), treelet.below().end());
    }
    return is_root;
}

// From the leaves up: what is below a node stays with it, and where that is too much, its largest
// parts become treelets of their own.
std::vector<bool> treelet_roots_by_subtree(std::span<const WideNode> nodes,
                                           std::size_t most_bytes) {
    std::vector<bool> is_root(nodes.size(), false);
    std::vector<std::size_t> bytes(nodes.size());
    is_root[0] = true;
    for (std::size_t i = nodes.size(); i-- > 0;) {
        bytes[i] = bytes_with_blocks(nodes[i]);
        std::uint32_t child[kWideSize];
        int count = 0;
        for (int c = 0; c < kWideSize; ++c) {
            if (!is_inner(nodes[i], c)) continue;
            child[count++] = nodes[i].child[c].link;
            bytes[i] += bytes[nodes[i].child[c].link];
        }
        std::stable_sort(child, child + count,
                         [&](std::uint32_t a, std::uint32_t b) { return bytes[a] > bytes[b]; });
        for (int k = 0; k < count && bytes[i] > most_bytes; ++k) {
            is_root[child[k]] = true;
            bytes[i] -= bytes[child[k]];
        }
    }
    return is_root;
}

/// What is noted of the treelets, once the nodes are in their places.
[[nodiscard]] static std::vector<TreeletRoot> roots_of(std::span<const WideNode> nodes,
                                                       const Treelets& treelets) {
    std::vector<TreeletRoot> out(treelets.begin.size() - 1, TreeletRoot{});
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const std::uint32_t treelet = treelets.of_node[i];
        out[treelet].bytes += bytes_with_blocks(nodes[i]);
        for (int c = 0; c < kWideSize; ++c) {
            if (!is_inner(nodes[i], c)) continue;
            const std::uint32_t below = treelets.of_node[nodes[i].child[c].link];
            if (below == treelet) continue;
            out[below].parent = treelet;
            for (int a = 0; a < 3; ++a) {
                out[below].centre[a] = nodes[i].plane[0][a][c] + nodes[i].plane[1][a][c];
            }
        }
    }
    return out;
}

TreeletStats count_treelets(const Tree& tree) {
    TreeletStats out;
    if (tree.treelets.begin.empty()) return out;
    out.count = tree.treelets.begin.size() - 1;
    out.cut_edges = out.count - 1;
    const double root_area =
        std::max(static_cast<double>(tree.bounds.half_area()), std::numeric_limits<double>::min());
    out.expected_entries = 1.0;
    for (std::size_t i = 0; i < tree.wide_nodes.size(); ++i) {
        const WideNode& node = tree.wide_nodes[i];
        const std::uint32_t treelet = tree.treelets.of_node[i];
        for (int c = 0; c < kWideSize; ++c) {
            if (is_inner(node, c) && tree.treelets.of_node[node.child[c].link] != treelet) {
                out.expected_entries += area_of(node, c) / root_area;
            }
        }
    }
    for (const TreeletRoot& root : tree.treelets.roots) {
        out.bytes += root.bytes;
        out.most_bytes = std::max<std::size_t>(out.most_bytes, root.bytes);
    }
    return out;
}

void cut_into_treelets(Tree& tree, AccelKind kind, const BuildOptions& options,
                       const Parallel& parallel) {
    const bool is_usual = kind != AccelKind::kBvhMorton && tree.byte_count() >= kLeastBytesToCut &&
                          tree.stats.sah_cost >= kLeastCostToCut;
    const std::size_t usual = is_usual ? kUsualTreeletBytes : 0;
    const std::size_t most_bytes = options.treelet_bytes.value_or(usual);
    if (most_bytes == 0 || !tree.view().is_tree()) return;
    const std::span<const WideNode> nodes = tree.wide_nodes;
    const std::vector<bool> is_root = options.treelet_cut == TreeletCut::kAreas
                                          ? treelet_roots_by_area(nodes, most_bytes, parallel)
                                          : treelet_roots_by_subtree(nodes, most_bytes);
    Layout layout(nodes, is_root);
    ScratchVector<WideNode> moved = layout.moved(parallel);
    tree.treelets = std::move(layout).treelets();
    tree.wide_nodes = std::move(moved);
    tree.treelets.roots = roots_of(tree.wide_nodes, tree.treelets);
    tree.stats.treelets = count_treelets(tree);
    tree.stats.bytes = tree.byte_count();
}

}  // namespace packet
