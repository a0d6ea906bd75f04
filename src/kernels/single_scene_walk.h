// Walks a scene with single rays, as scene_walk.h does with packets.
#pragma once

#include "kernels/grid_walk.h"
#include "kernels/leaf.h"
#include "kernels/single_walk.h"

namespace packet {

/// The ray meets a mesh.
template <Query query, class Isa, class Stats>
[[gnu::noinline]] void walk_mesh(const TreeView& tree, const SingleRay& ray,
                                 std::int32_t instance_id, BestHits<1, Isa>& best, Stats& stats) {
    best.enter_instance(instance_id);
    if (tree.grid.bricks != nullptr) {
        walk_grid<query>(tree, ray, kNever, instance_id, best, stats);
        return;
    }
    const SingleLeaf<query, Isa> leaf{tree, ray, instance_id, best};
    walk_wide_tree<query, Isa>(tree, ray, best.t.r[0], stats,
                               [&](std::uint32_t first, std::uint32_t item_count) {
                                   stats.triangles(static_cast<int>(item_count));
                                   leaf.meet(BlockRange{first, item_count});
                               });
}

/// The ray meets the instances of a leaf of the top tree.
template <Query query, class Isa, class Stats>
PACKET_INLINE void meet_instances(const SceneView& scene, const RayAxes<Isa>& world,
                                  std::uint32_t first, std::uint32_t item_count,
                                  BestHits<1, Isa>& best, Stats& stats) {
    for (std::uint32_t i = first; i < first + item_count && best.t.r[0] != kNever; ++i) {
        const InstanceView& instance = scene.instances[i];
        const RayAxes<Isa> moved = to_object(instance, world);
        if (instance.tree->is_empty() || !usable(moved)) continue;
        SingleRay ray;
        prepare(ray, *instance.tree, moved);
        walk_mesh<query>(*instance.tree, ray, static_cast<std::int32_t>(instance.instance_id), best,
                         stats);
    }
}

/// The tree that rays meet first.
PACKET_INLINE const TreeView& first_tree(const SceneView& scene) {
    return scene.is_single_mesh ? *scene.instances[0].tree : scene.top;
}

/// A ray, which is usable and prepared for the scene's first tree, walks the scene.
template <Query query, class Isa, class Stats>
PACKET_INLINE void walk_scene_singly(const SceneView& scene, const RayAxes<Isa>& world,
                                     const SingleRay& ray, BestHits<1, Isa>& best, Stats& stats) {
    if (scene.is_single_mesh) {
        walk_mesh<query>(*scene.instances[0].tree, ray,
                         static_cast<std::int32_t>(scene.instances[0].instance_id), best, stats);
        return;
    }
    walk_wide_tree<query, Isa>(
        scene.top, ray, best.t.r[0], stats, [&](std::uint32_t first, std::uint32_t item_count) {
            meet_instances<query>(scene, world, first, item_count, best, stats);
        });
}

}  // namespace packet
