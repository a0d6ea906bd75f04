// Traces incoherent rays in scenes far larger than the cache: a ray goes through one treelet, then
// waits at the next one that it enters until many do, so that a treelet's nodes are fetched once
// for all of them. The treelet where most rays wait is gone through first. What a ray needs while
// it waits is 16 bytes, and 16 for each treelet that it may enter later; what it has hit so far
// lies where its result goes.
//
// Pharr, Kolb, Gershbein, Hanrahan. Rendering complex scenes with memory-coherent ray tracing.
// SIGGRAPH 1997. Aila, Karras. Architecture considerations for tracing incoherent rays.
// High-Performance Graphics 2010.
#pragma once

#include "kernels/kernel_table.h"

#include "core/aligned_vector.h"

#include <packet/bounds.h>
#include <packet/trace.h>

#include <span>
#include <vector>

namespace packet {

/// Memory for rays that wait: slots in chunks of one size, each part of a queue or a store of
/// records of what rays enter later. Never grows.
class TreeletQueuePool : public TreeletQueues {
public:
    /// `bytes` at most, in chunks of `chunk_slots`; queues for so many treelets.
    TreeletQueuePool(std::size_t bytes, std::uint32_t chunk_slots, std::uint32_t treelet_count);
    TreeletQueuePool(const TreeletQueuePool&) = delete;
    TreeletQueuePool& operator=(const TreeletQueuePool&) = delete;

    /// Whether half of all chunks are free: then new rays may start.
    [[nodiscard]] bool has_room() const noexcept { return 2 * free_count_ > next_chunk_.size(); }
    /// The treelet at which most rays wait; kNoSlot if none waits. O(treelets)
    [[nodiscard]] std::uint32_t fullest() const noexcept;
    [[nodiscard]] std::uint32_t waiting(std::uint32_t treelet) const noexcept;
    /// Hands up to out.size() of a treelet's waiting rays over, chunk by chunk, and returns their
    /// number. There must be room for a chunk.
    std::size_t take(std::uint32_t treelet, std::span<QueuedRay> out) noexcept;
    [[nodiscard]] std::size_t waiting_in_all() const noexcept;

private:
    /// Chunks of a queue, the one that is filled first. All others are full.
    struct Queue {
        std::uint32_t first_chunk = kNoSlot;
        std::uint32_t chunk_count = 0;
    };
    static bool add_chunk_to_queue(TreeletQueues& self, std::uint32_t treelet) noexcept;
    static bool add_chunk_of_pending(TreeletQueues& self) noexcept;
    [[nodiscard]] std::uint32_t allocate() noexcept;

    std::uint32_t chunk_slots_;
    ScratchVector<QueueSlot> memory_;
    ScratchVector<std::uint32_t> next_chunk_;  ///< of a queue, or of free ones
    std::uint32_t first_free_ = kNoSlot;
    std::size_t free_count_ = 0, pending_chunks_ = 0;
    std::vector<Queue> queues_;
    std::vector<QueueTail> tail_store_;
};

/// What the threads of a call have in common.
struct TreeletJob {
    TraceBatch batch;  ///< all rays, fewer than 2^32
    KernelTable::Treelet kernel;
    std::size_t queue_bytes;  ///< for each thread
    std::uint32_t chunk;
    const std::uint32_t* order;  ///< in which they start, as that of streams
    std::size_t rays_per_start;
};

/// One thread's queues. Several may trace one call's rays, each some of them.
class TreeletScheduler {
public:
    explicit TreeletScheduler(const TreeletJob& job);

    /// Takes `count` rays from `begin` of the job's order on through the root's treelet.
    void start(std::size_t begin, std::size_t count);
    /// Whether to start() rays rather than to run().
    [[nodiscard]] bool has_room() const noexcept { return pool_.has_room(); }
    /// Takes the rays of the fullest queue through their treelet; false if none waits.
    bool run();
    [[nodiscard]] const TraceStats& stats() const noexcept { return stats_; }

private:
    static constexpr std::size_t kRunRays = 8192;
    static constexpr std::size_t kPadding = 8;

    void run_some(std::uint32_t treelet, std::size_t count);
    void count_load(std::uint32_t treelet);

    const TreeletJob& job_;
    const TreeView& tree_;
    TreeletQueuePool pool_;
    ScratchVector<QueuedRay> taken_;
    std::vector<std::uint8_t> class_of_;
    std::vector<std::uint32_t> rays_, pending_;
    std::vector<float> best_t_;
    std::vector<std::int32_t> prim_id_;
    std::vector<TreeletExit> exits_;
    std::vector<std::uint64_t> treelet_bytes_;  ///< if work is counted
    TraceStats stats_;
};

}  // namespace packet
