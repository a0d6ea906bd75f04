// Traces incoherent rays in scenes far larger than the cache. Rays that go one way sweep over the
// treelets of the tree once, each after the one above it, the near ones first: all that meet a
// treelet go through it together, so that it is fetched once for all of them, ahead and as a whole.
// A ray waits at all treelets that it enters below the one it has gone through, by 8 bytes each,
// and those that lie behind what it has hit by their turn are left out. Pharr and others send a ray
// to one treelet at a time, the nearest, and go on where most rays wait: nothing is met in vain
// then, but each treelet is fetched five to ten times (docs/experiments.md#treelets).
//
// Pharr, Kolb, Gershbein, Hanrahan. Rendering complex scenes with memory-coherent ray tracing.
// SIGGRAPH 1997. Aila, Karras. Architecture considerations for tracing incoherent rays.
// High-Performance Graphics 2010.
#pragma once

#include "core/aligned_vector.h"
#include "kernels/kernel_table.h"
#include "schedule/parallel.h"
#include "schedule/treelet_queues.h"

#include <packet/hit.h>
#include <packet/ray.h>
#include <packet/trace.h>

#include <span>
#include <vector>

namespace packet {

/// What the threads of a call have in common.
struct TreeletJob {
    TraceBatch batch;  ///< fewer than 2^32 rays, in any order
    KernelTable::Treelet kernel;
    std::size_t queue_bytes;  ///< for each thread
    std::uint32_t chunk;
};

/// Of `rays` sorted by class, how many sweep together: as many as it takes for fetching all of the
/// tree to cost little for each, so that the others, which go another way, sweep in another order;
/// and so that all threads have as much to do.
[[nodiscard]] std::size_t rays_per_sweep(std::size_t rays, std::size_t tree_bytes,
                                         int threads) noexcept;
/// Whether `Mode::kAuto` traces scattered rays so, not by streams: if the tree is beyond the
/// cache, rays meet much of it, and each sweep has rays enough to pay for fetching it.
[[nodiscard]] bool sweeps_beat_streams(std::size_t rays, std::size_t tree_bytes, double sah_cost,
                                       int threads) noexcept;

/// One thread's sweeps.
class TreeletSweep {
public:
    explicit TreeletSweep(const TreeletJob& job);

    /// Traces the rays whose indices in the job's batch these are, those of a class in a row:
    /// `share` of what progress is told of.
    void run(std::span<const std::uint32_t> order, const Parallel& parallel, double share);
    [[nodiscard]] const TraceStats& stats() const noexcept { return stats_; }

private:
    static constexpr std::size_t kRunRays = 8192;

    void load(std::span<const std::uint32_t> order);
    void enter_root(const Parallel& parallel);
    [[nodiscard]] glm::vec3 direction() const;
    void store(std::span<const std::uint32_t> order) const;
    void run_queue(std::uint32_t treelet);
    void take(std::span<const QueuedRay> waiting);
    void run_taken(std::uint32_t treelet);
    [[nodiscard]] TreeletBatch batch();
    void fetch(std::uint32_t treelet) const;
    void count_load(std::uint32_t treelet);
    [[nodiscard]] bool is_closest() const { return job_.batch.hits != nullptr; }

    const TreeletJob& job_;
    const TreeView& tree_;
    TreeletQueuePool pool_;
    // Of the rays that sweep, in their order: there neighbours share lines.
    ScratchVector<Ray> rays_;
    ScratchVector<Hit> hits_;
    ScratchVector<std::uint8_t> occluded_;
    // Of those that go through a treelet next.
    std::size_t taken_count_ = 0;
    std::vector<std::uint32_t> taken_;
    std::vector<float> best_t_;
    std::vector<std::int32_t> prim_id_;
    std::vector<TreeletExit> exits_;
    TraceStats stats_;
};

}  // namespace packet
