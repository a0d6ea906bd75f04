// From rays in memory to hits in memory: fills packets, walks the scene, writes what was found.
#pragma once

#include "kernels/counters.h"
#include "kernels/direction_class.h"
#include "kernels/ray_columns.h"
#include "kernels/tile_scene_walk.h"

namespace packet {

/// All lanes of N.
template <int N>
inline constexpr std::uint32_t kAllLanes = static_cast<std::uint32_t>((std::uint64_t{1} << N) - 1);

/// Loads the lanes that are asked for; the others become NaN, which takes part in nothing.
template <int N, class Isa>
PACKET_INLINE RayLanes<N, Isa> load_rays(const RayColumns& rays, std::uint32_t asked) {
    using F = Float<N, Isa>;
    const auto rays_of = [&](auto&& lanes_of) -> RayLanes<N, Isa> {
        return {{lanes_of(0), lanes_of(1), lanes_of(2)},
                {lanes_of(4), lanes_of(5), lanes_of(6)},
                max(F(-kLargestFloat), lanes_of(3)),  // NaN stays NaN
                lanes_of(7)};
    };
    if (asked == kAllLanes<N>) [[likely]]
        return rays_of([&](int i) { return F::load(rays.component[i]); });
    const auto active = Mask<N, Isa>::from_bits(asked);
    const F nan(__builtin_nanf(""));
    return rays_of([&](int i) { return select(active, F::load(rays.component[i]), nan); });
}

template <int N, class Isa, int kCount>
PACKET_INLINE void store_hits(const BestHits<N, Isa>& best, HitArrays<kCount, Isa>& out,
                              int first) {
    using F = Float<N, Isa>;
    const Mask<N, Isa> found = best.found();
    select(found, best.t, F(__builtin_huge_valf())).store(out.t + first);
    best.u.store(out.u + first);
    best.v.store(out.v + first);
    select(found, best.prim_id, Int<N, Isa>(-1)).store(out.prim_id + first);
    select(found, best.instance_id, Int<N, Isa>(-1)).store(out.instance_id + first);
}

/// The rays of a packet that are asked for and can hit anything.
template <int N, class Isa>
struct LoadedRays {
    RayLanes<N, Isa> ray;
    Mask<N, Isa> active;

    PACKET_INLINE LoadedRays(const RayColumns& rays, std::uint32_t asked)
        : ray(load_rays<N, Isa>(rays, asked)), active(usable(ray)) {}
};

template <Query query, int N, class Isa, int kCount, class Stats>
PACKET_INLINE void trace_packet(const SceneView& scene, const RayColumns& rays, std::uint32_t asked,
                                Stats& stats, HitArrays<kCount, Isa>& out, int first) {
    const LoadedRays<N, Isa> loaded(rays.from(first), asked);
    BestHits<N, Isa> best(loaded.ray.tfar, loaded.active);
    if (any(loaded.active)) walk_scene<query>(scene, loaded.ray, best, stats);
    store_hits(best, out, first);
}

/// The lanes of N that are among the first `count`, counted from lane `first`.
template <int N>
PACKET_INLINE std::uint32_t lanes_below(int count, int first) {
    const int lanes = count - first;
    return lanes <= 0 ? 0u : lanes < N ? (1u << lanes) - 1 : kAllLanes<N>;
}

/// False, with nothing traced, if the rays do not share their directions.
template <Query query, int N, class Isa, class Stats>
PACKET_INLINE bool trace_tile(const SceneView& scene, const RayColumns& rays, int count,
                              Stats& stats, HitArrays<kTileRays, Isa>& out) {
    const TreeView& tree = *scene.instances[0].tree;
    const auto instance_id = static_cast<std::int32_t>(scene.instances[0].instance_id);
    PreparedRays<N, Isa> prepared[kTilePackets<N>];
    BestHits<N, Isa> best[kTilePackets<N>];
    std::uint32_t active = 0;
    for (int p = 0; p * N < count; ++p) {
        const LoadedRays<N, Isa> loaded(rays.from(p * N), lanes_below<N>(count, p * N));
        best[p].reset(loaded.ray.tfar, loaded.active);
        if (none(loaded.active)) continue;
        active |= 1u << p;
        best[p].enter_instance(instance_id);
        prepare(prepared[p], tree, loaded.ray, loaded.active.bits());
        if (!share_directions(prepared[__builtin_ctz(active)], prepared[p])) return false;
    }
    std::uint32_t done = 0;  // the packets whose hits are in `out`
    const auto alone = [&](int p) {
        done |= 1u << p;
        trace_packet<query, N>(scene, rays, lanes_below<N>(count, p * N), stats, out, p * N);
    };
    TileTracer<query, N, Isa, Stats, decltype(alone)> tracer{tree,   instance_id, prepared, best,
                                                             active, stats,       alone};
    tracer.trace(0, kTilePackets<N>);
    for (int p = 0; p * N < count; ++p) {
        if ((done >> p & 1u) == 0) store_hits(best[p], out, p * N);
    }
    return true;
}

/// How the rays of a batch are traced: `kCount` at a time, by trace(rays, count, out).
template <Query query, int kCount, class Isa, class Trace>
PACKET_INLINE void trace_by(const TraceBatch& batch, Trace&& trace) {
    RayArrays<kCount, Isa> rays = {};
    HitArrays<kCount, Isa> hits;
    for (std::size_t begin = 0; begin < batch.count; begin += kCount) {
        const std::size_t left = batch.count - begin;
        const int count = left < kCount ? static_cast<int>(left) : kCount;
        const RayColumns columns = gather_rays(batch, begin, count, rays);
        prefetch_rays(batch, begin + static_cast<std::size_t>(count), kCount);
        trace(columns, count, hits);
        scatter_hits<query>(batch, begin, count, hits);
    }
}

/// One ray, which need not be gathered, nor its hit scattered.
template <Query query, class Isa, class Stats>
PACKET_INLINE BestHits<1, Isa> trace_singly(const SceneView& scene, const Ray& ray, Stats& stats) {
    const RayAxes<Isa> world(ray);
    const bool is_usable = usable(world);
    BestHits<1, Isa> best(world.tfar, Mask<1, Isa>::from_bits(is_usable ? 1 : 0));
    const TreeView& tree = first_tree(scene);
    if (!is_usable || tree.is_empty()) return best;
    SingleRay prepared;
    prepare(prepared, tree, world);
    walk_scene_singly<query>(scene, world, prepared, best, stats);
    return best;
}

/// `out` is a miss.
template <class Isa>
PACKET_INLINE void store_hit(const SceneView& scene, const BestHits<1, Isa>& best, Hit& out) {
    if (none(best.found())) return;
    out.t = best.t.r[0], out.u = best.u.r[0], out.v = best.v.r[0];
    out.prim_id = static_cast<std::uint32_t>(best.prim_id.r[0]);
    out.mesh_id = mesh_of(scene, best.instance_id.r[0]);
    out.instance_id = static_cast<std::uint32_t>(best.instance_id.r[0]);
}

template <class Isa>
void closest_ray(const SceneView& scene, const Ray& ray, Hit& out) noexcept {
    NoCounters stats(nullptr);
    store_hit(scene, trace_singly<Query::kClosest, Isa>(scene, ray, stats), out);
}

template <class Isa>
bool any_ray(const SceneView& scene, const Ray& ray) noexcept {
    NoCounters stats(nullptr);
    return any(trace_singly<Query::kAny, Isa>(scene, ray, stats).found());
}

template <Query query, class Isa, class Stats>
void trace_batch_singly(const TraceBatch& batch) noexcept {
    Stats stats(batch.stats);
    for (std::size_t i = 0; i < batch.count; ++i) {
        const std::size_t at = place(batch, i);
        const auto best = trace_singly<query, Isa>(*batch.scene, batch.rays[at], stats);
        if constexpr (query == Query::kAny) {
            batch.occluded[at] = any(best.found());
        } else {
            Hit& out = batch.hits[at];
            out.t = __builtin_huge_valf(), out.u = out.v = 0.0f;
            out.prim_id = out.mesh_id = out.instance_id = kInvalidId;
            store_hit(*batch.scene, best, out);
        }
    }
}

template <Query query, int N, class Isa, class Stats>
void trace_batch_by_packets(const TraceBatch& batch) noexcept {
    Stats stats(batch.stats);
    trace_by<query, N, Isa>(batch, [&](const RayColumns& rays, int count, auto& out) {
        trace_packet<query, N>(*batch.scene, rays, lanes_below<N>(count, 0), stats, out, 0);
    });
}

/// A batch whose scene is one tree, a tile's rays at a time.
template <Query query, class Isa, class Stats>
class TileBatch {
public:
    PACKET_INLINE explicit TileBatch(const TraceBatch& batch)
        : batch_(batch), stats_(batch.stats) {}

    PACKET_INLINE void trace() {
        for (std::size_t begin = 0; begin < batch_.count; begin += kTileRays) {
            const std::size_t left = batch_.count - begin;
            trace_rays(begin, left < kTileRays ? static_cast<int>(left) : kTileRays);
        }
    }

private:
    static constexpr int N = kPacketLanes<Isa>;

    PACKET_INLINE void trace_rays(std::size_t begin, int count) {
        const RayColumns columns = gather_rays(batch_, begin, count, rays_);
        prefetch_rays(batch_, begin + static_cast<std::size_t>(count), kTileRays);
        if (trace_tile<query, N>(*batch_.scene, columns, count, stats_, hits_)) {
            scatter_hits<query>(batch_, begin, count, hits_);
            return;
        }
        const ClassRuns<kTileRays> runs(columns.component + 4, count);
        if (runs.used > kMostClasses) {
            trace_packets(batch_, begin, columns, count);
        } else {
            trace_runs(begin, runs);
        }
    }
    PACKET_INLINE void trace_packets(const TraceBatch& batch, std::size_t begin,
                                     const RayColumns& columns, int count) {
        for (int first = 0; first < count; first += N) {
            trace_packet<query, N>(*batch.scene, columns, lanes_below<N>(count, first), stats_,
                                   hits_, first);
        }
        scatter_hits<query>(batch, begin, count, hits_);
    }

    /// The rays of each class are a tile.
    PACKET_INLINE void trace_runs(std::size_t begin, const ClassRuns<kTileRays>& runs) {
        std::uint32_t order[kTileRays];
        for (int i = 0; i < runs.begin[kDirectionClasses]; ++i) {
            order[i] = static_cast<std::uint32_t>(place(batch_, begin + runs.ray[i]));
        }
        for (int c = 0; c < kDirectionClasses; ++c) {
            const int count = runs.begin[c + 1] - runs.begin[c];
            if (count == 0) continue;
            TraceBatch run = batch_;
            run.order = order + runs.begin[c];
            run.row_bits = 0;
            const RayColumns columns = gather_rays(run, 0, count, rays_);
            // Rays of one class share their directions, unless the caller's thread flushes the
            // reciprocals of huge ones to zero.
            if (trace_tile<query, N>(*batch_.scene, columns, count, stats_, hits_)) [[likely]] {
                scatter_hits<query>(run, 0, count, hits_);
            } else {
                trace_packets(run, 0, columns, count);
            }
        }
    }

    const TraceBatch& batch_;
    Stats stats_;
    RayArrays<kTileRays, Isa> rays_ = {};
    HitArrays<kTileRays, Isa> hits_;
};

template <Query query, class Isa, class Stats>
void trace_batch_by_tiles(const TraceBatch& batch) noexcept {
    const SceneView& scene = *batch.scene;
    if (scene.is_single_mesh && scene.instances[0].tree->is_tree()) {
        TileBatch<query, Isa, Stats>(batch).trace();
    } else {
        trace_batch_by_packets<query, kPacketLanes<Isa>, Isa, Stats>(batch);
    }
}

template <Query query, int N, class Isa>
PACKET_INLINE void trace_ray_packet(const SceneView& scene, const RayPacket<N>& rays,
                                    std::uint32_t active, HitArrays<N, Isa>& out) {
    NoCounters stats(nullptr);
    const RayColumns columns = {{rays.org_x, rays.org_y, rays.org_z, rays.tnear, rays.dir_x,
                                 rays.dir_y, rays.dir_z, rays.tfar}};
    trace_packet<query, N>(scene, columns, active, stats, out, 0);
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
    std::uint32_t found = 0;
    for (; active != 0; active &= active - 1) {
        const int i = __builtin_ctz(active);
        found |= (hits.prim_id[i] >= 0 ? 1u : 0u) << i;
    }
    return found;
}

}  // namespace packet
