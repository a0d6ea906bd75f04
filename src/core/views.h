// The arrays that kernels walk, as plain structs of pointers and counts. Builders make them,
// kernels read them, nobody else needs to know how they came about.
#pragma once

#include <cstdint>
#include <type_traits>

namespace packet {

/// Lanes in a block of triangles, and the alignment of blocks and nodes.
inline constexpr int kBlockSize = 8;
/// No tree is deeper, in edges from the root to a leaf: stacks of the kernels are this long.
inline constexpr int kMaxDepth = 64;
/// Coordinates beyond this would overflow in products of the triangle test.
inline constexpr float kMaxCoordinate = 1.8e18f;
/// 8 ulp: what rounding in the box test and the triangle test comes to, with room to spare.
inline constexpr float kBoxSlack = 8.0f / 16777216.0f;
/// 1 ulp of the ray's origin or more, along each axis.
inline constexpr float kOriginSlack = 2.0f / 16777216.0f;

/// A node of a binary tree in depth-first order: the first child of an inner node follows it.
struct Node {
    float plane[2][3];    ///< [0] lower, [1] upper corner of the box
    std::uint32_t link;   ///< inner: index of the second child; leaf: its first item
    std::uint32_t count;  ///< inner: 0; leaf: how many items

    [[nodiscard]] constexpr bool is_leaf() const noexcept { return count != 0; }
};
static_assert(sizeof(Node) == 32 && std::is_trivially_copyable_v<Node>);

/// Children of a wide node.
inline constexpr int kWideSize = 8;

/// What a child of a wide node is.
struct WideChild {
    std::uint32_t link;   ///< inner: index of its node; leaf: its first item
    std::uint32_t count;  ///< inner: 0; leaf: how many items

    [[nodiscard]] constexpr bool is_leaf() const noexcept { return count != 0; }
};

/// A node of the 8-wide form of a tree. Its children's boxes are a structure of arrays. Children
/// that are not there come last and have a box that nothing meets: lower +inf, upper -inf. A ray
/// whose numbers overflow may enter it still: they are a leaf of the first item, which any ray may
/// meet.
struct alignas(64) WideNode {
    float plane[2][3][kWideSize];  ///< [lower, upper][axis][child]
    WideChild child[kWideSize];
};
static_assert(sizeof(WideNode) == 256 && std::is_trivially_copyable_v<WideNode>);

/// Eight triangles as a structure of arrays. Lanes without one hold NaN, which nothing hits.
struct alignas(32) TriangleBlock {
    float v[3][3][kBlockSize];  ///< [corner][axis][lane]
    std::int32_t prim_id[kBlockSize];
};
static_assert(sizeof(TriangleBlock) == 320 && std::is_trivially_copyable_v<TriangleBlock>);

/// Bytes that rays read of a node: its own and those of its leaves' blocks.
[[nodiscard]] constexpr std::uint32_t bytes_with_blocks(const WideNode& node) noexcept {
    std::uint32_t blocks = 0;
    for (int c = 0; c < kWideSize; ++c) {
        const WideChild& child = node.child[c];
        const bool is_there = node.plane[0][0][c] <= node.plane[1][0][c];
        if (!child.is_leaf() || !is_there) continue;
        blocks += (child.link + child.count - 1) / kBlockSize - child.link / kBlockSize + 1;
    }
    return static_cast<std::uint32_t>(sizeof(WideNode) + blocks * sizeof(TriangleBlock));
}

/// Cells along each side of a brick: a brick's 64 cells have a bit each in one word.
inline constexpr int kBrickSide = 4;

/// A brick of a grid's cells. Cell (x, y, z) of it is bit x + 4 y + 16 z.
struct GridBrick {
    std::uint64_t occupied;    ///< the cells that hold something
    std::uint32_t first_cell;  ///< where these are in GridView::cells, in the order of their bits
    std::uint32_t unused;
};
static_assert(sizeof(GridBrick) == 16 && std::is_trivially_copyable_v<GridBrick>);

/// A cell that holds something: items `first` to `first + count`; or, if `count` is 0, what
/// GridView::trees[first] says.
struct GridCell {
    std::uint32_t first, count;
};
static_assert(sizeof(GridCell) == 8 && std::is_trivially_copyable_v<GridCell>);

/// Where a cell's tree begins in the arrays of the TreeView. Its links and items count from here.
struct GridTree {
    std::uint32_t node, wide_node, block;
};

/// A uniform grid over the box of a mesh. Empty cells cost two bits, others 8 bytes more.
struct GridView {
    /// Along each axis the planes between cells, ascending, 4 bricks + 1. The first and the last
    /// are faces of the box; bricks are filled up with cells that are flat and hold nothing.
    const float* planes[3] = {nullptr, nullptr, nullptr};
    std::int32_t brick_count[3] = {0, 0, 0};
    float bricks_per_unit[3] = {0, 0, 0};  ///< about: where to start looking for a brick
    const GridBrick* bricks = nullptr;     ///< x fastest, z slowest; null: there is no grid
    const GridCell* cells = nullptr;
    const GridTree* trees = nullptr;
};

/// What decides when rays go through a treelet (src/schedule/treelet_order.h), and whether it is
/// fetched as a whole.
struct TreeletRoot {
    float centre[3];       ///< of its box, twice
    std::uint32_t parent;  ///< the treelet above it; of the first one itself
    std::uint64_t bytes;   ///< of nodes and blocks
};
static_assert(sizeof(TreeletRoot) == 24 && std::is_trivially_copyable_v<TreeletRoot>);

/// A tree, or a grid. Items of leaves are triangles (item i is lane i % 8 of block i / 8) or
/// instances.
struct TreeView {
    const Node* nodes = nullptr;  ///< null if BuildOptions does not keep them
    const WideNode* wide_nodes = nullptr;
    const TriangleBlock* blocks = nullptr;
    std::uint32_t node_count = 0;  ///< of wide ones if there are no others
    std::uint64_t byte_count = 0;  ///< of wide nodes and blocks
    /// Treelet t is wide nodes treelet_begin[t] to treelet_begin[t + 1], the first one its root;
    /// links that leave it lead to roots of later ones. No treelets: the tree is not cut.
    std::uint32_t treelet_count = 0;
    std::uint32_t most_treelet_exits = 0;  ///< links that leave one
    const std::uint32_t* treelet_begin = nullptr;
    const std::uint32_t* treelet_of_node = nullptr;
    const TreeletRoot* treelet_roots = nullptr;
    GridView grid;  ///< if there is one, rays start in it; its cells may hold trees
    /// The box of all items. The fourth number is there to be read along.
    alignas(16) float lower[4] = {0, 0, 0, 0};
    alignas(16) float upper[4] = {0, 0, 0, 0};
    /// Boxes are taken as grown by slack * (max |corner of the tree's box - org| + reach) and an
    /// ulp of org. This covers all rounding on the way to a hit: no box that holds one is ever
    /// missed.
    float slack = kBoxSlack;
    float reach = 0.0f;

    [[nodiscard]] constexpr bool is_tree() const noexcept {
        return node_count != 0 && grid.bricks == nullptr;
    }
    [[nodiscard]] constexpr bool is_empty() const noexcept {
        return node_count == 0 && grid.bricks == nullptr;
    }
};

/// A mesh placed in the world.
struct InstanceView {
    float object_from_world[3][4];  ///< rows; the last column is the translation
    std::uint32_t instance_id;
    const TreeView* tree;
};

/// What the world consists of: instances, under a tree whose leaves hold them.
struct SceneView {
    TreeView top;
    const InstanceView* instances = nullptr;
    const std::uint32_t* mesh_of_instance = nullptr;  ///< by instance_id
    std::uint32_t instance_count = 0;
    bool is_single_mesh = false;  ///< one instance, not moved: its tree is walked at once
};

}  // namespace packet
