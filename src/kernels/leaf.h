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

/// A packet meets triangles of a block. Most rays may hit one of them at most; so each picks one,
/// and all decide at once about what they picked.
template <Query query, Directions directions, int N, class Isa>
struct PacketLeaf {
    const PreparedRays<N, Isa>& ray;
    const int (&axis)[3];  ///< of the shear: for all packets of a tile the same
    std::int32_t instance_id;
    BestHits<N, Isa>& best;

    /// The lanes of `active` meet `triangles`, at least one, which they first see as `corners`.
    template <class Corners>
    PACKET_INLINE void meet(const TriangleBlock& block, const Corners& corners,
                            std::uint32_t triangles, Mask<N, Isa> active) const {
        for (int i = 0; i < LanesOf<N, Isa>::kRegisters; ++i) {
            meet_by_triangles(i, block, corners, triangles, part(active, i));
        }
    }
    PACKET_INLINE void meet(const TriangleBlock& block, std::uint32_t triangles,
                            Mask<N, Isa> active) const {
        meet(block, BlockCorners{block}, triangles, active);
    }
    /// Better where they are fewer than the triangles.
    template <class Corners>
    PACKET_INLINE void meet_one_by_one(const TriangleBlock& block, const Corners& corners,
                                       std::uint32_t triangles, Mask<N, Isa> active) const {
        static_assert(directions == Directions::kShared);
        for (int i = 0; i < LanesOf<N, Isa>::kRegisters; ++i) {
            meet_by_rays(i, block, corners, triangles, part(active, i));
        }
    }

private:
    static constexpr int kPart = kPartSize<N, Isa>;
    using PartMask = Mask<kPart, Isa>;
    using PartInt = Int<kPart, Isa>;

    /// The lanes of register i meet one triangle after the other.
    template <class Corners>
    PACKET_INLINE void meet_by_triangles(int i, const TriangleBlock& block, const Corners& corners,
                                         std::uint32_t triangles, PartMask active) const {
        const auto shear_ray = part(ray.shear, axis, i);
        PartMask has_picked = PartMask::from_bits(0);
        PartInt picked(0);
        do {
            const int lane = __builtin_ctz(triangles);
            const auto sheared = shear<directions>(shear_ray, corners.one(lane));
            const PartMask candidates = active & sheared.may_hit();
            const PartMask again = candidates & has_picked;
            if (any(again)) decide(i, sheared, again, SameTriangle{block, lane});
            picked = select(candidates & ~has_picked, PartInt(lane), picked);
            has_picked = has_picked | candidates;
        } while ((triangles &= triangles - 1) != 0);
        if (none(has_picked)) return;
        const PickedTriangles<kPart, Isa> own{block, picked};
        decide(i, shear<directions>(shear_ray, own), has_picked, own);
    }
    /// Each of them meets all triangles.
    template <class Corners>
    PACKET_INLINE void meet_by_rays(int i, const TriangleBlock& block, const Corners& corners,
                                    std::uint32_t triangles, PartMask active) const {
        std::uint32_t has_picked = 0, again = 0;
        std::int32_t picked[kPart] = {};
        for (std::uint32_t left = active.bits(); left != 0; left &= left - 1) {
            const int lane = __builtin_ctz(left);
            const PacketRay<N, Isa> one{ray, i * kPart + lane};
            const auto sheared =
                shear<Directions::kShared>(shear_of<kBlockSize, Isa>(one), corners.all());
            const std::uint32_t candidates = sheared.may_hit().bits() & triangles;
            picked[lane] = __builtin_ctz(candidates | 1u << (kBlockSize - 1));
            has_picked |= (candidates != 0 ? 1u : 0u) << lane;
            again |= candidates & (candidates - 1);
        }
        if (has_picked == 0) return;
        const auto shear_ray = part(ray.shear, axis, i);
        const PickedTriangles<kPart, Isa> own{block, PartInt::load(picked)};
        decide(i, shear<directions>(shear_ray, own), PartMask::from_bits(has_picked), own);
        if (again != 0) meet_by_triangles(i, block, corners, again, active);
    }
    template <class Triangles>
    PACKET_INLINE void decide(int i, const ShearedTriangles<kPart, Isa>& sheared,
                              PartMask candidates, const Triangles& triangles) const {
        if constexpr (query == Query::kAny) {
            best.occlude(
                i, decide_occluded<directions>(sheared, ray, best.t, candidates, triangles, i));
        } else {
            const auto hits =
                decide_hits(sheared, part(ray.hit, i), part(best.t, i), candidates, triangles);
            if (none(hits.hit)) return;
            best.update(i, hits.hit, hits.t, hits.u, hits.v, triangles.prim_id(), instance_id);
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
