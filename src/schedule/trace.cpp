// Calls of the public interface: what they ask for is planned, and spread over threads.
#include "dispatch/dispatch.h"
#include "scene/scene_accel.h"
#include "schedule/packet_tries.h"
#include "schedule/parallel.h"
#include "schedule/ray_tasks.h"
#include "schedule/trace_plan.h"
#include "schedule/treelet_sweep.h"

#include <packet/error.h>
#include <packet/trace.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <functional>
#include <mutex>
#include <string>

namespace packet {

namespace {

// Packets are tried if that is so little of the whole that the slower way does not count.
constexpr std::size_t kLeastTasksForTries = 128;
// Rays of a task that go the same way in a try: those of a tile.
constexpr std::size_t kRaysOfTry = 128;

/// One call of trace_closest or trace_any, with all that its tasks share.
class SpanTrace {
public:
    using Kernels = KernelTable::Batch[KernelTable::kKernelCount][KernelTable::kCountingCount];

    SpanTrace(const Scene& scene, std::span<const Ray> rays, TraceQuery query,
              const KernelTable& kernels, const TraceOptions& options, Progress& progress)
        : scene_(scene.accel()),
          find_keys_(kernels.stream_keys),
          options_(options),
          rays_(rays),
          parallel_(options.threads, progress),
          plan_(make_plan(scene_, rays, query, options, parallel_.threads())),
          tasks_(plan_.sorting != Sorting::kNone
                     ? RayTasks::sorted(rays, parallel_.threads(), find_keys_)
                     : RayTasks(rays, plan_.image)),
          tries_(plan_.packets_below != 0.0 && tasks_.count() >= kLeastTasksForTries) {
        if (options.width < 0) {
            throw Error(ErrorCode::kBadValue, "width is " + std::to_string(options.width) +
                                                  "; it must be 0 (no image) or more");
        }
        constexpr int kMostChunk = 65536;
        if (options.queue_chunk < 1 || options.queue_chunk > kMostChunk) {
            throw Error(ErrorCode::kBadValue,
                        "queue_chunk is " + std::to_string(options.queue_chunk) +
                            "; it must be 1 to " + std::to_string(kMostChunk));
        }
    }

    [[nodiscard]] bool goes_by_treelets() const { return plan_.by_treelets; }

    /// As many rays at a time as are sorted together: the more, the more meet at a treelet.
    void run_by_treelets(KernelTable::Treelet kernel, Hit* hits, std::uint8_t* occluded) const {
        for (std::size_t first = 0; first < rays_.size(); first += kMostSortedTogether) {
            const std::size_t count = std::min(kMostSortedTogether, rays_.size() - first);
            const TraceBatch batch{&scene_.view,
                                   rays_.data() + first,
                                   nullptr,
                                   count,
                                   hits == nullptr ? nullptr : hits + first,
                                   occluded == nullptr ? nullptr : occluded + first,
                                   options_.stats};
            parallel_.run([&] { run_sweeps(batch, kernel); });
        }
    }

    void run(const Kernels& kernels, Hit* hits, std::uint8_t* occluded) {
        const TraceBatch batch{&scene_.view, nullptr, nullptr, 0, hits, occluded, nullptr};
        const auto counting =
            options_.stats != nullptr ? KernelTable::kCounting : KernelTable::kNotCounting;
        const auto kernel = [&](KernelTable::Kernel which) { return kernels[which][counting]; };
        parallel_.run([&] {
            if (plan_.sorting == Sorting::kTogether) tasks_.sort_together(parallel_);
            PacketTries tries(plan_.kernel, plan_.packets_below);
            const std::size_t try_count = tries_ ? PacketTries::kCount : 0;
            // Tries come first, but nobody waits for them.
            parallel_.for_pieces(try_count + tasks_.count(), 1, [&](std::size_t i, std::size_t) {
                if (i < try_count) return make_try(i, kernel, batch, tries);
                const std::size_t task = i - try_count;
                if (!is_of_try(task)) run_task(task, batch, kernel(tries.best()));
                parallel_.advance(1.0 / static_cast<double>(tasks_.count()));
            });
        });
    }

private:
    /// Threads take sweeps as long as there are any.
    void run_sweeps(const TraceBatch& batch, KernelTable::Treelet kernel) const {
        ScratchVector<std::uint32_t> order(batch.count);
        sort_many({batch.rays, batch.count}, find_keys_, order, 0, parallel_);
        const auto threads = static_cast<std::size_t>(parallel_.threads());
        const TreeletJob job{batch, kernel, options_.queue_bytes / threads,
                             static_cast<std::uint32_t>(options_.queue_chunk)};
        const std::size_t length = rays_per_sweep(
            batch.count, scene_.view.instances[0].tree->byte_count, parallel_.threads());
        std::atomic<std::size_t> next{0};
        parallel_.for_pieces(threads, 1, [&](std::size_t, std::size_t) {
            TreeletSweep sweep(job);
            for (std::size_t begin; (begin = next.fetch_add(length)) < batch.count;) {
                const std::size_t count = std::min(length, batch.count - begin);
                sweep.run(std::span(order).subspan(begin, count), parallel_,
                          static_cast<double>(count) / static_cast<double>(rays_.size()));
            }
            add_stats(sweep.stats());
        });
    }
    void add_stats(const TraceStats& stats) const {
        if (options_.stats == nullptr) return;
        const std::lock_guard lock(stats_mutex_);
        *options_.stats += stats;
    }

    /// Tries are spread over all tasks.
    [[nodiscard]] std::size_t stride_of_tries() const {
        return tasks_.count() / PacketTries::kCount;
    }
    [[nodiscard]] bool is_of_try(std::size_t task) const {
        return tries_ && task % stride_of_tries() == 0 &&
               task / stride_of_tries() < PacketTries::kCount;
    }

    /// Traces the task of a try: some of its rays by the planned kernel, their neighbours by
    /// packets, if it is not known yet what is faster. Their hits are as good as any.
    template <class KernelOf>
    void make_try(std::size_t i, const KernelOf& kernel, const TraceBatch& batch,
                  PacketTries& tries) const {
        // The first two are of different halves, and so on: an image's upper half may be the sky.
        const std::size_t place = (5 * i + 6) % PacketTries::kCount;
        const std::size_t task = place * stride_of_tries();
        if (!tries.is_open()) return run_task(task, batch, kernel(tries.best()));
        double seconds[2] = {0.0, 0.0};
        std::size_t rays[2] = {0, 0};
        run_task(task, batch, [&](const TraceBatch& all) {
            // As in A B B A B A A B, so that neither way is ahead of the other or behind it, in the
            // image or in what it leaves in the caches.
            for (std::size_t first = 0, turn = 0; first < all.count; first += kRaysOfTry, ++turn) {
                const std::size_t way = static_cast<std::size_t>(std::popcount(turn)) % 2;
                const TraceBatch part = part_of(all, first, kRaysOfTry);
                const auto start = std::chrono::steady_clock::now();
                kernel(way == 0 ? plan_.kernel : KernelTable::kPacket16)(part);
                seconds[way] +=
                    std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
                rays[way] += part.count;
            }
        });
        if (rays[1] == 0) return;  // less than two tiles, at an image's edge
        tries.add(
            {seconds[0] / static_cast<double>(rays[0]), seconds[1] / static_cast<double>(rays[1])});
    }

    /// Rays `first` to `first + most` of a task, as far as there are so many.
    static TraceBatch part_of(TraceBatch task, std::size_t first, std::size_t most) {
        task.count = std::min(task.count - first, most);
        if (task.order != nullptr) {
            task.order += first >> task.row_bits;
            return task;
        }
        task.rays += first;
        if (task.hits != nullptr) task.hits += first;
        if (task.occluded != nullptr) task.occluded += first;
        return task;
    }

    void run_task(std::size_t task, TraceBatch batch,
                  const std::function<void(const TraceBatch&)>& trace) const {
        if (options_.stats == nullptr) {
            tasks_.run(task, batch, trace);
            return;
        }
        TraceStats stats;
        batch.stats = &stats;
        tasks_.run(task, batch, trace);
        add_stats(stats);
    }

    const SceneAccel& scene_;
    KernelTable::StreamKeys find_keys_;
    const TraceOptions& options_;
    std::span<const Ray> rays_;
    Parallel parallel_;
    TracePlan plan_;
    RayTasks tasks_;
    bool tries_;  ///< whether to find the kernel by trying
    mutable std::mutex stats_mutex_;
};

/// Calls run(trace, counting), and tells of its progress.
template <class Run>
void trace_span(const Scene& scene, std::span<const Ray> rays, TraceQuery query,
                const KernelTable& kernels, const TraceOptions& options, Run run) {
    const auto counting =
        options.stats != nullptr ? KernelTable::kCounting : KernelTable::kNotCounting;
    with_progress(options.progress, "tracing", [&](Progress& progress) {
        progress.start_phase(1.0);
        SpanTrace trace(scene, rays, query, kernels, options, progress);
        run(trace, counting);
        return 0;
    });
}

void check_sizes(std::size_t rays, std::size_t results, const char* name) {
    if (rays == results) return;
    throw Error(ErrorCode::kBadValue, std::to_string(rays) + " rays but room for " +
                                          std::to_string(results) + " " + name);
}

}  // namespace

void trace_closest(const Scene& scene, std::span<const Ray> rays, std::span<Hit> hits,
                   const TraceOptions& options) {
    check_sizes(rays.size(), hits.size(), "hits");
    const KernelTable& kernels = select_kernels(options.isa);
    trace_span(
        scene, rays, TraceQuery::kClosest, kernels, options, [&](SpanTrace& trace, auto counting) {
            if (trace.goes_by_treelets()) {
                trace.run_by_treelets(kernels.closest_treelet[counting], hits.data(), nullptr);
            } else {
                trace.run(kernels.closest, hits.data(), nullptr);
            }
        });
}

void trace_any(const Scene& scene, std::span<const Ray> rays, std::span<std::uint8_t> occluded,
               const TraceOptions& options) {
    check_sizes(rays.size(), occluded.size(), "results");
    const KernelTable& kernels = select_kernels(options.isa);
    trace_span(
        scene, rays, TraceQuery::kAny, kernels, options, [&](SpanTrace& trace, auto counting) {
            if (trace.goes_by_treelets()) {
                trace.run_by_treelets(kernels.any_treelet[counting], nullptr, occluded.data());
            } else {
                trace.run(kernels.any, nullptr, occluded.data());
            }
        });
}

Hit trace_closest(const Scene& scene, const Ray& ray) {
    Hit hit;
    select_kernels({}).closest_ray(scene.accel().view, ray, hit);
    return hit;
}

bool trace_any(const Scene& scene, const Ray& ray) {
    return select_kernels({}).any_ray(scene.accel().view, ray);
}

template <int N>
void trace_closest(const Scene& scene, const RayPacket<N>& rays, LaneMask<N> active,
                   HitPacket<N>& hits) {
    const KernelTable& kernels = select_kernels({});
    const SceneView& view = scene.accel().view;
    if constexpr (N == 8) {
        kernels.closest8(view, rays, active.bits, hits);
    } else {
        kernels.closest16(view, rays, active.bits, hits);
    }
}

template <int N>
LaneMask<N> trace_any(const Scene& scene, const RayPacket<N>& rays, LaneMask<N> active) {
    const KernelTable& kernels = select_kernels({});
    const SceneView& view = scene.accel().view;
    if constexpr (N == 8) {
        return {kernels.any8(view, rays, active.bits)};
    } else {
        return {kernels.any16(view, rays, active.bits)};
    }
}

template void trace_closest<8>(const Scene&, const Ray8&, LaneMask<8>, Hit8&);
template void trace_closest<16>(const Scene&, const Ray16&, LaneMask<16>, Hit16&);
template LaneMask<8> trace_any<8>(const Scene&, const Ray8&, LaneMask<8>);
template LaneMask<16> trace_any<16>(const Scene&, const Ray16&, LaneMask<16>);

}  // namespace packet
