// What happens at a leaf of a mesh's tree: many rays meet its triangles one by one, a single ray
// meets eight at once.
#pragma once

#include "kernels/best_hit.h"
#include "kernels/single_ray.h"
#include "kernels/triangle.h"

namespace packet {

/// A packet meets the triangles `first` to `first + count`, each broadcast to all lanes.
template <Query query, Directions directions, int N, class Isa>
struct PacketLeaf {
    const TreeView& tree;
    const PreparedRays<N, Isa>& ray;
    std::int32_t instance_id;
    BestHits<N, Isa>& best;

    PACKET_INLINE void meet(std::uint32_t first, std::uint32_t count, Mask<N, Isa> active) const {
        for (std::uint32_t i = first; i < first + count; ++i) {
            const TriangleBlock& block = tree.blocks[i / kBlockSize];
            const int lane = static_cast<int>(i % kBlockSize);
            const Mask<N, Isa> candidates =
                active & may_hit<directions>(ray.shear, SameTriangle{block, lane});
            if (any(candidates)) decide(block, lane, candidates);
        }
    }

private:
    /// Not inlined, to leave the registers to the test that most triangles fail.
    [[gnu::noinline]] void decide(const TriangleBlock& block, int lane,
                                  Mask<N, Isa> candidates) const {
        const TriangleHits<N, Isa> hits =
            decide_hits<directions>(ray, best.t, candidates, SameTriangle{block, lane});
        best.template update<query>(hits.hit, hits.t, hits.u, hits.v,
                                    Int<N, Isa>(block.prim_id[lane]), instance_id);
    }
};

/// The lane with the smallest (t, prim_id) among `bits`.
PACKET_INLINE int nearest_lane(std::uint32_t bits, const float* t, const std::int32_t* prim_id) {
    int nearest = __builtin_ctz(bits);
    for (bits &= bits - 1; bits != 0; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        if (t[i] < t[nearest] || (t[i] == t[nearest] && prim_id[i] < prim_id[nearest])) nearest = i;
    }
    return nearest;
}

/// A single ray meets the blocks that hold triangles `first` to `first + count`. Other leaves'
/// triangles in the same block are met along: they are triangles like any other.
template <Query query, class Isa>
struct SingleLeaf {
    using F = Float<kBlockSize, Isa>;
    using M = Mask<kBlockSize, Isa>;

    const TreeView& tree;
    const SingleRay& ray;
    std::int32_t instance_id;
    BestHits<1, Isa>& best;

    PACKET_INLINE void meet(std::uint32_t first, std::uint32_t count) const {
        ShearRays<kBlockSize, Isa> shear;
        ray.broadcast(shear);
        for (std::uint32_t b = first / kBlockSize; b <= (first + count - 1) / kBlockSize; ++b) {
            const TriangleBlock& block = tree.blocks[b];
            const M candidates = may_hit<Directions::kShared>(shear, BlockTriangles{block});
            if (none(candidates)) continue;
            decide(block, candidates.bits());
            if (query == Query::kAny && best.t.r[0] == kNever) return;
        }
    }

private:
    /// Not inlined, as above.
    [[gnu::noinline]] void decide(const TriangleBlock& block, std::uint32_t candidates) const {
        PreparedRays<kBlockSize, Isa> rays;
        ray.broadcast(rays);
        const TriangleHits<kBlockSize, Isa> hits = decide_hits<Directions::kShared>(
            rays, F(best.t.r[0]), M::from_bits(candidates), BlockTriangles{block});
        const std::uint32_t bits = hits.hit.bits();
        if (bits == 0) return;
        float t[kBlockSize], u[kBlockSize], v[kBlockSize];
        hits.t.store(t), hits.u.store(u), hits.v.store(v);
        const int i = nearest_lane(bits, t, block.prim_id);
        best.template update<query>(Mask<1, Isa>::from_bits(1), t[i], u[i], v[i], block.prim_id[i],
                                    instance_id);
    }
};

}  // namespace packet
