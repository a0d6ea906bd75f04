// Traces a batch in which rays of one class follow each other: each run of them, of 64 at most, is
// a stream. src/schedule/stream_order.h sorts them so. Any order is right, but slow.
#pragma once

#include "kernels/stream_walk.h"
#include "kernels/trace_batch.h"

namespace packet {

/// Fills a stream with the first `count` rays, which are of one class.
template <Query query, class Isa>
PACKET_INLINE void load_stream(Stream<Isa>& out, const TreeView& tree, std::int32_t instance_id,
                               const RayColumns& rays, int count) {
    constexpr int N = kPacketLanes<Isa>;
    out.rays.active = 0;
    int p = 0;
    for (; p * N < count; ++p) {
        const LoadedRays<N, Isa> loaded(rays.from(p * N), lanes_below<N>(count, p * N));
        out.rays.load(p, tree, loaded.ray, loaded.active, instance_id);
    }
    if constexpr (query == Query::kAny) out.rays.bound(p);
    out.looking = out.rays.active;
}

/// Streams that take steps in turn: what one of them fetches arrives while the others walk.
/// Measured: docs/experiments.md#streams.
inline constexpr int kStreamsInTurn = 8;

template <Query query, class Isa, class Stats>
class StreamBatch {
public:
    PACKET_INLINE StreamBatch(const TraceBatch& batch, const InstanceView& instance)
        : batch_(batch),
          tree_(*instance.tree),
          instance_id_(static_cast<std::int32_t>(instance.instance_id)),
          stats_(batch.stats),
          walk_(tree_, stats_) {}

    PACKET_INLINE void trace() {
        int walking = 0;
        for (Turn& turn : turns_) walking += start(turn) ? 1 : 0;
        WholeTree all;
        while (walking != 0) {
            for (Turn& turn : turns_) {
                if (turn.count == 0 || walk_.step(turn.stream, all)) continue;
                finish(turn);
                if (!start(turn)) --walking;
            }
        }
    }

private:
    /// A stream, and which rays it has: `count` from `begin` on.
    struct Turn {
        Stream<Isa> stream;
        std::size_t begin = 0;
        int count = 0;
    };

    /// The next rays' stream; false if there are none left.
    PACKET_INLINE bool start(Turn& turn) {
        turn.begin = next_;
        turn.count = 0;
        if (next_ >= batch_.count) return false;
        const std::size_t left = batch_.count - next_;
        const int most = left < kStreamRays ? static_cast<int>(left) : kStreamRays;
        const RayColumns columns = gather_rays(batch_, next_, most, gathered_);
        turn.count = class_run<8, Isa>(columns.component + 4, most);
        next_ += static_cast<std::size_t>(turn.count);
        prefetch_rays(batch_, next_, kStreamRays);
        load_stream<query>(turn.stream, tree_, instance_id_, columns, turn.count);
        walk_.start(turn.stream, 0, turn.stream.looking, WholeTree());
        return true;
    }
    PACKET_INLINE void finish(const Turn& turn) {
        if constexpr (query == Query::kAny) {
            const RaySet occluded = turn.stream.rays.active & ~turn.stream.looking;
            for (int i = 0; i < turn.count; ++i) {
                const std::size_t at = place(batch_, turn.begin + static_cast<std::size_t>(i));
                batch_.occluded[at] = static_cast<std::uint8_t>(occluded >> i & 1u);
            }
        } else {
            constexpr int N = kPacketLanes<Isa>;
            for (int p = 0; p * N < turn.count; ++p) {
                store_hits(turn.stream.rays.best[p], hits_, p * N);
            }
            scatter_hits<query>(batch_, turn.begin, turn.count, hits_);
        }
    }

    const TraceBatch& batch_;
    const TreeView& tree_;
    std::int32_t instance_id_;
    Stats stats_;
    StreamWalk<query, Isa, Stats> walk_;
    std::size_t next_ = 0;  ///< the first ray that is in no stream yet
    Turn turns_[kStreamsInTurn];
    RayArrays<kStreamRays, Isa> gathered_ = {};
    HitArrays<kStreamRays, Isa> hits_;
};

/// A scene that is one tree; others go ray by ray.
template <Query query, class Isa, class Stats>
void trace_batch_by_streams(const TraceBatch& batch) noexcept {
    const SceneView& scene = *batch.scene;
    if (scene.is_single_mesh && scene.instances[0].tree->is_tree()) {
        StreamBatch<query, Isa, Stats>(batch, scene.instances[0]).trace();
    } else {
        trace_batch_singly<query, Isa, Stats>(batch);
    }
}

}  // namespace packet
