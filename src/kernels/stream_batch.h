// Traces a batch in which rays of one class follow each other: each run of them, of 64 at most, is
// a stream. src/schedule/stream_order.h sorts them so. Any order is right, but slow.
#pragma once

#include "core/direction_class.h"
#include "kernels/stream_walk.h"
#include "kernels/trace_batch.h"

namespace packet {

/// How many rays from the first on are of its class.
PACKET_INLINE int class_run(const float* const* dir, int most) {
    const auto class_of = [&](int i) { return direction_class(dir[0][i], dir[1][i], dir[2][i]); };
    const int first_class = class_of(0);
    int count = 1;
    while (count < most && class_of(count) == first_class) ++count;
    return count;
}

/// Fills a stream with the first `count` rays, which are of one class.
template <class Isa>
PACKET_INLINE void load_stream(StreamRays<Isa>& out, const TreeView& tree, const RayColumns& rays,
                               int count, std::int32_t instance_id) {
    out.active = 0;
    for (int first = 0; first < count; first += kSingleLanes) {
        const LoadedRays<kSingleLanes, Isa> loaded(rays.from(first),
                                                   lanes_below<kSingleLanes>(count, first));
        out.load(tree, loaded.ray, loaded.active.bits(), first, instance_id);
    }
}

template <Query query, class Isa, class Stats>
class StreamBatch {
public:
    PACKET_INLINE StreamBatch(const TraceBatch& batch, const InstanceView& instance)
        : batch_(batch),
          tree_(*instance.tree),
          instance_id_(static_cast<std::int32_t>(instance.instance_id)),
          stats_(batch.stats),
          walk_(tree_, instance_id_, stats_) {}

    /// The rays from `begin` on.
    PACKET_INLINE void trace(std::size_t begin) {
        while (begin < batch_.count) {
            const std::size_t left = batch_.count - begin;
            const int most = left < kStreamRays ? static_cast<int>(left) : kStreamRays;
            const RayColumns columns = gather_rays(batch_, begin, most, gathered_);
            const int count = class_run(columns.component + 4, most);
            prefetch_rays(batch_, begin + static_cast<std::size_t>(count), kStreamRays);
            trace_stream(columns, begin, count);
            begin += static_cast<std::size_t>(count);
        }
    }

private:
    PACKET_INLINE void trace_stream(const RayColumns& columns, std::size_t begin, int count) {
        load_stream(rays_, tree_, columns, count, instance_id_);
        walk_.run(rays_);
        for (int i = 0; i < count; ++i) store_hits(rays_.best[i], hits_, i);
        scatter_hits<query>(batch_, begin, count, hits_);
    }

    const TraceBatch& batch_;
    const TreeView& tree_;
    std::int32_t instance_id_;
    Stats stats_;
    StreamRays<Isa> rays_;
    StreamWalk<query, Isa, Stats> walk_;
    RayArrays<kStreamRays, Isa> gathered_ = {};
    HitArrays<kStreamRays, Isa> hits_;
};

/// A scene that is one tree; others go ray by ray.
template <Query query, class Isa, class Stats>
void trace_batch_by_streams(const TraceBatch& batch) noexcept {
    const SceneView& scene = *batch.scene;
    if (scene.is_single_mesh && scene.instances[0].tree->is_tree()) {
        StreamBatch<query, Isa, Stats>(batch, scene.instances[0]).trace(0);
    } else {
        trace_batch_singly<query, Isa, Stats>(batch);
    }
}

/// Rays in the order of streams, which are often as near as those of a tile, such as shadow rays to
/// one light. Tiles as long as they find their packets full, streams from there on.
template <class Isa, class Stats>
void trace_any_by_tiles_or_streams(const TraceBatch& batch) noexcept {
    // Measured: docs/benchmarking.md#streams. So few tiles tell nothing yet.
    constexpr float kLeastUtilization = kTileLanes<Isa> == 16 ? 0.5f : 0.69f;
    constexpr std::size_t kTrialRays = 4 * kTileRays;
    const SceneView& scene = *batch.scene;
    if (!scene.is_single_mesh || !scene.instances[0].tree->is_tree()) {
        trace_batch_singly<Query::kAny, Isa, Stats>(batch);
        return;
    }
    TileBatch<Query::kAny, Isa, Stats> tiles(batch);
    std::size_t begin = 0;
    while (begin < batch.count) {
        if (begin >= kTrialRays && tiles.utilization() < kLeastUtilization) break;
        begin = tiles.trace_tile_at(begin);
    }
    if (begin < batch.count) {
        StreamBatch<Query::kAny, Isa, Stats>(batch, scene.instances[0]).trace(begin);
    }
}

}  // namespace packet
