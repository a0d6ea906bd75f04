// The order in which streams take rays that come in any: by class of direction, then along a Morton
// curve through their origins, so that neighbours go the same way through the same nodes.
#pragma once

#include "core/aligned_vector.h"
#include "kernels/kernel_table.h"
#include "schedule/parallel.h"

#include <packet/ray.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace packet {

/// Cells over where a sample of the rays starts, which may be a small part of the scene.
[[nodiscard]] OriginCells find_origin_cells(std::span<const Ray> rays);

/// Sorts rays. Keeps its memory for the next time: new memory would cost as much as the sorting.
class StreamOrder {
public:
    static constexpr std::size_t kMostRays = 16384;

    /// The indices of `rays`, kMostRays at most, in that order, until the next call. O(n) time, 9
    /// bytes a ray.
    [[nodiscard]] std::span<const std::uint32_t> sort(std::span<const Ray> rays,
                                                      KernelTable::StreamKeys find_keys);

private:
    /// By keys, one a ray in items_.
    std::span<const std::uint32_t> sort_rays();
    /// The same by runs of rays with the same key, so many.
    std::span<const std::uint32_t> sort_runs(std::size_t count);

    ScratchVector<std::uint32_t> items_, scratch_;
    ScratchVector<std::uint32_t> begins_;  ///< of runs, and the end
};

/// So many take 64 MB to sort.
inline constexpr std::size_t kMostSortedTogether = std::size_t{1} << 22;

/// As StreamOrder, of fewer than 2^32 rays, by all threads: into `out` go their indices, counted
/// from `first`. O(n) time, 16 bytes a ray.
void sort_many(std::span<const Ray> rays, KernelTable::StreamKeys find_keys,
               std::span<std::uint32_t> out, std::uint32_t first, const Parallel& parallel);

/// Lends the tasks of a call one each.
class StreamOrders {
public:
    [[nodiscard]] std::unique_ptr<StreamOrder> take();
    void give_back(std::unique_ptr<StreamOrder> order);

private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<StreamOrder>> idle_;
};

}  // namespace packet
