// The order in which streams take rays that come in any: by class of direction, then along a Morton
// curve through their origins, so that neighbours go the same way through the same nodes.
#pragma once

#include "core/aligned_vector.h"
#include "schedule/parallel.h"

#include <packet/ray.h>

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace packet {

/// Sorts rays. Keeps its memory for the next time: new memory would cost as much as the sorting.
class StreamOrder {
public:
    static constexpr std::size_t kMostRays = 16384;

    /// The indices of `rays`, kMostRays at most, in that order, until the next call. O(n) time, 8
    /// bytes a ray.
    [[nodiscard]] std::span<const std::uint32_t> sort(std::span<const Ray> rays);

private:
    ScratchVector<std::uint32_t> items_, scratch_;
};

/// So many take 64 MB to sort.
inline constexpr std::size_t kMostSortedTogether = std::size_t{1} << 22;

/// As StreamOrder, of fewer than 2^32 rays, by all threads: into `out` go their indices, counted
/// from `first`. O(n) time, 16 bytes a ray.
void sort_many(std::span<const Ray> rays, std::span<std::uint32_t> out, std::uint32_t first,
               const Parallel& parallel);

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
