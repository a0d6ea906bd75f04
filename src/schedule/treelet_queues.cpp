#include "schedule/treelet_queues.h"

#include "core/macros.h"

#include <algorithm>

namespace packet {

/// Slots are numbered by 32 bits.
static std::size_t chunks_in(std::size_t bytes, std::uint32_t chunk_slots) {
    return std::min<std::size_t>(bytes / sizeof(QueuedRay), 0xFFFFFFFF) / chunk_slots;
}

TreeletQueuePool::TreeletQueuePool(std::size_t bytes, std::uint32_t chunk_slots,
                                   std::uint32_t treelet_count)
    : chunk_slots_(chunk_slots),
      memory_(chunks_in(bytes, chunk_slots) * chunk_slots),
      next_chunk_(chunks_in(bytes, chunk_slots)),
      queues_(treelet_count),
      tail_store_(treelet_count, QueueTail{0, 0}) {
    slots = memory_.data();
    tails = tail_store_.data();
    add_chunk = add;
    for (std::size_t i = next_chunk_.size(); i-- > 0;) {
        next_chunk_[i] = first_free_;
        first_free_ = static_cast<std::uint32_t>(i);
    }
}

bool TreeletQueuePool::add(TreeletQueues& self, std::uint32_t treelet) noexcept {
    auto& pool = static_cast<TreeletQueuePool&>(self);
    const std::uint32_t chunk = pool.first_free_;
    if (chunk == kNone) return false;
    pool.first_free_ = pool.next_chunk_[chunk];
    Queue& queue = pool.queues_[treelet];
    (queue.chunk_count == 0 ? queue.first_chunk : pool.next_chunk_[queue.last_chunk]) = chunk;
    queue.last_chunk = chunk;
    ++queue.chunk_count;
    const std::uint32_t first = chunk * pool.chunk_slots_;
    pool.tails[treelet] = {first, first + pool.chunk_slots_};
    return true;
}

std::uint32_t TreeletQueuePool::waiting(std::uint32_t treelet) const noexcept {
    return queues_[treelet].chunk_count * chunk_slots_ - (tails[treelet].end - tails[treelet].next);
}

std::size_t TreeletQueuePool::waiting_in_all() const noexcept {
    std::size_t out = 0;
    for (std::uint32_t t = 0; t < queues_.size(); ++t) out += waiting(t);
    return out;
}

std::span<const QueuedRay> TreeletQueuePool::front(std::uint32_t treelet) const noexcept {
    const Queue& queue = queues_[treelet];
    if (queue.chunk_count == 0) return {};
    const std::uint32_t first = queue.first_chunk * chunk_slots_;
    const bool is_last = queue.chunk_count == 1;
    return {memory_.data() + first, is_last ? tails[treelet].next - first : chunk_slots_};
}

void TreeletQueuePool::pop(std::uint32_t treelet) noexcept {
    Queue& queue = queues_[treelet];
    PACKET_ASSERT(queue.chunk_count != 0);
    const std::uint32_t chunk = queue.first_chunk;
    queue.first_chunk = next_chunk_[chunk];
    next_chunk_[chunk] = first_free_;
    first_free_ = chunk;
    if (--queue.chunk_count == 0) tails[treelet] = {0, 0};
}

}  // namespace packet
