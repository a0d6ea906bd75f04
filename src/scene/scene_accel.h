// What commit() makes of a scene: a tree for each mesh, and one over the instances.
#pragma once

#include "build/tree.h"

#include <packet/scene.h>

#include <span>
#include <vector>

namespace packet {

struct SceneAccel {
    std::vector<Tree> trees;           ///< by mesh_id
    std::vector<TreeView> tree_views;  ///< by mesh_id
    Tree top;
    std::vector<InstanceView> instances;          ///< in the order of the top tree's leaves
    std::vector<std::uint32_t> mesh_of_instance;  ///< by instance_id
    BuildStats stats;
    SceneView view;
};

/// The tree over the instances, of meshes in these boxes, and all of the view. `tree` of the
/// instances is null: it is for the caller to say where meshes' trees are.
void build_top(std::span<const Instance> instances, std::span<const Bounds3f> mesh_bounds,
               const BuildOptions& options, const Parallel& parallel, SceneAccel& out);

/// Builds everything, or throws and leaves nothing behind.
[[nodiscard]] std::shared_ptr<const SceneAccel> build_scene_accel(
    std::span<const TriangleMesh> meshes, std::span<const Instance> instances,
    const BuildOptions& options);

}  // namespace packet
