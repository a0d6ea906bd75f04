// Takes rays that wait at a treelet through it, by streams. A ray that has left it goes on to the
// nearest treelet that it has met and not entered, here or before, and waits there. Where there is
// no memory left to wait in, it walks on at once, as far as there is anything: the answer is the
// same.
#pragma once

#include "kernels/stream_batch.h"

namespace packet {

/// What a stream may walk: nodes `begin` to `begin + count`. Keeps the links that lead out.
struct OneTreelet {
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
          walk_(tree_, instance_id_, stats_) {
        for (int r = 0; r < kStreamRays; ++r) pending_[r] = kNoSlot;
    }

    PACKET_INLINE void run() {
        const std::size_t all = batch_.rays.count;
        for (std::size_t begin = 0; begin < all;) {
            const int most =
                all - begin < kStreamRays ? static_cast<int>(all - begin) : kStreamRays;
            RayColumns columns = gather_rays(batch_.rays, begin, most, gathered_);
            const int count = class_run(columns.component + 4, most);
            if (batch_.best_t != nullptr) columns.component[7] = batch_.best_t + begin;
            load(columns, begin, count);
            run_stream();
            store(begin, count);
            begin += static_cast<std::size_t>(count);
        }
    }

private:
    PACKET_INLINE void load(const RayColumns& columns, std::size_t begin, int count) {
        load_stream(stream_, tree_, columns, count, instance_id_);
        stats_.treelet_stream(count);
        for (int r = 0; r < count; ++r) {
            ray_[r] = batch_.rays.order[begin + static_cast<std::size_t>(r)];
        }
        if (batch_.best_t == nullptr) return;
        for (int r = 0; r < count; ++r) {
            const std::size_t at = begin + static_cast<std::size_t>(r);
            pending_[r] = batch_.pending[at];
            // Needed once the ray has left, and anywhere in memory.
            if (pending_[r] != kNoSlot) __builtin_prefetch(queues_.slots + pending_[r], 1);
            if (batch_.prim_id[at] < 0) continue;
            stream_.rays.best[r].prim_id = batch_.prim_id[at];
            stream_.rays.best[r].tie_prim_id = batch_.prim_id[at];
            stream_.rays.best[r].instance_id = instance_id_;
        }
    }

    PACKET_INLINE void run_stream() {
        const std::uint32_t root = tree_.treelet_begin[batch_.treelet];
        OneTreelet part{root, tree_.treelet_begin[batch_.treelet + 1] - root, batch_.exits};
        walk_.walk(stream_, root, stream_.rays.active, part);
        std::uint32_t exits = 0;
        for (int e = 0; e < part.exit_count; ++e) {
            exits += static_cast<std::uint32_t>(__builtin_popcountll(batch_.exits[e].rays));
        }
        if (reserve(exits)) {
            // The last one first, so that each ray has the nearest on top.
            for (int e = part.exit_count; e-- > 0;) postpone(batch_.exits[e]);
        } else {
            for (int e = 0; e < part.exit_count; ++e) {
                walk_all(batch_.exits[e].node, batch_.exits[e].rays);
            }
        }
        for (RaySet left = stream_.rays.active; left != 0; left &= left - 1) {
            go_on(__builtin_ctzll(left));
        }
    }

    /// Without regard to treelets.
    PACKET_NOINLINE void walk_all(std::uint32_t node, RaySet rays) {
        OneTreelet whole;
        walk_.walk(stream_, node, rays, whole);
    }

    PACKET_INLINE bool reserve(std::uint32_t slots) {
        while (queues_.free_pending_count < slots) {
            if (!queues_.add_pending(queues_)) return false;
        }
        return true;
    }

    /// Notes what rays enter later, if it is not behind what they have hit.
    PACKET_INLINE void postpone(const TreeletExit& exit) {
        const std::uint32_t treelet = tree_.treelet_of_node[exit.node];
        for (RaySet left = exit.rays & stream_.looking; left != 0; left &= left - 1) {
            const int r = __builtin_ctzll(left);
            if (query == Query::kClosest && exit.enter > stream_.rays.ray[r].best_t) continue;
            const std::uint32_t slot = queues_.free_pending;
            PendingTreelet& record = queues_.slots[slot].pending;
            queues_.free_pending = record.next;
            --queues_.free_pending_count;
            record.treelet = treelet;
            record.enter = exit.enter;
            record.next = pending_[r];
            pending_[r] = slot;
        }
    }

    /// To the treelet that the ray enters next, if there is one.
    PACKET_INLINE void go_on(int r) {
        while (pending_[r] != kNoSlot) {
            const std::uint32_t slot = pending_[r];
            PendingTreelet& record = queues_.slots[slot].pending;
            const PendingTreelet next = record;
            pending_[r] = next.next;
            record.next = queues_.free_pending;
            queues_.free_pending = slot;
            ++queues_.free_pending_count;
            const bool looks = (stream_.looking >> r & 1u) != 0;
            if (!looks || (query == Query::kClosest && next.enter > stream_.rays.ray[r].best_t))
                continue;
            if (wait(r, next.treelet)) return;
            walk_all(tree_.treelet_begin[next.treelet], RaySet{1} << r);
        }
    }

    PACKET_INLINE bool wait(int r, std::uint32_t treelet) {
        QueueTail& tail = queues_.tails[treelet];
        if (tail.next == tail.end && !queues_.add_to_queue(queues_, treelet)) return false;
        const std::int32_t prim_id = stream_.rays.best[r].prim_id.r[0];
        QueuedRay& out = queues_.slots[tail.next++].ray;
        out.ray = ray_[r];
        out.pending = pending_[r];
        out.best_t = stream_.rays.ray[r].best_t;
        out.prim_id = prim_id == kNoId ? -1 : prim_id;
        pending_[r] = kNoSlot;
        return true;
    }

    /// Where rays have found something, or something nearer.
    PACKET_INLINE void store(std::size_t begin, int count) {
        for (int r = 0; r < count; ++r) {
            const std::size_t at = begin + static_cast<std::size_t>(r);
            const std::int32_t had = batch_.best_t != nullptr ? batch_.prim_id[at] : -1;
            const std::int32_t has = stream_.rays.best[r].prim_id.r[0];
            if (has == kNoId || has == had) continue;
            if constexpr (query == Query::kAny) {
                batch_.rays.occluded[place(batch_.rays, at)] = 1;
            } else {
                store_hits(stream_.rays.best[r], hits_, r);
                scatter_hit(*batch_.rays.scene, hits_, r, batch_.rays.hits[place(batch_.rays, at)]);
            }
        }
    }

    const TreeletBatch& batch_;
    TreeletQueues& queues_;
    const TreeView& tree_;
    std::int32_t instance_id_;
    Stats stats_;
    Stream<Isa> stream_;
    std::uint32_t pending_[kStreamRays];
    std::uint32_t ray_[kStreamRays];
    StreamWalk<query, Isa, Stats> walk_;
    RayArrays<kStreamRays, Isa> gathered_ = {};
    HitArrays<kStreamRays, Isa> hits_;
};

/// Of a scene that is one tree, cut into treelets.
template <Query query, class Isa, class Stats>
void run_treelet(const TreeletBatch& batch) noexcept {
    TreeletRun<query, Isa, Stats>(batch, batch.rays.scene->instances[0]).run();
}

}  // namespace packet
