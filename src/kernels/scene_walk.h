// Walks a scene with packets: the tree over instances, and in its leaves the trees of their meshes,
// with the rays moved into the space of the mesh and `t` left alone. A scene that is one mesh is
// walked directly.
#pragma once

#include "kernels/grid_packet.h"
#include "kernels/grid_walk.h"
#include "kernels/mesh_walk.h"

namespace packet {

/// The lanes of `ray` that are usable in the mesh's space and still look for something meet the
/// mesh.
template <Query query, int N, class Isa, class Stats>
[[gnu::noinline]] void walk_mesh(const TreeView& tree, const RayLanes<N, Isa>& ray,
                                 std::int32_t instance_id, BestHits<N, Isa>& best, Stats& stats) {
    using F = Float<N, Isa>;
    if (tree.is_empty()) return;
    const Mask<N, Isa> looking = best.t > F(kNever);
    const Mask<N, Isa> active = looking & usable(ray);
    if (none(active)) return;
    best.enter_instance(instance_id);
    PreparedRays<N, Isa> prepared;
    prepare(prepared, tree, ray, active.bits());
    const F kept = best.t;
    best.t = select(active, best.t, F(kNever));
    if (tree.grid.bricks != nullptr) {
        walk_grid<query>(tree, ray, prepared, active, instance_id, best, stats);
    } else if (prepared.directions == Directions::kShared) {
        MeshWalk<query, Directions::kShared, N, Isa, Stats>(tree, ray, prepared, instance_id, best,
                                                            stats)
            .run();
    } else {
        MeshWalk<query, Directions::kMixed, N, Isa, Stats>(tree, ray, prepared, instance_id, best,
                                                           stats)
            .run();
    }
    best.t = select(active, best.t, kept);
}

/// The lanes of `active` meet the instances of a leaf of the top tree; the others sit out.
template <Query query, int N, class Isa, class Stats>
PACKET_INLINE void meet_instances(const SceneView& scene, const RayLanes<N, Isa>& ray,
                                  std::uint32_t first, std::uint32_t item_count,
                                  Mask<N, Isa> active, BestHits<N, Isa>& best, Stats& stats) {
    const Float<N, Isa> kept = best.t;
    best.t = select(active, best.t, Float<N, Isa>(kNever));
    for (std::uint32_t i = first; i < first + item_count; ++i) {
        const InstanceView& instance = scene.instances[i];
        walk_mesh<query>(*instance.tree, to_object(instance, ray),
                         static_cast<std::int32_t>(instance.instance_id), best, stats);
    }
    best.t = select(active, best.t, kept);
}

template <Query query, int N, class Isa, class Stats>
PACKET_INLINE void walk_scene(const SceneView& scene, const RayLanes<N, Isa>& ray,
                              BestHits<N, Isa>& best, Stats& stats) {
    if (scene.is_single_mesh) {
        const InstanceView& only = scene.instances[0];
        walk_mesh<query>(*only.tree, ray, static_cast<std::int32_t>(only.instance_id), best, stats);
        return;
    }
    if (scene.top.node_count == 0) return;
    PreparedRays<N, Isa> prepared;
    prepare_boxes(prepared, scene.top, ray);
    PacketWalk<query, Directions::kMixed, N, Isa, Stats> walk(scene.top, prepared, best.t, stats);
    walk.run(
        NoBeam{},
        [&](std::uint32_t first, std::uint32_t item_count, Mask<N, Isa> active) {
            meet_instances<query>(scene, ray, first, item_count, active, best, stats);
        },
        NeverAlone{});
}

}  // namespace packet
