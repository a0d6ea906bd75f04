// Calls of the public interface: what they ask for is planned, and spread over threads.
#include "dispatch/dispatch.h"
#include "scene/scene_accel.h"
#include "schedule/parallel.h"
#include "schedule/ray_tasks.h"
#include "schedule/trace_plan.h"
#include "schedule/treelet_sweep.h"

#include <packet/error.h>
#include <packet/trace.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <string>

namespace packet {

namespace {

// Packets are tried if that is so little of the whole that the slower tries do not count: mostly
// two tasks, for then tiles that are faster have won.
constexpr std::size_t kLeastTasksForTrial = 128;

/// One call of trace_closest or trace_any, with all that its tasks share.
class SpanTrace {
public:
    using Kernels = KernelTable::Batch[KernelTable::kKernelCount][KernelTable::kCountingCount];

    SpanTrace(const Scene& scene, std::span<const Ray> rays, TraceQuery query,
              const TraceOptions& options, Progress& progress)
        : scene_(scene.accel()),
          options_(options),
          rays_(rays),
          parallel_(options.threads, progress),
          plan_(make_plan(scene_, rays, query, options.mode, parallel_.threads())),
          tasks_(plan_.sorting != Sorting::kNone ? RayTasks::sorted(rays, parallel_.threads())
                                                 : RayTasks(rays, options.width)),
          tries_(plan_.least_wins != 0 && tasks_.count() >= kLeastTasksForTrial) {
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
            const KernelTable::Kernel best = tries_ ? try_packets(kernel, batch) : plan_.kernel;
            parallel_.for_pieces(tasks_.count(), 1, [&](std::size_t task, std::size_t) {
                if (!is_trial(task)) run_task(task, kernel(best), batch);
                parallel_.advance(1.0 / static_cast<double>(tasks_.count()));
            });
        });
    }

private:
    /// Threads take sweeps as long as there are any.
    void run_sweeps(const TraceBatch& batch, KernelTable::Treelet kernel) const {
        ScratchVector<std::uint32_t> order(batch.count);
        sort_many({batch.rays, batch.count}, order, 0, parallel_);
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

    /// Pairs of neighbouring tasks, spread over all: each contender gets one of a pair.
    [[nodiscard]] std::size_t trial_stride() const { return tasks_.count() / kTrialPairs; }
    [[nodiscard]] bool is_trial(std::size_t task) const {
        return tries_ && task % trial_stride() < 2 && task / trial_stride() < pairs_tried_;
    }

    /// Traces pairs of tasks until enough have told what is faster: a vote, since one task that the
    /// system interrupts must not decide. Their hits are as good as any.
    template <class KernelOf>
    [[nodiscard]] KernelTable::Kernel try_packets(const KernelOf& kernel, const TraceBatch& batch) {
        const KernelTable::Kernel planned = plan_.kernel;
        std::size_t won_by_packets = 0;
        const auto is_open = [&] {
            const std::size_t left = kTrialPairs - pairs_tried_;
            return won_by_packets < plan_.least_wins && won_by_packets + left >= plan_.least_wins;
        };
        for (; is_open(); ++pairs_tried_) {
            const std::size_t pair = pairs_tried_;
            const auto time = [&](std::size_t member, KernelTable::Kernel which) {
                const auto start = std::chrono::steady_clock::now();
                run_task(pair * trial_stride() + member, kernel(which), batch);
                return std::chrono::steady_clock::now() - start;
            };
            // Who comes first finds the scene out of the cache: they take turns.
            if (pair % 2 == 0) {
                const auto packets = time(0, KernelTable::kPacket16);
                won_by_packets += packets < time(1, planned);
            } else {
                const auto other = time(0, planned);
                won_by_packets += time(1, KernelTable::kPacket16) < other;
            }
        }
        return won_by_packets >= plan_.least_wins ? KernelTable::kPacket16 : planned;
    }

    void run_task(std::size_t task, KernelTable::Batch kernel, TraceBatch batch) const {
        if (options_.stats == nullptr) {
            tasks_.run(task, kernel, batch);
            return;
        }
        TraceStats stats;
        batch.stats = &stats;
        tasks_.run(task, kernel, batch);
        add_stats(stats);
    }

    const SceneAccel& scene_;
    const TraceOptions& options_;
    std::span<const Ray> rays_;
    Parallel parallel_;
    TracePlan plan_;
    RayTasks tasks_;
    bool tries_;                   ///< whether to find the kernel by trying
    std::size_t pairs_tried_ = 0;  ///< of neighbouring tasks
    mutable std::mutex stats_mutex_;
};

/// Calls run(trace, counting), and tells of its progress.
template <class Run>
void trace_span(const Scene& scene, std::span<const Ray> rays, TraceQuery query,
                const TraceOptions& options, Run run) {
    const auto counting =
        options.stats != nullptr ? KernelTable::kCounting : KernelTable::kNotCounting;
    with_progress(options.progress, "tracing", [&](Progress& progress) {
        progress.start_phase(1.0);
        SpanTrace trace(scene, rays, query, options, progress);
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
    trace_span(scene, rays, TraceQuery::kClosest, options, [&](SpanTrace& trace, auto counting) {
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
    trace_span(scene, rays, TraceQuery::kAny, options, [&](SpanTrace& trace, auto counting) {
        if (trace.goes_by_treelets()) {
            trace.run_by_treelets(kernels.any_treelet[counting], nullptr, occluded.data());
        } else {
            trace.run(kernels.any, nullptr, occluded.data());
        }
    });
}

Hit trace_closest(const Scene& scene, const Ray& ray) {
    Hit hit;
    const TraceBatch batch{&scene.accel().view, &ray, nullptr, 1, &hit, nullptr, nullptr};
    select_kernels({}).closest[KernelTable::kSingle][KernelTable::kNotCounting](batch);
    return hit;
}

bool trace_any(const Scene& scene, const Ray& ray) {
    std::uint8_t occluded = 0;
    const TraceBatch batch{&scene.accel().view, &ray, nullptr, 1, nullptr, &occluded, nullptr};
    select_kernels({}).any[KernelTable::kSingle][KernelTable::kNotCounting](batch);
    return occluded != 0;
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
