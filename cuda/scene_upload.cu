#include "scene_upload.h"

#include <packet/error.h>

#include "scene/scene_accel.h"

#include <algorithm>
#include <cstring>

namespace packet::cuda {

/// The triangles of blocks, each for itself. Lanes without one stay NaN.
static std::vector<DeviceTriangle> unpack(std::span<const TriangleBlock> blocks) {
    std::vector<DeviceTriangle> out(blocks.size() * kBlockSize);
    for (std::size_t i = 0; i < out.size(); ++i) {
        const TriangleBlock& block = blocks[i / kBlockSize];
        const std::size_t lane = i % kBlockSize;
        for (std::size_t c = 0; c < 3; ++c) {
            out[i].corner[c] = {block.v[c][0][lane], block.v[c][1][lane], block.v[c][2][lane], 0};
        }
        std::memcpy(&out[i].corner[0].w, &block.prim_id[lane], sizeof(float));
    }
    return out;
}

/// Throws unless stacks of the kernels can hold a walk down the tree. All builders see to it.
static int checked_depth(const BuildStats& stats) {
    if (stats.depth <= kMaxDepth) return stats.depth;
    throw Error(ErrorCode::kUnsupported, "a tree is " + std::to_string(stats.depth) +
                                             " deep, more than " + std::to_string(kMaxDepth));
}

UploadedScene::UploadedScene(const SceneAccel& accel) : view_(accel.view) {
    std::vector<DeviceTree> trees;
    int depth = 0;
    for (std::size_t i = 0; i < accel.trees.size(); ++i) {
        if (accel.tree_views[i].grid.bricks != nullptr) {
            throw Error(ErrorCode::kUnsupported,
                        "mesh " + std::to_string(i) +
                            " is in a grid, which CUDA devices do not walk: choose a tree");
        }
        depth = std::max(depth, checked_depth(accel.trees[i].stats));
        trees.push_back(upload(accel.tree_views[i], accel.trees[i].blocks.size()));
    }
    stack_depth_ = static_cast<std::uint32_t>(std::max(1, depth + checked_depth(accel.top.stats)));
    trees_ = DeviceArray<DeviceTree>(std::span<const DeviceTree>(trees));

    std::vector<InstanceView> instances = accel.instances;
    for (InstanceView& instance : instances) {
        instance.tree = trees_.data() + (instance.tree - accel.tree_views.data());
    }
    instances_ = DeviceArray<InstanceView>(std::span<const InstanceView>(instances));
    mesh_of_instance_ =
        DeviceArray<std::uint32_t>(std::span<const std::uint32_t>(accel.mesh_of_instance));
    const DeviceTree top = upload(accel.view.top, 0);
    view_.top.nodes = top.nodes;
    view_.top.wide_nodes = nullptr;
    view_.instances = instances_.data();
    view_.mesh_of_instance = mesh_of_instance_.data();
}

DeviceTree UploadedScene::upload(const TreeView& tree, std::size_t block_count) {
    if (tree.nodes == nullptr && tree.node_count != 0) {
        throw Error(ErrorCode::kUnsupported,
                    "devices walk binary nodes: build with BuildOptions::keep_binary_nodes");
    }
    const std::vector<DeviceTriangle> triangles = unpack({tree.blocks, block_count});
    arrays_.push_back({DeviceArray<Node>(std::span<const Node>(tree.nodes, tree.node_count)),
                       DeviceArray<DeviceTriangle>(std::span<const DeviceTriangle>(triangles))});
    DeviceTree out;
    static_cast<TreeView&>(out) = tree;
    out.nodes = arrays_.back().nodes.data();
    out.triangles = arrays_.back().triangles.data();
    out.blocks = nullptr;
    out.wide_nodes = nullptr;
    return out;
}

}  // namespace packet::cuda
