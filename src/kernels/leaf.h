// What happens at a leaf of a mesh's tree: many rays meet its triangles one by one, a single ray
// meets eight at once.
#pragma once

#include "kernels/best_hit.h"
#include "kernels/triangle.h"

namespace packet {

/// A packet meets the triangles `first` to `first + count`, each broadcast to all lanes.
template <Query query, Directions directions, int N, class Isa>
PACKET_INLINE void meet_triangles(const TreeView& tree, const PreparedRays<N, Isa>& ray,
                                  std::uint32_t first, std::uint32_t count,
                                  std::int32_t instance_id, BestHits<N, Isa>& best) {
    using F = Float<N, Isa>;
    for (std::uint32_t i = first; i < first + count; ++i) {
        const TriangleBlock& block = tree.blocks[i / kBlockSize];
        const std::uint32_t lane = i % kBlockSize;
        const TriangleHits<N, Isa> hits = test_triangles<directions>(
            ray, best.t, [&](int corner, int axis) { return F(block.v[corner][axis][lane]); });
        if (none(hits.hit)) continue;
        best.template update<query>(hits.hit, hits.t, hits.u, hits.v,
                                    Int<N, Isa>(block.prim_id[lane]), instance_id);
    }
}

/// The lane with the smallest (t, prim_id) among `bits`.
template <int N>
PACKET_INLINE int nearest_lane(std::uint32_t bits, const float (&t)[N],
                               const std::int32_t* prim_id) {
    int nearest = __builtin_ctz(bits);
    for (bits &= bits - 1; bits != 0; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        if (t[i] < t[nearest] || (t[i] == t[nearest] && prim_id[i] < prim_id[nearest])) nearest = i;
    }
    return nearest;
}

/// A single ray, in all lanes, meets the blocks that hold triangles `first` to `first + count`.
/// Other leaves' triangles in the same block are met along: they are triangles like any other.
template <Query query, class Isa>
PACKET_INLINE void meet_blocks(const TreeView& tree, const PreparedRays<kBlockSize, Isa>& ray,
                               std::uint32_t first, std::uint32_t count, std::int32_t instance_id,
                               BestHits<1, Isa>& best) {
    using F = Float<kBlockSize, Isa>;
    for (std::uint32_t b = first / kBlockSize; b <= (first + count - 1) / kBlockSize; ++b) {
        const TriangleBlock& block = tree.blocks[b];
        const TriangleHits<kBlockSize, Isa> hits = test_triangles<Directions::kShared>(
            ray, F(best.t.r[0]),
            [&](int corner, int axis) { return F::load(block.v[corner][axis]); });
        const std::uint32_t bits = hits.hit.bits();
        if (bits == 0) continue;
        float t[kBlockSize], u[kBlockSize], v[kBlockSize];
        hits.t.store(t), hits.u.store(u), hits.v.store(v);
        const int i = nearest_lane(bits, t, block.prim_id);
        best.template update<query>(Mask<1, Isa>::from_bits(1), t[i], u[i], v[i], block.prim_id[i],
                                    instance_id);
        if (query == Query::kAny) return;
    }
}

}  // namespace packet
