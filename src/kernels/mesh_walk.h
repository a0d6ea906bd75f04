// Walks the tree of a mesh with a packet: in a beam if its lanes share their directions, and lane
// by lane where only few go.
#pragma once

#include "kernels/beam.h"
#include "kernels/lone_lanes.h"
#include "kernels/packet_walk.h"

namespace packet {

/// A packet in a mesh.
template <Query query, Directions directions, int N, class Isa, class Stats>
class MeshWalk {
public:
    PACKET_INLINE MeshWalk(const TreeView& tree, const RayLanes<N, Isa>& ray,
                           const PreparedRays<N, Isa>& prepared, std::int32_t instance_id,
                           BestHits<N, Isa>& best, Stats& stats)
        : tree_(tree),
          ray_(ray),
          prepared_(prepared),
          instance_id_(instance_id),
          best_(best),
          stats_(stats) {}

    PACKET_INLINE void run() {
        if constexpr (directions == Directions::kShared) {
            const BeamBounds bounds = bound_rays(&prepared_, &best_, 1);
            if (bounds.is_sound) return run(Beam<Isa>(bounds));
        }
        run(NoBeam{});
    }

private:
    template <class BeamOrNone>
    PACKET_INLINE void run(const BeamOrNone& beam) {
        PacketWalk<query, directions, N, Isa, Stats> walk(tree_, prepared_, best_.t, stats_);
        walk.run(
            beam,
            [&](std::uint32_t first, std::uint32_t item_count, Mask<N, Isa> active) {
                meet_leaf({first, item_count}, active, beam);
            },
            Alone{*this});
    }
    template <class BeamOrNone>
    PACKET_INLINE void meet_leaf(BlockRange range, Mask<N, Isa> active, const BeamOrNone& beam) {
        const PacketLeaf<query, directions, N, Isa> leaf{prepared_, prepared_.shear.axis,
                                                         instance_id_, best_};
        for (std::uint32_t b = range.begin(); b < range.end(); ++b) {
            const TriangleBlock& block = tree_.blocks[b];
            const std::uint32_t triangles = range.lanes(b) & beam.meets(block);
            stats_.triangles(count(active) * __builtin_popcount(triangles));
            if (triangles != 0) leaf.meet(block, triangles, active);
        }
    }

    struct Alone {
        // Measured: docs/experiments.md#packets.
        static constexpr int kFewest = N / 4;
        MeshWalk& walk;
        PACKET_NOINLINE void operator()(const WideChild& child, Mask<N, Isa> active) const {
            walk.walk_alone(child, active);
        }
    };
    PACKET_INLINE void walk_alone(const WideChild& child, Mask<N, Isa> active) {
        const auto ray_of = [&](int lane) -> const SingleRay& {
            if ((prepared_lanes_ >> lane & 1) == 0) {
                prepare(lanes_[lane], tree_, RayAxes<Isa>(ray_, lane));
                prepared_lanes_ |= 1u << lane;
            }
            return lanes_[lane];
        };
        LoneLanes<query, N, Isa, decltype(ray_of)> lanes(tree_, ray_of, instance_id_, best_);
        lanes.walk(child, active, stats_);
    }

    const TreeView& tree_;
    const RayLanes<N, Isa>& ray_;
    const PreparedRays<N, Isa>& prepared_;
    std::int32_t instance_id_;
    BestHits<N, Isa>& best_;
    Stats& stats_;
    std::uint32_t prepared_lanes_ = 0;  ///< of lanes_
    SingleRay lanes_[N];
};

}  // namespace packet
