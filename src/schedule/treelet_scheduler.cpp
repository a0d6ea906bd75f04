#include "schedule/treelet_scheduler.h"

#include "core/direction_class.h"
#include "core/macros.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace packet {

namespace {

/// Slots are numbered by 32 bits, the last of which means none.
std::size_t chunks_in(std::size_t bytes, std::uint32_t chunk_slots) {
    const std::size_t slots = std::min<std::size_t>(bytes / sizeof(QueueSlot), kNoSlot - 1);
    return slots / chunk_slots;
}

}  // namespace

TreeletQueuePool::TreeletQueuePool(std::size_t bytes, std::uint32_t chunk_slots,
                                   std::uint32_t treelet_count)
    : chunk_slots_(chunk_slots),
      memory_(chunks_in(bytes, chunk_slots) * chunk_slots),
      next_chunk_(chunks_in(bytes, chunk_slots)),
      free_count_(next_chunk_.size()),
      queues_(treelet_count),
      tail_store_(treelet_count, QueueTail{0, 0}) {
    slots = memory_.data();
    tails = tail_store_.data();
    add_to_queue = add_chunk_to_queue;
    add_pending = add_chunk_of_pending;
    for (std::size_t i = next_chunk_.size(); i-- > 0;) {
        next_chunk_[i] = first_free_;
        first_free_ = static_cast<std::uint32_t>(i);
    }
}

std::uint32_t TreeletQueuePool::allocate() noexcept {
    const std::uint32_t chunk = first_free_;
    if (chunk == kNoSlot) return kNoSlot;
    first_free_ = next_chunk_[chunk];
    --free_count_;
    return chunk;
}

bool TreeletQueuePool::add_chunk_to_queue(TreeletQueues& self, std::uint32_t treelet) noexcept {
    auto& pool = static_cast<TreeletQueuePool&>(self);
    const std::uint32_t chunk = pool.allocate();
    if (chunk == kNoSlot) return false;
    Queue& queue = pool.queues_[treelet];
    pool.next_chunk_[chunk] = queue.first_chunk;
    queue.first_chunk = chunk;
    ++queue.chunk_count;
    const std::uint32_t first = chunk * pool.chunk_slots_;
    pool.tails[treelet] = {first, first + pool.chunk_slots_};
    return true;
}

bool TreeletQueuePool::add_chunk_of_pending(TreeletQueues& self) noexcept {
    auto& pool = static_cast<TreeletQueuePool&>(self);
    const std::uint32_t chunk = pool.allocate();
    if (chunk == kNoSlot) return false;
    ++pool.pending_chunks_;
    const std::uint32_t first = chunk * pool.chunk_slots_;
    for (std::uint32_t i = first + pool.chunk_slots_; i-- > first;) {
        pool.slots[i].pending = {0, 0.0f, pool.free_pending, 0};
        pool.free_pending = i;
    }
    pool.free_pending_count += pool.chunk_slots_;
    return true;
}

std::uint32_t TreeletQueuePool::waiting(std::uint32_t treelet) const noexcept {
    return queues_[treelet].chunk_count * chunk_slots_ - (tails[treelet].end - tails[treelet].next);
}

std::uint32_t TreeletQueuePool::fullest() const noexcept {
    std::uint32_t best = kNoSlot, most = 0;
    for (std::uint32_t t = 0; t < queues_.size(); ++t) {
        const std::uint32_t rays = waiting(t);
        if (rays <= most) continue;
        most = rays;
        best = t;
    }
    return best;
}

std::size_t TreeletQueuePool::waiting_in_all() const noexcept {
    std::size_t out = 0;
    for (std::uint32_t t = 0; t < queues_.size(); ++t) out += waiting(t);
    return out;
}

std::size_t TreeletQueuePool::take(std::uint32_t treelet, std::span<QueuedRay> out) noexcept {
    Queue& queue = queues_[treelet];
    QueueTail& tail = tails[treelet];
    std::size_t count = 0;
    while (queue.chunk_count != 0) {
        const std::uint32_t first = queue.first_chunk * chunk_slots_;
        const std::uint32_t rays = tail.next - first;
        if (rays > out.size() - count) break;
        for (std::uint32_t i = 0; i < rays; ++i) out[count++] = slots[first + i].ray;
        const std::uint32_t chunk = queue.first_chunk;
        queue.first_chunk = next_chunk_[chunk];
        --queue.chunk_count;
        next_chunk_[chunk] = first_free_;
        first_free_ = chunk;
        ++free_count_;
        // What is left is full.
        const std::uint32_t end =
            queue.chunk_count == 0 ? 0 : (queue.first_chunk + 1) * chunk_slots_;
        tail = {end, end};
    }
    return count;
}

TreeletScheduler::TreeletScheduler(const TreeletJob& job)
    : job_(job),
      tree_(*job.batch.scene->instances[0].tree),
      pool_(job.queue_bytes, job.chunk, tree_.treelet_count),
      exits_(tree_.most_treelet_exits) {
    const std::size_t most = std::max<std::size_t>(kRunRays, job.chunk);
    taken_.resize(most);
    class_of_.resize(most);
    rays_.resize(most), pending_.resize(most + kPadding);
    best_t_.resize(most + kPadding), prim_id_.resize(most + kPadding);
}

void TreeletScheduler::start(std::size_t begin, std::size_t count) {
    TreeletBatch batch{job_.batch, 0, nullptr, nullptr, nullptr, &pool_, exits_.data()};
    batch.rays.order = job_.order + begin;
    batch.rays.count = count;
    batch.rays.stats = job_.batch.stats != nullptr ? &stats_ : nullptr;
    stats_.rays += count;
    job_.kernel(batch);
}

bool TreeletScheduler::run() {
    const std::uint32_t treelet = pool_.fullest();
    if (treelet == kNoSlot) return false;
    if (job_.batch.stats != nullptr) count_load(treelet);
    for (std::size_t count; (count = pool_.take(treelet, taken_)) != 0;) run_some(treelet, count);
    return true;
}

/// Each class in a row, in the order in which they came.
void TreeletScheduler::run_some(std::uint32_t treelet, std::size_t count) {
    constexpr std::size_t kAhead = 16;  // rays, which lie anywhere: about a memory's latency
    std::array<std::uint32_t, kDirectionClasses> place = {};
    for (std::size_t i = 0; i < count; ++i) {
        if (i + kAhead < count) __builtin_prefetch(job_.batch.rays + taken_[i + kAhead].ray);
        const Ray& ray = job_.batch.rays[taken_[i].ray];
        const int c = direction_class(ray.dir.x, ray.dir.y, ray.dir.z);
        class_of_[i] = static_cast<std::uint8_t>(c);
        ++place[static_cast<std::size_t>(c)];
    }
    std::exclusive_scan(place.begin(), place.end(), place.begin(), 0u);
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t to = place[class_of_[i]]++;
        rays_[to] = taken_[i].ray;
        pending_[to] = taken_[i].pending;
        best_t_[to] = taken_[i].best_t;
        prim_id_[to] = taken_[i].prim_id;
    }
    TreeletBatch batch{job_.batch,      treelet, best_t_.data(), pending_.data(),
                       prim_id_.data(), &pool_,  exits_.data()};
    batch.rays.order = rays_.data();
    batch.rays.count = count;
    batch.rays.stats = job_.batch.stats != nullptr ? &stats_ : nullptr;
    job_.kernel(batch);
}

void TreeletScheduler::count_load(std::uint32_t treelet) {
    if (treelet_bytes_.empty()) {
        treelet_bytes_.resize(tree_.treelet_count);
        for (std::uint32_t t = 0; t < tree_.treelet_count; ++t) {
            for (std::uint32_t i = tree_.treelet_begin[t]; i < tree_.treelet_begin[t + 1]; ++i) {
                treelet_bytes_[t] += bytes_with_blocks(tree_.wide_nodes[i]);
            }
        }
    }
    TreeletTraceStats& out = stats_.treelets;
    ++out.loads;
    out.treelet_bytes += treelet_bytes_[treelet];
    out.queue_bytes += 2 * sizeof(QueuedRay) * pool_.waiting(treelet);
    out.peak_queued = std::max<std::uint64_t>(out.peak_queued, pool_.waiting_in_all());
}

}  // namespace packet
