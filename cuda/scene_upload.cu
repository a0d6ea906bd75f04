#include "scene_upload.h"

#include "device_build.h"
#include "scene/scene_accel.h"
#include "walkable.h"

#include <packet/error.h>

#include <algorithm>
#include <cstring>
#include <string>

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
static int checked_depth(int depth) {
    if (depth <= kMaxDepth) return depth;
    throw Error(ErrorCode::kUnsupported, "a tree is " + std::to_string(depth) +
                                             " deep, more than " + std::to_string(kMaxDepth));
}

UploadedScene::UploadedScene(const SceneAccel& accel) {
    std::vector<DeviceTree> trees;
    int depth = 0;
    for (std::size_t i = 0; i < accel.trees.size(); ++i) {
        require_walkable(accel.tree_views[i], i);
        depth = std::max(depth, checked_depth(accel.trees[i].stats.depth));
        trees.push_back(upload(accel.tree_views[i], accel.trees[i].blocks.size()));
    }
    upload_top(accel, trees, depth);
}

UploadedScene::UploadedScene(const Scene& scene, const BuildOptions& options) {
    validate(options);
    std::vector<DeviceTree> trees;
    std::vector<Bounds3f> boxes;
    int depth = 0;
    for (const TriangleMesh& mesh : scene.meshes()) {
        const UploadedMesh uploaded(mesh.view());
        DeviceBuiltTree tree = lay_out(build_hierarchy(uploaded, options), uploaded);
        depth = std::max(depth, checked_depth(tree.depth));
        trees.push_back(tree.view());
        boxes.push_back(tree.bounds);
        arrays_.push_back(std::move(tree.arrays));
    }
    BuildOptions top_options = options;
    top_options.keep_binary_nodes = true;  // which are what is walked
    SceneAccel top;
    build_top(scene.instances(), boxes, top_options, Parallel(options.threads), top);
    upload_top(top, trees, depth);
}

void UploadedScene::upload_top(const SceneAccel& accel, std::span<const DeviceTree> trees,
                               int depth) {
    view_ = accel.view;
    bounds_ = accel.top.bounds;
    depth += checked_depth(accel.top.stats.depth);
    stack_depth_ = static_cast<std::uint32_t>(std::max(1, depth));
    trees_ = DeviceArray<DeviceTree>(trees);
    std::vector<InstanceView> instances = accel.instances;
    for (InstanceView& instance : instances) {
        instance.tree = trees_.data() + accel.mesh_of_instance[instance.instance_id];
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
    const std::vector<DeviceTriangle> triangles = unpack({tree.blocks, block_count});
    arrays_.push_back({DeviceArray<Node>(std::span<const Node>(tree.nodes, tree.node_count)),
                       DeviceArray<DeviceTriangle>(std::span<const DeviceTriangle>(triangles))});
    DeviceTree out;
    static_cast<TreeView&>(out) = tree;
    out.nodes = arrays_.back().nodes.data();
    out.triangles = arrays_.back().triangles.data();
    out.blocks = nullptr;
    out.wide_nodes = nullptr;
    out.treelet_count = 0;
    out.treelet_begin = out.treelet_of_node = nullptr;
    out.treelet_roots = nullptr;
    return out;
}

}  // namespace packet::cuda
