#include "build/validate_tree.h"

#include "build/overlap.h"
#include "scene/triangle_fault.h"

#include <packet/error.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace packet {

namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFF;

void require(bool good, const char* what, std::size_t index, const char* rule) {
    if (good) return;
    throw Error(ErrorCode::kBadValue,
                "tree: " + std::string(what) + " " + std::to_string(index) + ": " + rule);
}

Bounds3f box_of(const Node& node) {
    return {{node.plane[0][0], node.plane[0][1], node.plane[0][2]},
            {node.plane[1][0], node.plane[1][1], node.plane[1][2]}};
}

Bounds3f box_of(const WideNode& node, int child) {
    Bounds3f box;
    for (int a = 0; a < 3; ++a) {
        box.lower[a] = node.plane[0][a][child];
        box.upper[a] = node.plane[1][a][child];
    }
    return box;
}

/// The box as clip.h may see it: parts of triangles are found by planes moved outward by 2^-45 of
/// the triangle's largest coordinate, and bounds are rounded outward.
Bounds3f grown(const Bounds3f& box, const glm::vec3 (&corners)[3]) {
    double largest = 0.0;
    for (const glm::vec3& p : corners) {
        for (int a = 0; a < 3; ++a)
            largest = std::max(largest, std::abs(static_cast<double>(p[a])));
    }
    const double slack = 0x1p-40 * largest;
    Bounds3f out;
    for (int a = 0; a < 3; ++a) {
        const auto lower = static_cast<float>(static_cast<double>(box.lower[a]) - slack);
        const auto upper = static_cast<float>(static_cast<double>(box.upper[a]) + slack);
        out.lower[a] = std::nextafter(lower, -INFINITY);
        out.upper[a] = std::nextafter(upper, INFINITY);
    }
    return out;
}

class Validator {
public:
    Validator(const Tree& tree, MeshView mesh, AccelKind kind)
        : tree_(tree),
          mesh_(mesh),
          cuts_(cuts_triangles(kind)),
          leaf_of_item_(tree.blocks.size() * kBlockSize, kNone),
          leaves_of_triangle_(mesh.triangles.size(), 0) {}

    void run() {
        require(!tree_.wide_nodes.empty() || tree_.nodes.empty(), "wide node", 0,
                "only the binary form has nodes");
        if (!tree_.grid.trees.empty()) {
            check_trees_of_cells();
        } else if (!tree_.wide_nodes.empty()) {
            if (has_binary_nodes()) {
                check_order();
                for (std::uint32_t i = 0; i < tree_.nodes.size(); ++i) check_node(i);
            }
            check_wide_nodes();
        }
        if (!tree_.treelets.begin.empty()) check_treelets();
        check_cells();
        for (std::size_t i = 0; i < leaf_of_item_.size(); ++i) check_item(i);
        for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) check_triangle(i);
    }

private:
    /// Trees need not keep them.
    [[nodiscard]] bool has_binary_nodes() const { return !tree_.nodes.empty(); }

    /// In depth-first order each node follows its parent or the last node below its sibling.
    void check_order() const {
        struct Pending {
            std::uint32_t parent;
            int depth;
        };
        const std::size_t count = tree_.nodes.size();
        std::vector<Pending> pending;
        int depth = 0, greatest = 0;
        std::size_t leaves = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
            require(depth <= kMaxDepth, "node", i, "deeper than kMaxDepth");
            greatest = std::max(greatest, depth);
            if (!tree_.nodes[i].is_leaf()) {
                require(i + 1 < count, "node", i, "an inner node without a first child");
                pending.push_back({i, ++depth});
                continue;
            }
            ++leaves;
            if (pending.empty()) {
                require(i + 1 == count, "node", i + 1, "has no parent");
                break;
            }
            const Pending next = pending.back();
            pending.pop_back();
            require(tree_.nodes[next.parent].link == i + 1 && i + 1 < count, "node", next.parent,
                    "its second child is not where the nodes below its first child end");
            depth = next.depth;
        }
        require(pending.empty(), "node", count - 1, "the last one, but others lack a second child");
        require(tree_.bounds == box_of(tree_.nodes[0]), "node", 0, "its box is not the tree's");
        const BuildStats& stats = tree_.stats;
        require(stats.depth == greatest && stats.node_count == count && stats.leaf_count == leaves,
                "node", 0, "the statistics' depth or counts of nodes or leaves are others");
    }

    void check_node(std::uint32_t index) {
        const Node& node = tree_.nodes[index];
        const Bounds3f box = box_of(node);
        require(!box.empty(), "node", index, "its box is empty or has a NaN");
        if (!node.is_leaf()) {
            for (const std::uint32_t child : {index + 1, node.link}) {
                require(box.contains(box_of(tree_.nodes[child])), "node", child,
                        "its box is not in its parent's");
            }
            return;
        }
        hold_items("node", index, box, node.link, node.count);
    }

    /// A leaf, or a cell, holds `count` items.
    void hold_items(const char* what, std::uint32_t index, const Bounds3f& box, std::uint32_t first,
                    std::uint32_t count) {
        require(first <= leaf_of_item_.size() && count <= leaf_of_item_.size() - first, what, index,
                "refers to items that are not there");
        for (std::uint32_t item = first; item < first + count; ++item) {
            require(leaf_of_item_[item] == kNone, what, index, "holds an item of another leaf");
            leaf_of_item_[item] = index;
            const std::int32_t id = tree_.blocks[item / kBlockSize].prim_id[item % kBlockSize];
            require(id >= 0 && static_cast<std::size_t>(id) < mesh_.triangles.size(), "item", item,
                    "its prim_id is not one of the mesh");
            ++leaves_of_triangle_[static_cast<std::size_t>(id)];
            check_held(what, index, box, static_cast<std::uint32_t>(id));
        }
    }

    /// Each cell's triangles overlap it, and brick after brick the cells are all there.
    void check_cells() {
        const Grid& grid = tree_.grid;
        std::size_t next = 0;
        for (std::size_t brick = 0; brick < grid.bricks.size(); ++brick) {
            const GridBrick& cells = grid.bricks[brick];
            if (cells.occupied == 0) continue;
            require(cells.first_cell == next, "brick", brick,
                    "its cells are not behind the last's");
            for (std::uint64_t left = cells.occupied; left != 0; left &= left - 1, ++next) {
                require(next < grid.cells.size(), "brick", brick, "its cells are not there");
                const GridCell& cell = grid.cells[next];
                if (cell.count == 0) {
                    require(cell.first < grid.trees.size(), "cell", next, "its tree is not there");
                    continue;
                }
                hold_items("cell", static_cast<std::uint32_t>(next),
                           box_of_cell(grid, brick, std::countr_zero(left)), cell.first,
                           cell.count);
            }
        }
        require(next == grid.cells.size(), "cell", next, "belongs to no brick");
    }

    /// The leaves of cells' trees, one tree after the other.
    void check_trees_of_cells() {
        const AlignedVector<GridTree>& trees = tree_.grid.trees;
        for (std::size_t i = 0; i < trees.size(); ++i) {
            if (!has_binary_nodes()) {
                const std::size_t end =
                    i + 1 < trees.size() ? trees[i + 1].wide_node : tree_.wide_nodes.size();
                for (std::uint32_t n = trees[i].wide_node; n < end; ++n) {
                    hold_items_of_wide(n, trees[i].block * kBlockSize);
                }
                continue;
            }
            const std::size_t end = i + 1 < trees.size() ? trees[i + 1].node : tree_.nodes.size();
            for (std::uint32_t n = trees[i].node; n < end; ++n) {
                const Node& node = tree_.nodes[n];
                if (!node.is_leaf()) continue;
                hold_items("node", n, box_of(node), trees[i].block * kBlockSize + node.link,
                           node.count);
            }
        }
    }

    /// The items of a wide node's leaves.
    void hold_items_of_wide(std::uint32_t index, std::uint32_t first_item) {
        const WideNode& node = tree_.wide_nodes[index];
        for (int child = 0; child < kWideSize; ++child) {
            if (is_absent(node, child) || node.child[child].count == 0) continue;
            hold_items("wide node", index, box_of(node, child), first_item + node.child[child].link,
                       node.child[child].count);
        }
    }

    static Bounds3f box_of_cell(const Grid& grid, std::size_t brick, int bit) {
        Bounds3f box;
        for (int a = 0; a < 3; ++a) {
            const auto bricks = static_cast<std::size_t>(grid.brick_count[a]);
            const std::size_t place =
                brick % bricks * kBrickSide + (static_cast<std::size_t>(bit) >> 2 * a & 3);
            box.lower[a] = grid.planes[a][place];
            box.upper[a] = grid.planes[a][place + 1];
            brick /= bricks;
        }
        return box;
    }

    void check_held(const char* what, std::uint32_t index, const Bounds3f& box,
                    std::uint32_t id) const {
        const glm::uvec3 t = mesh_.triangles[id];
        const glm::vec3 corners[3] = {mesh_.positions[t.x], mesh_.positions[t.y],
                                      mesh_.positions[t.z]};
        if (cuts_) {
            require(overlaps_by_axes(corners, grown(box, corners)), what, index,
                    "its box does not overlap a triangle it holds");
            return;
        }
        for (const glm::vec3& p : corners) {
            require(box.contains({p, p}), what, index, "its box does not hold its triangles");
        }
    }

    void check_wide_nodes() {
        std::vector<int> depth(tree_.wide_nodes.size(), -1);  // -1: no parent so far
        depth[0] = 0;
        is_item_seen_.assign(leaf_of_item_.size(), false);
        for (std::uint32_t i = 0; i < tree_.wide_nodes.size(); ++i) {
            require(depth[i] >= 0, "wide node", i, "has no parent before it");
            require(depth[i] <= tree_.stats.depth, "wide node", i, "deeper than the binary form");
            if (!has_binary_nodes()) hold_items_of_wide(i, 0);
            for (int child = 0; child < kWideSize; ++child) {
                const WideNode& node = tree_.wide_nodes[i];
                if (is_absent(node, child)) continue;
                if (node.child[child].count != 0) {
                    check_wide_leaf(i, child);
                    continue;
                }
                const std::uint32_t link = node.child[child].link;
                require(link > i && link < depth.size() && depth[link] < 0, "wide node", i,
                        "a child is not there, not behind it, or another's");
                depth[link] = depth[i] + 1;
                for (int k = 0; k < kWideSize; ++k) {
                    const WideNode& below = tree_.wide_nodes[link];
                    require(is_absent(below, k) || box_of(node, child).contains(box_of(below, k)),
                            "wide node", link, "a child's box is not in its own");
                }
            }
        }
        for (std::size_t i = 0; i < leaf_of_item_.size(); ++i) {
            require(is_item_seen_[i] == (leaf_of_item_[i] != kNone), "item", i,
                    "is in a leaf of the binary form and in none of the 8-wide one");
        }
    }

    /// Runs of nodes that together are all, in which links that leave one lead to first nodes.
    void check_treelets() const {
        const std::vector<std::uint32_t>&begin = tree_.treelets.begin, &of = tree_.treelets.of_node;
        const std::size_t count = begin.size() - 1;
        require(begin.front() == 0 && begin.back() == tree_.wide_nodes.size() &&
                    of.size() == tree_.wide_nodes.size() && tree_.treelets.roots.size() == count,
                "treelet", 0, "they are not all nodes");
        std::size_t cut_edges = 0;
        std::uint32_t most_exits = 0;
        for (std::size_t t = 0; t < count; ++t) {
            require(begin[t] < begin[t + 1], "treelet", t, "has no nodes");
        }
        for (std::uint32_t t = 0; t < count; ++t) {
            std::uint32_t exits = 0;
            std::uint64_t bytes = 0;
            for (std::uint32_t i = begin[t]; i < begin[t + 1]; ++i) {
                require(of[i] == t, "treelet", t, "a node of it is noted as another's");
                bytes += bytes_with_blocks(tree_.wide_nodes[i]);
                for (const WideChild& child : tree_.wide_nodes[i].child) {
                    if (child.is_leaf() || child.link - begin[t] < begin[t + 1] - begin[t])
                        continue;
                    require(begin[of[child.link]] == child.link, "treelet", t,
                            "a link leads into the middle of another");
                    require(of[child.link] > t && tree_.treelets.roots[of[child.link]].parent == t,
                            "treelet", of[child.link], "another than noted is above it");
                    ++exits;
                }
            }
            require(tree_.treelets.roots[t].bytes == bytes, "treelet", t, "bytes are others");
            cut_edges += exits;
            most_exits = std::max(most_exits, exits);
        }
        require(most_exits == tree_.treelets.most_exits, "treelet", 0,
                "other numbers of links leave them than noted");
        require(tree_.stats.treelets.count == count && tree_.stats.treelets.cut_edges == cut_edges,
                "treelet", 0, "the statistics' counts are others");
    }

    /// Children that are not there have boxes that nothing meets, and are a leaf of the first item.
    static bool is_absent(const WideNode& node, int child) {
        constexpr float kInf = std::numeric_limits<float>::infinity();
        return node.child[child].count == 1 && node.child[child].link == 0 &&
               box_of(node, child) == Bounds3f{glm::vec3(kInf), glm::vec3(-kInf)};
    }

    /// One leaf of the binary form or several in a row.
    void check_wide_leaf(std::uint32_t index, int child) {
        const WideNode& node = tree_.wide_nodes[index];
        const std::uint32_t first = node.child[child].link, count = node.child[child].count;
        const std::size_t items = leaf_of_item_.size();
        require(first < items && count <= items - first, "wide node", index,
                "refers to items that are not there");
        for (std::uint32_t item = first; item < first + count; ++item) {
            const std::uint32_t leaf = leaf_of_item_[item];
            require(leaf != kNone && !is_item_seen_[item], "wide node", index,
                    "holds an item of no leaf, or of another wide leaf");
            is_item_seen_[item] = true;
            if (!has_binary_nodes()) continue;
            const Node& held = tree_.nodes[leaf];
            require(held.link >= first && held.link + held.count <= first + count, "wide node",
                    index, "holds a leaf of the binary form in part");
            require(box_of(node, child).contains(box_of(held)), "wide node", index,
                    "a child's box does not hold the boxes of its leaves");
        }
    }

    /// Lanes hold their triangle's corners, or NaN if they have none.
    void check_item(std::size_t item) const {
        const TriangleBlock& block = tree_.blocks[item / kBlockSize];
        const std::size_t lane = item % kBlockSize;
        const bool is_used = leaf_of_item_[item] != kNone;
        require(is_used || block.prim_id[lane] == -1, "item", item, "is in no leaf");
        for (int c = 0; c < 3; ++c) {
            for (int a = 0; a < 3; ++a) {
                const float x = block.v[c][a][lane];
                if (!is_used) {
                    require(std::isnan(x), "item", item, "is empty but could be hit");
                    continue;
                }
                const auto id = static_cast<std::size_t>(block.prim_id[lane]);
                require(x == mesh_.positions[mesh_.triangles[id][c]][a], "item", item,
                        "its corners are not its triangle's");
            }
        }
    }

    void check_triangle(std::size_t id) const {
        const glm::uvec3 t = mesh_.triangles[id];
        const bool can_be_hit = find_fault(mesh_.positions[t.x], mesh_.positions[t.y],
                                           mesh_.positions[t.z]) == TriangleFault::kNone;
        const std::uint32_t leaves = leaves_of_triangle_[id];
        if (!can_be_hit) return require(leaves == 0, "triangle", id, "can never be hit");
        require(leaves != 0, "triangle", id, "is in no leaf");
        require(cuts_ || leaves == 1, "triangle", id, "is in several leaves");
    }

    const Tree& tree_;
    MeshView mesh_;
    bool cuts_;
    std::vector<std::uint32_t> leaf_of_item_;
    std::vector<std::uint32_t> leaves_of_triangle_;
    std::vector<bool> is_item_seen_;  ///< in the 8-wide form
};

}  // namespace

bool cuts_triangles(AccelKind kind) noexcept {
    switch (kind) {
        case AccelKind::kBvh:
        case AccelKind::kBvhMidpoint:
        case AccelKind::kBvhMorton: return false;
        case AccelKind::kBvhSpatial:
        case AccelKind::kKdMidpoint:
        case AccelKind::kKdMedian:
        case AccelKind::kKdSah:
        case AccelKind::kOctree:
        case AccelKind::kGrid:
        case AccelKind::kGridOfTrees: return true;
    }
    return false;
}

void validate(const Tree& tree, MeshView mesh, AccelKind kind) {
    Validator(tree, mesh, kind).run();
}

}  // namespace packet
