// Rays cut into tasks: an image's into square tiles, others into runs.
#pragma once

#include "kernels/kernel_table.h"
#include "schedule/pixel_order.h"
#include "schedule/stream_order.h"

#include <packet/ray.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <span>

namespace packet {

// Fewer, of 24 classes, make streams of few rays: docs/experiments.md#streams.
inline constexpr std::size_t kLeastRaysForStreams = 1024;

/// Rays of a task of streams. The more are sorted together, the more come together at a node; but
/// they are to stay in the second level's cache, and several threads are to have several tasks.
[[nodiscard]] std::size_t rays_per_stream_task(std::size_t rays, int threads) noexcept;

class RayTasks {
public:
    /// Tiles of an image, or runs.
    RayTasks(std::span<const Ray> rays, const PixelLayout& image)
        : rays_(rays), image_(rays.size(), image) {}
    /// Runs that are sorted, as streams need them.
    [[nodiscard]] static RayTasks sorted(std::span<const Ray> rays, int threads,
                                         KernelTable::StreamKeys find_keys);
    /// Sorts the rays of all runs, fewer than 2^32, together, but millions at a time, by all
    /// threads. 4 bytes a ray, and while it sorts 64 MB.
    void sort_together(const Parallel& parallel);

    [[nodiscard]] std::size_t count() const;
    /// Calls trace(batch) with the rays of a task. `batch` says where results go, for all rays.
    void run(std::size_t task, TraceBatch batch,
             const std::function<void(const TraceBatch&)>& trace) const;

private:
    // Some 100 us of work, so that tasks are cheap and cores end together.
    static constexpr std::size_t kRaysPerTask = 512;

    std::span<const Ray> rays_;
    PixelOrder image_;
    std::size_t run_length_ = kRaysPerTask;
    KernelTable::StreamKeys find_keys_ = nullptr;
    std::unique_ptr<StreamOrders> orders_;  ///< if each run is sorted
    ScratchVector<std::uint32_t> order_;    ///< if all are
};

}  // namespace packet
