// From rays in memory to hits in memory: fills packets, walks the scene, writes what was found.
#pragma once

#include "kernels/counters.h"
#include "kernels/kernel_table.h"
#include "kernels/scene_walk.h"
#include "kernels/single_scene_walk.h"
#include "kernels/triangle_box_axes.h"
#include "kernels/triangle_box_clip.h"

namespace packet {

/// N rays transposed: one array a component, in the order of Ray's members. (RayPacket itself has
/// constructors, and a copy of those compiled for this ISA must not end up in the library.)
template <int N, class Isa>
struct RayArrays {
    alignas(4 * N) float component[8][N];
};

/// N hits transposed. Bit i of `found`: lane i has one.
template <int N, class Isa>
struct HitArrays {
    float t[N], u[N], v[N];
    std::int32_t prim_id[N], instance_id[N];
    std::uint32_t found;
};

/// Loads the lanes of `active`; the others become NaN, which takes part in nothing.
template <int N, class Isa>
PACKET_INLINE RayLanes<N, Isa> load_rays(const float* const (&component)[8], Mask<N, Isa> active) {
    using F = Float<N, Isa>;
    const F nan(__builtin_nanf(""));
    F lanes[8];
    for (int i = 0; i < 8; ++i) lanes[i] = select(active, F::load(component[i]), nan);
    return {{lanes[0], lanes[1], lanes[2]},
            {lanes[4], lanes[5], lanes[6]},
            max(F(-kLargestFloat), lanes[3]),  // NaN stays NaN
            lanes[7]};
}

template <int N, class Isa>
PACKET_INLINE void store_hits(const BestHits<N, Isa>& best, HitArrays<N, Isa>& out) {
    using F = Float<N, Isa>;
    const Mask<N, Isa> found = best.found();
    select(found, best.t, F(__builtin_huge_valf())).store(out.t);
    best.u.store(out.u);
    best.v.store(out.v);
    select(found, best.prim_id, Int<N, Isa>(-1)).store(out.prim_id);
    select(found, best.instance_id, Int<N, Isa>(-1)).store(out.instance_id);
    out.found = found.bits();
}

/// How a kernel's rays walk: one by one, or together.
enum class Walk { kSingle, kPacket };

/// The lanes of `active_bits` trace; the others of `out` are of no meaning.
template <Walk walk, Query query, int N, class Isa, class Stats>
PACKET_INLINE void trace_lanes(const SceneView& scene, const float* const (&component)[8],
                               std::uint32_t active_bits, Stats& stats, HitArrays<N, Isa>& out) {
    const Mask<N, Isa> asked = Mask<N, Isa>::from_bits(active_bits);
    const RayLanes<N, Isa> ray = load_rays(component, asked);
    const Mask<N, Isa> active = asked & usable(ray);
    BestHits<N, Isa> best(ray.tfar, active);
    if constexpr (walk == Walk::kPacket) {
        if (any(active)) walk_scene<query>(scene, ray, best, stats);
        store_hits(best, out);
    } else {
        store_hits(best, out);  // all miss
        if (none(active)) return;
        walk_scene_singly<query>(scene, ray, active.bits(), stats,
                                 [&](int lane, const BestHits<1, Isa>& one) {
                                     if (none(one.found())) return;
                                     out.found |= 1u << lane;
                                     out.t[lane] = one.t.r[0];
                                     out.u[lane] = one.u.r[0];
                                     out.v[lane] = one.v.r[0];
                                     out.prim_id[lane] = one.prim_id.r[0];
                                     out.instance_id[lane] = one.instance_id.r[0];
                                 });
    }
}

/// The mesh is looked up last: an instance's mesh never changes.
PACKET_INLINE std::uint32_t mesh_of(const SceneView& scene, std::int32_t instance_id) {
    return instance_id < 0 ? kInvalidId : scene.mesh_of_instance[instance_id];
}

/// Rays `begin` to `begin + lanes` of the batch, and where their results go.
PACKET_INLINE std::size_t place(const TraceBatch& batch, std::size_t i) {
    return batch.order != nullptr ? batch.order[i] : i;
}

template <int N, class Isa>
PACKET_INLINE void gather_rays(const TraceBatch& batch, std::size_t begin, int lanes,
                               RayArrays<N, Isa>& out) {
    for (int i = 0; i < lanes; ++i) {
        const Ray& ray = batch.rays[place(batch, begin + static_cast<std::size_t>(i))];
        out.component[0][i] = ray.org.x, out.component[1][i] = ray.org.y;
        out.component[2][i] = ray.org.z, out.component[3][i] = ray.tnear;
        out.component[4][i] = ray.dir.x, out.component[5][i] = ray.dir.y;
        out.component[6][i] = ray.dir.z, out.component[7][i] = ray.tfar;
    }
}

template <int N, class Isa>
PACKET_INLINE void scatter_hits(const TraceBatch& batch, std::size_t begin, int lanes,
                                const HitArrays<N, Isa>& hits) {
    for (int i = 0; i < lanes; ++i) {
        Hit& hit = batch.hits[place(batch, begin + static_cast<std::size_t>(i))];
        hit.t = hits.t[i], hit.u = hits.u[i], hit.v = hits.v[i];
        hit.prim_id = static_cast<std::uint32_t>(hits.prim_id[i]);
        hit.mesh_id = mesh_of(*batch.scene, hits.instance_id[i]);
        hit.instance_id = static_cast<std::uint32_t>(hits.instance_id[i]);
    }
}

template <Walk walk, Query query, int N, class Isa, class Stats>
void trace_batch(const TraceBatch& batch) noexcept {
    Stats stats(batch.stats);
    RayArrays<N, Isa> rays = {};
    const float* const component[8] = {rays.component[0], rays.component[1], rays.component[2],
                                       rays.component[3], rays.component[4], rays.component[5],
                                       rays.component[6], rays.component[7]};
    for (std::size_t begin = 0; begin < batch.count; begin += N) {
        const std::size_t left = batch.count - begin;
        const int lanes = left < N ? static_cast<int>(left) : N;
        gather_rays(batch, begin, lanes, rays);
        const std::uint32_t active = static_cast<std::uint32_t>((std::uint64_t{1} << lanes) - 1);
        HitArrays<N, Isa> hits;
        trace_lanes<walk, query>(*batch.scene, component, active, stats, hits);
        if constexpr (query == Query::kAny) {
            for (int i = 0; i < lanes; ++i) {
                batch.occluded[place(batch, begin + static_cast<std::size_t>(i))] =
                    hits.found >> i & 1u;
            }
        } else {
            scatter_hits(batch, begin, lanes, hits);
        }
    }
}

template <Query query, int N, class Isa>
PACKET_INLINE void trace_ray_packet(const SceneView& scene, const RayPacket<N>& rays,
                                    std::uint32_t active, HitArrays<N, Isa>& out) {
    NoCounters stats(nullptr);
    const float* const component[8] = {rays.org_x, rays.org_y, rays.org_z, rays.tnear,
                                       rays.dir_x, rays.dir_y, rays.dir_z, rays.tfar};
    trace_lanes<Walk::kPacket, query>(scene, component, active, stats, out);
}

template <int N, class Isa>
void closest_packet(const SceneView& scene, const RayPacket<N>& rays, std::uint32_t active,
                    HitPacket<N>& out) noexcept {
    HitArrays<N, Isa> hits;
    trace_ray_packet<Query::kClosest>(scene, rays, active, hits);
    for (; active != 0; active &= active - 1) {
        const int i = __builtin_ctz(active);
        out.t[i] = hits.t[i], out.u[i] = hits.u[i], out.v[i] = hits.v[i];
        out.prim_id[i] = static_cast<std::uint32_t>(hits.prim_id[i]);
        out.mesh_id[i] = mesh_of(scene, hits.instance_id[i]);
        out.instance_id[i] = static_cast<std::uint32_t>(hits.instance_id[i]);
    }
}

template <int N, class Isa>
std::uint32_t any_packet(const SceneView& scene, const RayPacket<N>& rays,
                         std::uint32_t active) noexcept {
    HitArrays<N, Isa> hits;
    trace_ray_packet<Query::kAny>(scene, rays, active, hits);
    return hits.found;
}

/// All kernels of an instruction set. Each isa_*.cpp fills one.
template <class Isa>
constexpr KernelTable make_kernel_table() {
    KernelTable table = {};
    const auto fill = [&]<Walk walk, int N>(KernelTable::Width width) {
        using KT = KernelTable;
        table.closest[width][KT::kNotCounting] =
            trace_batch<walk, Query::kClosest, N, Isa, NoCounters>;
        table.closest[width][KT::kCounting] = trace_batch<walk, Query::kClosest, N, Isa, Counters>;
        table.any[width][KT::kNotCounting] = trace_batch<walk, Query::kAny, N, Isa, NoCounters>;
        table.any[width][KT::kCounting] = trace_batch<walk, Query::kAny, N, Isa, Counters>;
    };
    fill.template operator()<Walk::kSingle, kSingleLanes>(KernelTable::kWidth1);
    fill.template operator()<Walk::kPacket, 8>(KernelTable::kWidth8);
    fill.template operator()<Walk::kPacket, 16>(KernelTable::kWidth16);
    table.closest8 = closest_packet<8, Isa>;
    table.closest16 = closest_packet<16, Isa>;
    table.any8 = any_packet<8, Isa>;
    table.any16 = any_packet<16, Isa>;
    table.overlap_axes8 = overlap_axes<8, Isa>;
    table.overlap_clip8 = overlap_clip<8, Isa>;
    return table;
}

}  // namespace packet
