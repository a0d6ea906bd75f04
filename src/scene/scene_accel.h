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

/// Builds everything, or throws and leaves nothing behind.
[[nodiscard]] std::shared_ptr<const SceneAccel> build_scene_accel(
    std::span<const TriangleMesh> meshes, std::span<const Instance> instances,
    const BuildOptions& options);

}  // namespace packet
