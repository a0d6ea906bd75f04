// Walks a scene with single rays, as scene_walk.h does with packets.
#pragma once

#include "kernels/grid_walk.h"
#include "kernels/leaf.h"
#include "kernels/single_walk.h"

namespace packet {

/// The rays of `active` meet the mesh, one by one; `best` has a place for each of the lanes.
template <Query query, class Isa, class Stats>
[[gnu::noinline]] void walk_mesh(const TreeView& tree, const PreparedLanes& lanes,
                                 std::uint32_t active, std::int32_t instance_id,
                                 BestHits<1, Isa>* best, Stats& stats) {
    for (; active != 0; active &= active - 1) {
        const int i = __builtin_ctz(active);
        const SingleRay ray(lanes, i);
        best[i].enter_instance(instance_id);
        if (tree.grid.bricks != nullptr) {
            walk_grid<query>(tree, ray, kNever, instance_id, best[i], stats);
            continue;
        }
        const SingleLeaf<query, Isa> leaf{tree, ray, instance_id, best[i]};
        walk_wide_tree<query, Isa>(tree, ray, best[i].t.r[0], stats,
                                   [&](std::uint32_t first, std::uint32_t item_count) {
                                       stats.triangles(static_cast<int>(item_count));
                                       leaf.meet(BlockRange{first, item_count});
                                   });
    }
}

/// The ray meets the instances of a leaf of the top tree.
template <Query query, class Isa, class Stats>
PACKET_INLINE void meet_instances(const SceneView& scene, const RayLanes<1, Isa>& ray,
                                  std::uint32_t first, std::uint32_t item_count,
                                  BestHits<1, Isa>& best, Stats& stats) {
    for (std::uint32_t i = first; i < first + item_count && best.t.r[0] != kNever; ++i) {
        const InstanceView& instance = scene.instances[i];
        const RayLanes<1, Isa> moved = to_object(instance, ray);
        if (instance.tree->is_empty() || none(usable(moved))) continue;
        PreparedLanes lanes;
        prepare_lanes(*instance.tree, broadcast(moved), lanes);
        walk_mesh<query>(*instance.tree, lanes, 1, static_cast<std::int32_t>(instance.instance_id),
                         &best, stats);
    }
}

/// Lanes of rays in memory, to pick single ones from.
struct StoredRays {
    float org[3][kSingleLanes], dir[3][kSingleLanes], tnear[kSingleLanes], tfar[kSingleLanes];

    template <class Isa>
    PACKET_INLINE explicit StoredRays(const RayLanes<kSingleLanes, Isa>& ray) {
        for (int a = 0; a < 3; ++a) ray.org[a].store(org[a]), ray.dir[a].store(dir[a]);
        ray.tnear.store(tnear), ray.tfar.store(tfar);
    }
    template <class Isa>
    PACKET_INLINE RayLanes<1, Isa> lane(int i) const {
        return {{org[0][i], org[1][i], org[2][i]},
                {dir[0][i], dir[1][i], dir[2][i]},
                tnear[i],
                tfar[i]};
    }
};

/// The rays of `active`, which are usable, walk the scene one by one; `best` has a place for each
/// of the lanes.
template <Query query, class Isa, class Stats>
PACKET_INLINE void walk_scene_singly(const SceneView& scene,
                                     const RayLanes<kSingleLanes, Isa>& rays, std::uint32_t active,
                                     BestHits<1, Isa>* best, Stats& stats) {
    const TreeView& tree = scene.is_single_mesh ? *scene.instances[0].tree : scene.top;
    if (tree.is_empty()) return;
    PreparedLanes lanes;
    prepare_lanes(tree, rays, lanes);
    if (scene.is_single_mesh) {
        walk_mesh<query>(tree, lanes, active,
                         static_cast<std::int32_t>(scene.instances[0].instance_id), best, stats);
        return;
    }
    const StoredRays stored(rays);
    for (; active != 0; active &= active - 1) {
        const int i = __builtin_ctz(active);
        const RayLanes<1, Isa> world = stored.lane<Isa>(i);
        walk_wide_tree<query, Isa>(tree, SingleRay(lanes, i), best[i].t.r[0], stats,
                                   [&](std::uint32_t first, std::uint32_t item_count) {
                                       meet_instances<query>(scene, world, first, item_count,
                                                             best[i], stats);
                                   });
    }
}

}  // namespace packet
