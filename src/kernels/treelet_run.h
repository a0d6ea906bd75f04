// Takes rays that wait at a treelet through it, by streams. Where they leave it they wait at the
// next ones, all at once: what they hit in the first of those leaves them out of others later.
// Where there is no memory left to wait in, they walk on at once, as far as there is anything: the
// answer is the same.
#pragma once

#include "kernels/stream_batch.h"

namespace packet {

/// What a stream may walk: nodes `begin` to `begin + count`. Keeps the links that lead out.
struct OneTreelet {
    static constexpr bool kTakesTurns = false;
    std::uint32_t begin = 0, count = 0xFFFFFFFF;
    TreeletExit* exits = nullptr;
    int exit_count = 0;

    PACKET_INLINE bool holds(std::uint32_t node) const { return node - begin < count; }
    PACKET_INLINE void leave(std::uint32_t node, RaySet rays, float enter) {
        exits[exit_count++] = {rays, node, enter};
    }
};

template <Query query, class Isa, class Stats>
class TreeletRun {
public:
    PACKET_INLINE TreeletRun(const TreeletBatch& batch, const InstanceView& instance)
        : batch_(batch),
          queues_(*batch.queues),
          tree_(*instance.tree),
          instance_id_(static_cast<std::int32_t>(instance.instance_id)),
          stats_(batch.rays.stats),
          walk_(tree_, stats_) {}

    PACKET_INLINE void run() {
        const std::size_t all = batch_.rays.count;
        for (std::size_t begin = 0; begin < all;) {
            const int most =
                all - begin < kStreamRays ? static_cast<int>(all - begin) : kStreamRays;
            RayColumns columns = gather_rays(batch_.rays, begin, most, gathered_);
            const int count = class_run<8, Isa>(columns.component + 4, most);
            if (batch_.best_t != nullptr) columns.component[7] = batch_.best_t + begin;
            load(columns, begin, count);
            run_stream();
            store(begin, count);
            begin += static_cast<std::size_t>(count);
        }
    }

private:
    PACKET_INLINE void load(const RayColumns& columns, std::size_t begin, int count) {
        load_stream<query>(stream_, tree_, instance_id_, columns, count);
        stats_.treelet_stream(count);
        begin_ = begin;
        if (batch_.best_t == nullptr) return;
        for (int r = 0; r < count; ++r) {
            const std::int32_t prim_id = batch_.prim_id[begin + static_cast<std::size_t>(r)];
            if (prim_id >= 0) stream_.rays.set_prim_id(r, prim_id);
        }
    }

    PACKET_INLINE void run_stream() {
        const std::uint32_t root = tree_.treelet_begin[batch_.treelet];
        OneTreelet part{root, tree_.treelet_begin[batch_.treelet + 1] - root, batch_.exits};
        walk_.walk(stream_, root, stream_.rays.active, part);
        for (int e = 0; e < part.exit_count; ++e) enqueue(batch_.exits[e]);
    }

    /// Without regard to treelets.
    PACKET_NOINLINE void walk_all(std::uint32_t node, RaySet rays) {
        OneTreelet whole;
        walk_.walk(stream_, node, rays, whole);
    }

    /// Rays wait at a treelet that is not behind what they have hit.
    PACKET_INLINE void enqueue(const TreeletExit& exit) {
        const std::uint32_t treelet = tree_.treelet_of_node[exit.node];
        QueueTail& tail = queues_.tails[treelet];
        for (RaySet left = exit.rays & stream_.looking; left != 0; left &= left - 1) {
            const int r = __builtin_ctzll(left);
            if (query == Query::kClosest && exit.enter > stream_.rays.ray[r].best_t) continue;
            if (tail.next == tail.end && !queues_.add_chunk(queues_, treelet)) {
                walk_all(exit.node, left);
                return;
            }
            const std::size_t at = begin_ + static_cast<std::size_t>(r);
            queues_.slots[tail.next++] = {batch_.rays.order[at], exit.enter};
        }
    }

    PACKET_INLINE void write_hit(int r, Hit& out) const {
        constexpr int N = kPacketLanes<Isa>;
        const BestHits<N, Isa>& best = stream_.rays.best[r / N];
        out.t = lane_of(best.t, r % N);
        out.u = lane_of(best.u, r % N), out.v = lane_of(best.v, r % N);
        out.prim_id = static_cast<std::uint32_t>(stream_.rays.prim_id(r));
        out.mesh_id = mesh_of(*batch_.rays.scene, instance_id_);
        out.instance_id = static_cast<std::uint32_t>(instance_id_);
    }

    /// Where rays have found something, or something nearer.
    PACKET_INLINE void store(std::size_t begin, int count) {
        if constexpr (query == Query::kAny) {
            for (RaySet left = stream_.rays.active & ~stream_.looking; left != 0;
                 left &= left - 1) {
                batch_.rays.occluded[batch_.rays.order[begin + lowest(left)]] = 1;
            }
            return;
        }
        for (int r = 0; r < count; ++r) {
            const std::size_t at = begin + static_cast<std::size_t>(r);
            const std::int32_t had = batch_.best_t != nullptr ? batch_.prim_id[at] : -1;
            const std::int32_t has = stream_.rays.prim_id(r);
            if (has != kNoId && has != had) write_hit(r, batch_.rays.hits[batch_.rays.order[at]]);
        }
    }
    PACKET_INLINE static std::size_t lowest(RaySet rays) {
        return static_cast<std::size_t>(__builtin_ctzll(rays));
    }

    const TreeletBatch& batch_;
    TreeletQueues& queues_;
    const TreeView& tree_;
    std::int32_t instance_id_;
    Stats stats_;
    Stream<Isa> stream_;
    std::size_t begin_ = 0;  ///< of the stream in the batch
    StreamWalk<query, Isa, Stats> walk_;
    RayArrays<kStreamRays, Isa> gathered_ = {};
};

/// Of a scene that is one tree, cut into treelets.
template <Query query, class Isa, class Stats>
void run_treelet(const TreeletBatch& batch) noexcept {
    TreeletRun<query, Isa, Stats>(batch, batch.rays.scene->instances[0]).run();
}

}  // namespace packet
