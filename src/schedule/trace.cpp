// Cuts rays into pieces, spreads the pieces over threads and hands each to a kernel.
#include "core/names.h"
#include "dispatch/dispatch.h"
#include "scene/scene_accel.h"
#include "schedule/auto_mode.h"
#include "schedule/parallel.h"
#include "schedule/pixel_order.h"
#include "schedule/stream_order.h"
#include "schedule/treelet_scheduler.h"

#include <packet/error.h>
#include <packet/trace.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <utility>

namespace packet {

namespace {

constexpr std::array kModeNames = {
    ModeName{Mode::kAuto, "auto"},       ModeName{Mode::kSingle, "single"},
    ModeName{Mode::kPacket8, "packet8"}, ModeName{Mode::kPacket16, "packet16"},
    ModeName{Mode::kTile, "tile"},       ModeName{Mode::kStream, "stream"},
    ModeName{Mode::kTreelet, "treelet"},
};

// Rays in a task: some 100 us of work, so that tasks are cheap and cores end together.
constexpr std::size_t kRaysPerTask = 512;
// Fewer, of 24 classes, make streams of few rays: docs/benchmarking.md#streams.
constexpr std::size_t kLeastRaysForStreams = 1024;
// For closest-hit, rays that look coherent go by tiles, which seldom lose. For the others, if there
// are enough, auto tries packets of 16 beside single rays: short rays gain by them. Packets of 8
// never won by much. It does so this many times, each time on neighbouring tasks,
constexpr std::size_t kTrialPairs = 5;
// if that is so little of the whole that the slower tries do not count.
constexpr std::size_t kLeastTasksForTrial = 128;

KernelTable::Kernel kernel_of(Mode mode) {
    switch (mode) {
        case Mode::kPacket8: return KernelTable::kPacket8;
        case Mode::kPacket16: return KernelTable::kPacket16;
        case Mode::kTile: return KernelTable::kTile;
        case Mode::kStream: return KernelTable::kStream;
        case Mode::kTreelet:  // has kernels of its own
        case Mode::kAuto:
        case Mode::kSingle: break;
    }
    return KernelTable::kSingle;
}

/// Rays of a task of streams. The more are sorted together, the more come together at a node; but
/// they are to stay in the second level's cache, and several threads are to have several tasks.
std::size_t rays_per_stream_task(std::size_t rays, int threads) {
    constexpr std::size_t kMost = 32768;
    static_assert(kMost <= StreamOrder::kMostRays);
    constexpr std::size_t kTasksPerThread = 8;
    if (threads == 1) return kMost;
    return std::clamp(rays / (kTasksPerThread * static_cast<std::size_t>(threads)),
                      kLeastRaysForStreams, kMost);
}

/// Rays cut into tasks: an image's into square tiles, others into runs.
class Tasks {
public:
    Tasks(std::span<const Ray> rays, int width) : rays_(rays), image_(rays.size(), width) {}
    /// Runs that are sorted, as streams need them.
    static Tasks sorted(std::span<const Ray> rays, int threads) {
        Tasks out(rays, 0);
        out.run_length_ = rays_per_stream_task(rays.size(), threads);
        out.orders_ = std::make_unique<StreamOrders>();
        return out;
    }

    [[nodiscard]] std::size_t count() const {
        return image_.is_image() ? image_.tile_count()
                                 : (rays_.size() + run_length_ - 1) / run_length_;
    }
    /// Runs a kernel on the rays of a task. `batch` says where results go, for all rays.
    void run(std::size_t task, KernelTable::Batch kernel, TraceBatch batch) const {
        PixelOrder::Indices pixels;
        std::unique_ptr<StreamOrder> sorted;
        std::size_t first = task * run_length_;
        batch.count = std::min(run_length_, rays_.size() - std::min(first, rays_.size()));
        if (image_.is_image()) {
            first = image_.first_ray(task);
            batch.count = image_.fill(task, pixels);
            batch.order = pixels.data();
        } else if (orders_ != nullptr) {
            sorted = orders_->take();
            batch.order = sorted->sort(rays_.subspan(first, batch.count)).data();
        }
        batch.rays = rays_.data() + first;
        if (batch.hits != nullptr) batch.hits += first;
        if (batch.occluded != nullptr) batch.occluded += first;
        if (batch.stats != nullptr) batch.stats->rays += batch.count;
        kernel(batch);
        if (sorted != nullptr) orders_->give_back(std::move(sorted));
    }

private:
    std::span<const Ray> rays_;
    PixelOrder image_;
    std::size_t run_length_ = kRaysPerTask;
    std::unique_ptr<StreamOrders> orders_;  ///< if runs are sorted
};

/// Streams walk one tree, in the rays' own space.
bool has_one_tree(const SceneView& scene) {
    return scene.is_single_mesh && scene.instances[0].tree->is_tree();
}

bool has_treelets(const SceneView& scene) {
    return has_one_tree(scene) && scene.instances[0].tree->treelet_count != 0;
}

enum class Query { kClosest, kAny };

/// What the rays are traced by.
struct Plan {
    KernelTable::Kernel kernel;
    bool is_sorted = false;  ///< whether the rays are sorted first
    bool is_trial = false;   ///< whether packets are tried, too
    bool by_treelets = false;
};

Plan plan_as_asked(const SceneView& scene, Mode mode) {
    if (mode == Mode::kTreelet) {
        if (has_treelets(scene)) return {.kernel = KernelTable::kStream, .by_treelets = true};
        mode = Mode::kStream;
    }
    if (mode == Mode::kStream && !has_one_tree(scene)) return {.kernel = KernelTable::kSingle};
    return {kernel_of(mode), mode == Mode::kStream};
}

/// As the rays and the query suggest: docs/benchmarking.md#beside-embree.
Plan plan_by_looks(const SceneAccel& scene, std::span<const Ray> rays, Query query) {
    const bool may_stream = rays.size() >= kLeastRaysForStreams && has_one_tree(scene.view);
    const bool is_coherent = choose_mode(rays, scene.top.bounds) == Mode::kTile;
    if (may_stream && query == Query::kAny) {
        return {is_coherent ? KernelTable::kSorted : KernelTable::kStream, true};
    }
    if (is_coherent) return {KernelTable::kTile, false};
    if (may_stream) return {KernelTable::kStream, true};
    return {KernelTable::kSingle, false, true};
}

/// One call of trace_closest or trace_any, with all that its tasks share.
class SpanTrace {
public:
    using Kernels = KernelTable::Batch[KernelTable::kKernelCount][KernelTable::kCountingCount];

    SpanTrace(const Scene& scene, std::span<const Ray> rays, Query query,
              const TraceOptions& options, Progress& progress)
        : scene_(scene.accel()),
          options_(options),
          rays_(rays),
          parallel_(options.threads, progress),
          plan_(options.mode == Mode::kAuto ? plan_by_looks(scene_, rays, query)
                                            : plan_as_asked(scene_.view, options.mode)),
          tasks_(plan_.is_sorted ? Tasks::sorted(rays, parallel_.threads())
                                 : Tasks(rays, options.width)),
          tries_(plan_.is_trial && tasks_.count() >= kLeastTasksForTrial) {
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

    /// Each thread has its own queues and takes rays as long as there are any.
    void run_by_treelets(KernelTable::Treelet kernel, Hit* hits, std::uint8_t* occluded) const {
        constexpr std::size_t kMostRays = 0xFFFFFFFF - StreamOrder::kMostRays;
        const auto threads = static_cast<std::size_t>(parallel_.threads());
        for (std::size_t first = 0; first < rays_.size(); first += kMostRays) {
            const std::size_t count = std::min(kMostRays, rays_.size() - first);
            const TraceBatch batch{&scene_.view,
                                   rays_.data() + first,
                                   nullptr,
                                   count,
                                   hits == nullptr ? nullptr : hits + first,
                                   occluded == nullptr ? nullptr : occluded + first,
                                   options_.stats};
            const TreeletJob job{batch,
                                 kernel,
                                 options_.queue_bytes / threads,
                                 static_cast<std::uint32_t>(options_.queue_chunk),
                                 rays_per_stream_task(count, parallel_.threads())};
            std::atomic<std::size_t> next{0};
            parallel_.run([&] {
                parallel_.for_pieces(threads, 1,
                                     [&](std::size_t, std::size_t) { run_thread(job, next); });
            });
        }
    }

    void run(const Kernels& kernels, Hit* hits, std::uint8_t* occluded) const {
        const TraceBatch batch{&scene_.view, nullptr, nullptr, 0, hits, occluded, nullptr};
        const auto counting =
            options_.stats != nullptr ? KernelTable::kCounting : KernelTable::kNotCounting;
        const auto kernel = [&](KernelTable::Kernel which) { return kernels[which][counting]; };
        parallel_.run([&] {
            const KernelTable::Kernel best = tries_ ? try_packets(kernel, batch) : plan_.kernel;
            parallel_.for_pieces(tasks_.count(), 1, [&](std::size_t task, std::size_t) {
                if (!is_trial(task)) run_task(task, kernel(best), batch);
                parallel_.advance(1.0 / static_cast<double>(tasks_.count()));
            });
        });
    }

private:
    void run_thread(const TreeletJob& job, std::atomic<std::size_t>& next) const {
        const std::size_t all = job.batch.count;
        const double part_of_one = 1.0 / static_cast<double>(rays_.size());
        TreeletScheduler scheduler(job);
        for (;;) {
            parallel_.check();
            if (!scheduler.has_room() && scheduler.run()) continue;
            const std::size_t begin = next.fetch_add(job.rays_per_start);
            if (begin >= all) break;
            const std::size_t count = std::min(job.rays_per_start, all - begin);
            scheduler.start(begin, count);
            parallel_.advance(part_of_one * static_cast<double>(count));
        }
        while (scheduler.run()) parallel_.check();
        add_stats(scheduler.stats());
    }
    void add_stats(const TraceStats& stats) const {
        if (options_.stats == nullptr) return;
        const std::lock_guard lock(stats_mutex_);
        *options_.stats += stats;
    }

    /// Pairs of neighbouring tasks, spread over all: each contender gets one of a pair.
    [[nodiscard]] std::size_t trial_stride() const { return tasks_.count() / kTrialPairs; }
    [[nodiscard]] bool is_trial(std::size_t task) const {
        return tries_ && task % trial_stride() < 2 && task / trial_stride() < kTrialPairs;
    }

    /// Traces the trial tasks and returns what was faster in most pairs: a vote, since one task
    /// that the system interrupts must not decide. Their hits are as good as any.
    template <class KernelOf>
    [[nodiscard]] KernelTable::Kernel try_packets(const KernelOf& kernel,
                                                  const TraceBatch& batch) const {
        std::size_t won_by_packets = 0;
        for (std::size_t pair = 0; pair < kTrialPairs; ++pair) {
            const auto time = [&](std::size_t member, KernelTable::Kernel which) {
                const auto start = std::chrono::steady_clock::now();
                run_task(pair * trial_stride() + member, kernel(which), batch);
                return std::chrono::steady_clock::now() - start;
            };
            // Who comes first finds the scene out of the cache: they take turns.
            if (pair % 2 == 0) {
                const auto packets = time(0, KernelTable::kPacket16);
                won_by_packets += packets < time(1, KernelTable::kSingle);
            } else {
                const auto other = time(0, KernelTable::kSingle);
                won_by_packets += time(1, KernelTable::kPacket16) < other;
            }
        }
        return 2 * won_by_packets > kTrialPairs ? KernelTable::kPacket16 : KernelTable::kSingle;
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
    Plan plan_;
    Tasks tasks_;
    bool tries_;  ///< whether to find the kernel by trying
    mutable std::mutex stats_mutex_;
};

/// Calls run(trace, counting), and tells of its progress.
template <class Run>
void trace_span(const Scene& scene, std::span<const Ray> rays, Query query,
                const TraceOptions& options, Run run) {
    const auto counting =
        options.stats != nullptr ? KernelTable::kCounting : KernelTable::kNotCounting;
    with_progress(options.progress, "tracing", [&](Progress& progress) {
        progress.start_phase(1.0);
        run(SpanTrace(scene, rays, query, options, progress), counting);
        return 0;
    });
}

void check_sizes(std::size_t rays, std::size_t results, const char* name) {
    if (rays == results) return;
    throw Error(ErrorCode::kBadValue, std::to_string(rays) + " rays but room for " +
                                          std::to_string(results) + " " + name);
}

double ratio(std::uint64_t a, std::uint64_t b) {
    return b == 0 ? 0.0 : static_cast<double>(a) / static_cast<double>(b);
}

}  // namespace

std::span<const ModeName> mode_names() noexcept { return kModeNames; }

std::string_view to_string(Mode mode) noexcept {
    for (const ModeName& entry : kModeNames) {
        if (entry.mode == mode) return entry.name;
    }
    return "?";
}

Mode parse_mode(std::string_view name) { return find_by_name(kModeNames, name, "mode").mode; }

TraceStats& TraceStats::operator+=(const TraceStats& other) noexcept {
    rays += other.rays;
    nodes += other.nodes;
    triangles += other.triangles;
    lanes_active += other.lanes_active;
    lanes_issued += other.lanes_issued;
    treelets += other.treelets;
    return *this;
}
TreeletTraceStats& TreeletTraceStats::operator+=(const TreeletTraceStats& other) noexcept {
    loads += other.loads;
    entries += other.entries;
    streams += other.streams;
    treelet_bytes += other.treelet_bytes;
    queue_bytes += other.queue_bytes;
    peak_queued = std::max(peak_queued, other.peak_queued);
    return *this;
}
double TreeletTraceStats::rays_per_load() const noexcept { return ratio(entries, loads); }
double TreeletTraceStats::stream_utilization() const noexcept {
    constexpr std::uint64_t kMostRays = 64;
    return ratio(entries, kMostRays * streams);
}
double TraceStats::nodes_per_ray() const noexcept { return ratio(nodes, rays); }
double TraceStats::triangles_per_ray() const noexcept { return ratio(triangles, rays); }
double TraceStats::lane_utilization() const noexcept { return ratio(lanes_active, lanes_issued); }

void trace_closest(const Scene& scene, std::span<const Ray> rays, std::span<Hit> hits,
                   const TraceOptions& options) {
    check_sizes(rays.size(), hits.size(), "hits");
    const KernelTable& kernels = select_kernels(options.isa);
    trace_span(scene, rays, Query::kClosest, options, [&](const SpanTrace& trace, auto counting) {
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
    trace_span(scene, rays, Query::kAny, options, [&](const SpanTrace& trace, auto counting) {
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
