#include "schedule/treelet_sweep.h"

#include "build/treelets.h"
#include "schedule/stream_order.h"
#include "schedule/treelet_order.h"

#include <packet/accel.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

namespace packet {

namespace {

// Rays, hits and what waits lie anywhere: fetched so many ahead, about a memory's latency.
constexpr std::size_t kAhead = 16;

/// Fetches lines of an object into the second level's cache.
template <class T>
void fetch_lines(const T* object) {
    constexpr std::size_t kLine = 64;
    const char* const first = reinterpret_cast<const char*>(object);
    for (std::size_t i = 0; i < sizeof(T); i += kLine) __builtin_prefetch(first + i, 0, 2);
}

}  // namespace

std::size_t rays_per_sweep(std::size_t rays, std::size_t tree_bytes, int threads) noexcept {
    constexpr std::size_t kBytesPerRay = 1000;  // measured: docs/experiments.md#treelets
    constexpr std::size_t kLeast = 65536;
    const std::size_t wanted = std::max(tree_bytes / kBytesPerRay, kLeast);
    const auto thread_count = static_cast<std::size_t>(threads);
    // Powers of two, as there are eight octants: then rays of few octants sweep together.
    const std::size_t rounds = std::bit_floor(rays / (wanted * thread_count));
    const std::size_t sweeps = std::max<std::size_t>(rounds, 1) * thread_count;
    return std::max<std::size_t>((rays + sweeps - 1) / sweeps, 1);
}

bool sweeps_beat_streams(std::size_t rays, std::size_t tree_bytes, double sah_cost,
                         int threads) noexcept {
    constexpr std::size_t kMostBytesPerRay = 2000;  // measured: docs/experiments.md#treelets
    const std::size_t together = std::min(rays, kMostSortedTogether);
    return tree_bytes >= kLeastBytesToCut && sah_cost >= kLeastCostToCut &&
           tree_bytes <= kMostBytesPerRay * rays_per_sweep(together, tree_bytes, threads);
}

TreeletSweep::TreeletSweep(const TreeletJob& job)
    : job_(job),
      tree_(*job.batch.scene->instances[0].tree),
      pool_(job.queue_bytes, job.chunk, tree_.treelet_count),
      exits_(tree_.most_treelet_exits) {
    constexpr std::size_t kPadding = 8;  // that kernels may read
    const std::size_t most = kRunRays + job.chunk + kPadding;
    taken_.resize(most), best_t_.resize(most), prim_id_.resize(most);
}

void TreeletSweep::run(std::span<const std::uint32_t> order, const Parallel& parallel,
                       double share) {
    load(order);
    enter_root(parallel);
    for (const std::uint32_t treelet : treelet_order(tree_, direction())) {
        if (pool_.waiting(treelet) != 0) run_queue(treelet);
        parallel.advance(share / static_cast<double>(tree_.treelet_count));
    }
    store(order);
}

/// Which way most rays of a sample go, by signs, which are never NaN.
glm::vec3 TreeletSweep::direction() const {
    constexpr std::size_t kStride = 16;
    glm::vec3 out(0.0f);
    for (std::size_t i = 0; i < rays_.size(); i += kStride) {
        for (int a = 0; a < 3; ++a) out[a] += std::signbit(rays_[i].dir[a]) ? -1.0f : 1.0f;
    }
    return out;
}

void TreeletSweep::load(std::span<const std::uint32_t> order) {
    rays_.resize(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (i + kAhead < order.size()) __builtin_prefetch(job_.batch.rays + order[i + kAhead]);
        rays_[i] = job_.batch.rays[order[i]];
    }
    // Kernels write where something is hit.
    if (is_closest()) {
        hits_.assign(order.size(), Hit{});
    } else {
        occluded_.assign(order.size(), std::uint8_t{0});
    }
    stats_.rays += order.size();
}

void TreeletSweep::enter_root(const Parallel& parallel) {
    TreeletBatch part = batch();
    for (std::size_t first = 0; first < rays_.size(); first += kRunRays) {
        parallel.check();
        part.rays.count = std::min(kRunRays, rays_.size() - first);
        std::iota(taken_.begin(), taken_.begin() + static_cast<std::ptrdiff_t>(part.rays.count),
                  static_cast<std::uint32_t>(first));
        job_.kernel(part);
    }
}

void TreeletSweep::store(std::span<const std::uint32_t> order) const {
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (is_closest()) {
            if (i + kAhead < order.size()) {
                __builtin_prefetch(job_.batch.hits + order[i + kAhead], 1);
            }
            job_.batch.hits[order[i]] = hits_[i];
        } else {
            job_.batch.occluded[order[i]] = occluded_[i];
        }
    }
}

TreeletBatch TreeletSweep::batch() {
    TreeletBatch out{job_.batch, 0, nullptr, nullptr, &pool_, exits_.data()};
    out.rays.rays = rays_.data();
    out.rays.order = taken_.data();
    if (is_closest()) {
        out.rays.hits = hits_.data();
    } else {
        out.rays.occluded = occluded_.data();
    }
    out.rays.stats = job_.batch.stats != nullptr ? &stats_ : nullptr;
    return out;
}

void TreeletSweep::run_queue(std::uint32_t treelet) {
    if (job_.batch.stats != nullptr) count_load(treelet);
    fetch(treelet);
    for (auto chunk = pool_.front(treelet); !chunk.empty(); chunk = pool_.front(treelet)) {
        take(chunk);
        pool_.pop(treelet);
        if (taken_count_ >= kRunRays) run_taken(treelet);
    }
    run_taken(treelet);
}

/// Those that have hit nothing nearer.
void TreeletSweep::take(std::span<const QueuedRay> waiting) {
    for (std::size_t i = 0; i < waiting.size(); ++i) {
        const QueuedRay ray = waiting[i];
        if (i + kAhead < waiting.size()) {
            __builtin_prefetch(rays_.data() + waiting[i + kAhead].ray);
            if (is_closest()) __builtin_prefetch(hits_.data() + waiting[i + kAhead].ray);
        }
        const Hit hit = is_closest() ? hits_[ray.ray] : Hit{};
        if (is_closest() ? ray.enter > hit.t : occluded_[ray.ray] != 0) continue;
        taken_[taken_count_] = ray.ray;
        best_t_[taken_count_] = hit.is_hit() ? hit.t : rays_[ray.ray].tfar;
        prim_id_[taken_count_] = static_cast<std::int32_t>(hit.prim_id);
        ++taken_count_;
    }
}

void TreeletSweep::run_taken(std::uint32_t treelet) {
    if (taken_count_ == 0) return;
    TreeletBatch part = batch();
    part.treelet = treelet;
    part.best_t = best_t_.data();
    part.prim_id = prim_id_.data();
    part.rays.count = taken_count_;
    job_.kernel(part);
    taken_count_ = 0;
}

/// Fetches all of a treelet where enough rays wait to meet most of it. Meeting line after line
/// instead, each would wait for memory.
void TreeletSweep::fetch(std::uint32_t treelet) const {
    constexpr std::size_t kBytesPerRay = 1000;
    if (tree_.treelet_roots[treelet].bytes > kBytesPerRay * pool_.waiting(treelet)) return;
    const WideNode* const end = tree_.wide_nodes + tree_.treelet_begin[treelet + 1];
    constexpr std::ptrdiff_t kNodesAhead = 16;
    for (const WideNode* node = tree_.wide_nodes + tree_.treelet_begin[treelet]; node < end;
         ++node) {
        if (end - node > kNodesAhead) fetch_lines(node + kNodesAhead);
        std::uint32_t fetched = 0xFFFFFFFF;  // a leaf may begin in the block where another ends
        for (const WideChild& child : node->child) {
            if (!child.is_leaf()) continue;
            const std::uint32_t last = (child.link + child.count - 1) / kBlockSize;
            for (std::uint32_t b = child.link / kBlockSize; b <= last; ++b) {
                if (b != fetched) fetch_lines(tree_.blocks + b);
                fetched = b;
            }
        }
    }
}

void TreeletSweep::count_load(std::uint32_t treelet) {
    TreeletTraceStats& out = stats_.treelets;
    ++out.loads;
    out.treelet_bytes += tree_.treelet_roots[treelet].bytes;
    out.queue_bytes += 2 * sizeof(QueuedRay) * pool_.waiting(treelet);
    out.peak_queued = std::max<std::uint64_t>(out.peak_queued, pool_.waiting_in_all());
}

}  // namespace packet
