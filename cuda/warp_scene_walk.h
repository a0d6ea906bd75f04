// Walks a scene with a warp, as kernels/scene_walk.h does with packets: the tree over instances,
// and in its leaves the trees of their meshes, on the same stack.
#pragma once

#include "warp_walk.h"

namespace packet::cuda {

/// The lanes of `active` meet a leaf's triangles, one after the other, each loaded once for all.
template <Query query>
PACKET_DEVICE void meet_leaf(const DeviceTree& tree, const PreparedLane& ray,
                             std::int32_t instance_id, std::uint32_t first, std::uint32_t count,
                             LaneMask1 active, BestHit& best) {
    for (std::uint32_t item = first; item < first + count; ++item) {
        const LoadedTriangle triangle = load_triangle(tree, item);
        const auto hits = meet_triangle(ray, best.t, active, triangle);
        if (none(hits.hit)) continue;
        take_hit<query>(best, hits, triangle, instance_id);
    }
}

/// The lanes whose ray is usable in the mesh's space and still look for something meet the mesh.
template <Query query, class Stats>
PACKET_DEVICE void walk_mesh(const DeviceTree& tree, const LaneRay& ray, std::int32_t instance_id,
                             BestHit& best, WarpStack& stack, Stats& stats) {
    if (tree.is_empty()) return;
    const LaneMask1 active = (best.t > Lane(kNever)) & usable(ray);
    if (vote(active) == 0) return;
    best.enter_instance(instance_id);
    PreparedLane prepared;
    prepare_lane(prepared, tree, ray);
    const Lane kept = best.t;
    best.t = select(active, best.t, Lane(kNever));
    walk_tree(tree, prepared, best.t, stack, stats,
              [&](std::uint32_t first, std::uint32_t count, LaneMask1 takes_part) {
                  stats.triangles(any(takes_part) ? count : 0);
                  meet_leaf<query>(tree, prepared, instance_id, first, count, takes_part, best);
              });
    best.t = select(active, best.t, kept);
}

/// The lanes of `active` meet the instances of a leaf of the top tree; the others sit out.
template <Query query, class Stats>
PACKET_DEVICE void meet_instances(const SceneView& scene, const LaneRay& ray, std::uint32_t first,
                                  std::uint32_t count, LaneMask1 active, BestHit& best,
                                  WarpStack& stack, Stats& stats) {
    const Lane kept = best.t;
    best.t = select(active, best.t, Lane(kNever));
    for (std::uint32_t i = first; i < first + count; ++i) {
        const InstanceView& instance = scene.instances[i];
        walk_mesh<query>(static_cast<const DeviceTree&>(*instance.tree), to_object(instance, ray),
                         static_cast<std::int32_t>(instance.instance_id), best, stack, stats);
    }
    best.t = select(active, best.t, kept);
}

template <Levels levels, Query query, class Stats>
PACKET_DEVICE void walk_scene(const SceneView& scene, const LaneRay& ray, BestHit& best,
                              WarpStack& stack, Stats& stats) {
    if constexpr (levels == Levels::kOneMesh) {
        const InstanceView& only = scene.instances[0];
        walk_mesh<query>(static_cast<const DeviceTree&>(*only.tree), ray,
                         static_cast<std::int32_t>(only.instance_id), best, stack, stats);
    } else {
        if (scene.top.node_count == 0) return;
        PreparedLane prepared;
        prepare_lane(prepared, scene.top, ray);
        walk_tree(scene.top, prepared, best.t, stack, stats,
                  [&](std::uint32_t first, std::uint32_t count, LaneMask1 active) {
                      meet_instances<query>(scene, ray, first, count, active, best, stack, stats);
                  });
    }
}

}  // namespace packet::cuda
