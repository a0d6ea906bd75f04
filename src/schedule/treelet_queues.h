// Memory for rays that wait at treelets: slots in chunks of one size, each part of a queue or free.
// Never grows. Rays leave a queue in the order in which they came.
#pragma once

#include "core/aligned_vector.h"
#include "kernels/kernel_table.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace packet {

class TreeletQueuePool : public TreeletQueues {
public:
    /// `bytes` at most, in chunks of `chunk_slots`; queues for so many treelets.
    TreeletQueuePool(std::size_t bytes, std::uint32_t chunk_slots, std::uint32_t treelet_count);
    TreeletQueuePool(const TreeletQueuePool&) = delete;
    TreeletQueuePool& operator=(const TreeletQueuePool&) = delete;

    [[nodiscard]] std::uint32_t waiting(std::uint32_t treelet) const noexcept;
    [[nodiscard]] std::size_t waiting_in_all() const noexcept;
    /// The first chunk of a treelet's rays; empty if none waits.
    [[nodiscard]] std::span<const QueuedRay> front(std::uint32_t treelet) const noexcept;
    /// Frees that chunk, of which there must be one.
    void pop(std::uint32_t treelet) noexcept;

private:
    /// Chunks of a queue. All but the last one are full.
    struct Queue {
        std::uint32_t first_chunk = 0, last_chunk = 0, chunk_count = 0;
    };
    static bool add(TreeletQueues& self, std::uint32_t treelet) noexcept;

    std::uint32_t chunk_slots_;
    ScratchVector<QueuedRay> memory_;
    ScratchVector<std::uint32_t> next_chunk_;  ///< of a queue, or of free ones
    std::uint32_t first_free_ = kNone;
    std::vector<Queue> queues_;
    std::vector<QueueTail> tail_store_;

    static constexpr std::uint32_t kNone = 0xFFFFFFFF;
};

}  // namespace packet
