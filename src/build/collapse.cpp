#include "build/collapse.h"

#include "build/triangle_block.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace packet {

namespace {

// Subtrees of more items than this are parted further: some 300 us of work.
constexpr std::uint32_t kTaskItems = 8192;
// Of an item that only fills a block up.
constexpr std::uint32_t kNoId = 0xFFFFFFFF;

/// Finds places for leaves in blocks: for each the one that it fills up best, of a few that are not
/// full, or a new one.
class BlockPacker {
public:
    /// The first item of a leaf of `count`.
    std::uint32_t place(std::uint32_t count) {
        Open* best = nullptr;
        for (Open& open : std::span(open_, static_cast<std::size_t>(open_count_))) {
            if (open.room >= count && (best == nullptr || open.room < best->room)) best = &open;
        }
        if (best == nullptr) return place_in_new(count);
        const std::uint32_t first = best->end - best->room;
        best->room -= count;
        if (best->room == 0) *best = open_[--open_count_];
        return first;
    }
    [[nodiscard]] std::uint32_t item_count() const { return end_; }

private:
    struct Open {
        std::uint32_t end, room;
    };
    // Blocks that are shared should be near each other. Twice as many fill 1% more.
    static constexpr int kMostOpen = 8;

    std::uint32_t place_in_new(std::uint32_t count) {
        const std::uint32_t first = end_;
        end_ += (count + kBlockSize - 1) / kBlockSize * kBlockSize;
        const std::uint32_t room = end_ - first - count;
        if (room == 0) return first;
        if (open_count_ == kMostOpen) {
            Open* const fullest = std::min_element(
                open_, open_ + kMostOpen, [](auto& a, auto& b) { return a.room < b.room; });
            if (fullest->room >= room) return first;
            *fullest = open_[--open_count_];
        }
        open_[open_count_++] = {end_, room};
        return first;
    }

    Open open_[kMostOpen];
    int open_count_ = 0;
    std::uint32_t end_ = 0;
};

/// Wide nodes before they are written: what their children are, and where.
struct PlannedNode {
    WideChildren children;
    std::uint32_t link[kWideSize];  ///< a leaf's first item, or the node, in the same plan
};

/// A subtree of another plan's, whose parent is there.
struct Hanging {
    std::uint32_t parent, root;
    int child;
};

/// Sums over leaves of half the areas of their boxes, and of the roots of these.
struct LeafSizes {
    double area = 0.0, side = 0.0;

    void add(const Bounds3f& box) {
        const double half_area = static_cast<double>(box.half_area());
        area += half_area;
        side += std::sqrt(half_area);
    }
    void add(const LeafSizes& other) {
        area += other.area;
        side += other.side;
    }
    /// As Tree::leaf_spacing: the mean side of leaves, by area, is area / side, and of those in
    /// `world` a random ray meets area / (half the area of that).
    [[nodiscard]] float spacing(const Bounds3f& world) const {
        if (side == 0.0) return std::numeric_limits<float>::infinity();  // too small for floats
        return static_cast<float>(std::sqrt(area * static_cast<double>(world.half_area())) / side);
    }
};

struct Plan {
    std::vector<PlannedNode> nodes;
    std::vector<std::uint32_t> id_of_item;
    LeafSizes leaf_sizes;
    std::size_t first_node = 0, first_block = 0;

    [[nodiscard]] std::size_t block_count() const { return id_of_item.size() / kBlockSize; }
};

class Planner {
public:
    Planner(const Hierarchy& hierarchy, const WideCuts& cuts, Items items)
        : nodes_(hierarchy.nodes.data()), ids_(hierarchy.ids.data()), cuts_(cuts), items_(items) {}

    /// Subtrees of at most `hang_at` items are left to others.
    Plan plan(std::uint32_t root, std::uint32_t hang_at, std::vector<Hanging>& hanging) {
        hang_at_ = hang_at;
        hanging_ = &hanging;
        if (hang_at == 0) {
            out_.id_of_item.reserve(std::size_t{2} * cuts_.item_count(root));
            out_.nodes.reserve(cuts_.item_count(root) / 8);
        }
        emit(root);
        return std::move(out_);
    }

private:
    std::uint32_t emit(std::uint32_t id) {
        const auto index = static_cast<std::uint32_t>(out_.nodes.size());
        PlannedNode node;
        if (cuts_.is_leaf(id)) {
            node.children.id[node.children.count++] = id;  // the root: a node with one child
        } else {
            node.children = cuts_.children(id);
        }
        out_.nodes.push_back(node);
        for (int i = 0; i < node.children.count; ++i) {
            const std::uint32_t child = node.children.id[i];
            if (cuts_.is_leaf(child)) {
                out_.nodes[index].link[i] = place(child);
                out_.leaf_sizes.add(nodes_[child].bounds);
            } else if (cuts_.item_count(child) <= hang_at_) {
                hanging_->push_back({index, child, i});
            } else {
                out_.nodes[index].link[i] = emit(child);
            }
        }
        return index;
    }

    std::uint32_t place(std::uint32_t id) {
        if (items_ == Items::kIds) return nodes_[id].first;
        const std::uint32_t first = packer_.place(cuts_.item_count(id));
        out_.id_of_item.resize(packer_.item_count(), kNoId);
        list(id, out_.id_of_item.data() + first);
        return first;
    }
    std::uint32_t* list(std::uint32_t id, std::uint32_t* out) const {
        const BuildNode& node = nodes_[id];
        if (!node.is_leaf()) return list(node.second, list(node.first, out));
        return std::copy_n(ids_ + node.first, node.count, out);
    }

    const BuildNode* nodes_;
    const std::uint32_t* ids_;
    const WideCuts& cuts_;
    Items items_;
    std::uint32_t hang_at_ = 0;
    std::vector<Hanging>* hanging_ = nullptr;
    BlockPacker packer_;
    Plan out_;
};

/// Stores the triangles of kBlockSize items; nothing hits the other lanes. Each is written once.
void fill_block(TriangleBlock& block, const std::uint32_t* ids, MeshView mesh) {
    for (std::size_t lane = 0; lane < kBlockSize; ++lane) {
        if (ids[lane] != kNoId) {
            put_triangle(block, lane, mesh, ids[lane]);
        } else {
            put_nothing(block, lane);
        }
    }
}

class Writer {
public:
    Writer(const Hierarchy& hierarchy, const WideCuts& cuts, MeshView mesh,
           const std::function<void(std::uint32_t, std::uint32_t)>& place_leaf, WideTree& out)
        : hierarchy_(hierarchy), cuts_(cuts), mesh_(mesh), place_leaf_(place_leaf), out_(out) {}

    void write(const Plan& plan) const {
        for (std::size_t i = 0; i < plan.nodes.size(); ++i) {
            write_node(plan.nodes[i], plan, out_.nodes[plan.first_node + i]);
        }
        for (std::size_t b = 0; b < plan.block_count(); ++b) {
            fill_block(out_.blocks[plan.first_block + b], plan.id_of_item.data() + b * kBlockSize,
                       mesh_);
        }
    }

private:
    void write_node(const PlannedNode& from, const Plan& plan, WideNode& node) const {
        node = kEmptyNode;
        const auto first_item = static_cast<std::uint32_t>(plan.first_block * kBlockSize);
        for (int i = 0; i < from.children.count; ++i) {
            const std::uint32_t id = from.children.id[i];
            const Bounds3f& box = hierarchy_.nodes[id].bounds;
            for (int a = 0; a < 3; ++a) {
                node.plane[0][a][i] = box.lower[a];
                node.plane[1][a][i] = box.upper[a];
            }
            if (cuts_.is_leaf(id)) {
                node.child[i] = {from.link[i] + first_item, cuts_.item_count(id)};
                if (place_leaf_) place_leaves(id, node.child[i].link);
            } else {
                node.child[i] = {from.link[i] + static_cast<std::uint32_t>(plan.first_node), 0};
            }
        }
    }
    std::uint32_t place_leaves(std::uint32_t id, std::uint32_t item) const {
        const BuildNode& node = hierarchy_.nodes[id];
        if (!node.is_leaf()) return place_leaves(node.second, place_leaves(node.first, item));
        place_leaf_(id, item);
        return item + node.count;
    }

    static constexpr WideNode kEmptyNode = [] {
        WideNode node = {};
        for (int a = 0; a < 3; ++a) {
            std::fill_n(node.plane[0][a], kWideSize, std::numeric_limits<float>::infinity());
            std::fill_n(node.plane[1][a], kWideSize, -std::numeric_limits<float>::infinity());
        }
        std::fill_n(node.child, kWideSize, WideChild{0, 1});
        return node;
    }();

    const Hierarchy& hierarchy_;
    const WideCuts& cuts_;
    MeshView mesh_;
    const std::function<void(std::uint32_t, std::uint32_t)>& place_leaf_;
    WideTree& out_;
};

}  // namespace

WideTree collapse(const Hierarchy& hierarchy, const WideCuts& cuts, Items items, MeshView mesh,
                  const std::function<void(std::uint32_t, std::uint32_t)>& place_leaf,
                  const Parallel& parallel, double part) {
    const std::uint32_t hang_at = cuts.item_count(0) > kTaskItems ? kTaskItems : 0;
    std::vector<Hanging> hanging;
    std::vector<Plan> plans;
    plans.push_back(Planner(hierarchy, cuts, items).plan(0, hang_at, hanging));
    plans.resize(1 + hanging.size());
    const double part_of_task = 0.5 * part / static_cast<double>(plans.size());
    parallel.for_pieces(hanging.size(), 1, [&](std::size_t i, std::size_t) {
        std::vector<Hanging> nothing;
        plans[i + 1] = Planner(hierarchy, cuts, items).plan(hanging[i].root, 0, nothing);
        parallel.advance(part_of_task);
    });
    std::size_t node_count = 0, block_count = 0;
    LeafSizes leaf_sizes;
    for (std::size_t i = 0; i < plans.size(); ++i) {
        plans[i].first_node = node_count;
        plans[i].first_block = block_count;
        if (i > 0) {
            const Hanging& at = hanging[i - 1];
            plans[0].nodes[at.parent].link[at.child] = static_cast<std::uint32_t>(node_count);
        }
        node_count += plans[i].nodes.size();
        block_count += plans[i].block_count();
        leaf_sizes.add(plans[i].leaf_sizes);
    }
    WideTree out;
    out.leaf_spacing = leaf_sizes.spacing(hierarchy.nodes[0].bounds);
    out.nodes.resize(node_count);
    out.blocks.resize(block_count);
    const Writer writer(hierarchy, cuts, mesh, place_leaf, out);
    parallel.for_pieces(plans.size(), 1, [&](std::size_t i, std::size_t) {
        writer.write(plans[i]);
        plans[i] = {};
        parallel.advance(part_of_task);
    });
    return out;
}

}  // namespace packet
