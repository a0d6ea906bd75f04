// What happens at a leaf of a mesh's tree: many rays meet a triangle, a single ray meets eight.
#pragma once

#include "kernels/best_hit.h"
#include "kernels/single_ray.h"
#include "kernels/triangle.h"

namespace packet {

/// The blocks that hold items `first` to `first + count`, and which lanes of each.
struct BlockRange {
    std::uint32_t first, count;

    PACKET_INLINE std::uint32_t begin() const { return first / kBlockSize; }
    PACKET_INLINE std::uint32_t end() const { return (first + count - 1) / kBlockSize + 1; }
    PACKET_INLINE std::uint32_t lanes(std::uint32_t block) const {
        constexpr std::uint32_t kAll = (1u << kBlockSize) - 1;
        std::uint32_t out = kAll;
        if (block == begin()) out &= kAll << first % kBlockSize;
        if (block + 1 == end()) out &= kAll >> (kBlockSize - 1 - (first + count - 1) % kBlockSize);
        return out;
    }
};

/// A packet meets a triangle, broadcast to all lanes.
template <Query query, Directions directions, int N, class Isa>
struct PacketLeaf {
    const PreparedRays<N, Isa>& ray;
    const int (&axis)[3];  ///< of the shear: for all packets of a tile the same
    std::int32_t instance_id;
    BestHits<N, Isa>& best;

    /// The triangle of one lane of a block.
    PACKET_INLINE void meet(const TriangleBlock& block, int lane, Mask<N, Isa> active) const {
        const SameTriangle triangle{block, lane};
        meet(triangle, triangle, active);
    }
    /// `corners` is the triangle, or relative to the rays' origin.
    template <class Corners>
    PACKET_INLINE void meet(const Corners& corners, const SameTriangle& triangle,
                            Mask<N, Isa> active) const {
        for (int i = 0; i < LanesOf<N, Isa>::kRegisters; ++i) {
            const auto sheared = shear<directions>(part(ray.shear, axis, i), corners);
            const auto candidates = part(active, i) & sheared.may_hit();
            if (none(candidates)) continue;
            if constexpr (query == Query::kAny) {
                best.occlude(
                    i, decide_occluded<directions>(sheared, ray, best.t, candidates, triangle, i));
            } else {
                const auto hits =
                    decide_hits(sheared, part(ray.hit, i), part(best.t, i), candidates, triangle);
                if (none(hits.hit)) continue;
                best.update(i, hits.hit, hits.t, hits.u, hits.v, triangle.prim_id(), instance_id);
            }
        }
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

/// A ray's nearest hit among the triangles of a block.
struct BlockHit {
    float t, u, v;
    std::int32_t prim_id;
};

/// A ray meets the triangles of a block, all at once. Those that belong to other leaves are met
/// along: they are triangles like any other. Calls take(hit) if it hits any.
template <class Isa, class Ray, class Take>
PACKET_INLINE void meet_block(const ShearRays<kBlockSize, Isa>& shear_ray, const Ray& ray,
                              const float& best_t, const TriangleBlock& block, Take&& take) {
    const BlockTriangles triangles{block};
    const auto sheared = shear<Directions::kShared>(shear_ray, triangles);
    const auto candidates = sheared.may_hit();
    if (none(candidates)) return;
    const TriangleHits<kBlockSize, Isa> hits =
        decide_hits(sheared, SingleHitRay<kBlockSize, Isa>(ray), Float<kBlockSize, Isa>(best_t),
                    candidates, triangles);
    const std::uint32_t bits = hits.hit.bits();
    if (bits == 0) return;
    float t[kBlockSize], u[kBlockSize], v[kBlockSize];
    hits.t.store(t), hits.u.store(u), hits.v.store(v);
    const int i = nearest_lane(bits, t, block.prim_id);
    take(BlockHit{t[i], u[i], v[i], block.prim_id[i]});
}

/// Which of `candidates`, triangles of a block, the ray hits, all computed anew: rare, so that
/// registers need not be kept for it.
template <class Isa, class Ray>
PACKET_NOINLINE std::uint32_t decide_block(const Ray& ray, float best_t, std::uint32_t candidates,
                                           const TriangleBlock& block) {
    const BlockTriangles triangles{block};
    return decide_hits(shear<Directions::kShared>(shear_of<kBlockSize, Isa>(ray), triangles),
                       SingleHitRay<kBlockSize, Isa>(ray), Float<kBlockSize, Isa>(best_t),
                       Mask<kBlockSize, Isa>::from_bits(candidates), triangles)
        .hit.bits();
}

/// Triangles of a block that a ray surely hits, and all that it may hit.
struct Occluders {
    std::uint32_t sure, possible;
};

/// Of `candidates`, triangles that the ray may hit.
template <class Isa, class Ray>
PACKET_INLINE Occluders find_occluders(const ShearedTriangles<kBlockSize, Isa>& sheared,
                                       Mask<kBlockSize, Isa> candidates, const Ray& ray,
                                       float best_t) {
    const Verdicts<kBlockSize, Isa> verdicts =
        judge(sheared, SingleHitRay<kBlockSize, Isa>(ray), Float<kBlockSize, Isa>(best_t));
    return {(candidates & verdicts.hit).bits(), (candidates & ~verdicts.miss).bits()};
}

/// As meet_block(), for any-hit: whether the ray hits a triangle.
template <class Isa, class Ray>
PACKET_INLINE bool is_occluded(const ShearRays<kBlockSize, Isa>& shear_ray, const Ray& ray,
                               float best_t, const TriangleBlock& block) {
    const auto sheared = shear<Directions::kShared>(shear_ray, BlockTriangles{block});
    const auto candidates = sheared.may_hit();
    if (none(candidates)) return false;
    const Occluders found = find_occluders(sheared, candidates, ray, best_t);
    if (found.sure != 0 || found.possible == 0) [[likely]]
        return found.sure != 0;
    return decide_block<Isa>(ray, best_t, found.possible, block) != 0;
}

/// A single ray meets the blocks of a range.
template <Query query, class Isa>
struct SingleLeaf {
    const TreeView& tree;
    const SingleRay& ray;
    std::int32_t instance_id;
    BestHits<1, Isa>& best;

    PACKET_INLINE void meet(BlockRange range) const {
        for (std::uint32_t b = range.begin(); b < range.end(); ++b) {
            const auto shear = shear_of<kBlockSize, Isa>(opaque(ray));
            if constexpr (query == Query::kAny) {
                if (!is_occluded(shear, ray, best.t.r[0], tree.blocks[b])) continue;
                best.occlude(0);
                return;
            } else {
                meet_block(shear, ray, best.t.r[0], tree.blocks[b],
                           [&](const BlockHit& hit) { best.update(hit, instance_id); });
            }
        }
    }
};

}  // namespace packet
