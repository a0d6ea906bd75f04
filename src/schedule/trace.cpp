// Cuts rays into pieces, spreads the pieces over threads and hands each to a kernel.
#include "core/names.h"
#include "dispatch/dispatch.h"
#include "scene/scene_accel.h"
#include "schedule/auto_mode.h"
#include "schedule/parallel.h"
#include "schedule/pixel_order.h"

#include <packet/error.h>
#include <packet/trace.h>

#include <array>
#include <mutex>

namespace packet {

namespace {

constexpr std::array kModeNames = {
    ModeName{Mode::kAuto, "auto"},
    ModeName{Mode::kSingle, "single"},
    ModeName{Mode::kPacket8, "packet8"},
    ModeName{Mode::kPacket16, "packet16"},
};

// Rays in a task: some 100 us of work, so that tasks are cheap and cores end together.
constexpr std::size_t kRaysPerTask = 1024;

KernelTable::Width width_of(Mode mode) {
    switch (mode) {
        case Mode::kPacket8: return KernelTable::kWidth8;
        case Mode::kPacket16: return KernelTable::kWidth16;
        case Mode::kAuto:
        case Mode::kSingle: break;
    }
    return KernelTable::kWidth1;
}

/// One call of trace_closest or trace_any, with all that its tasks share.
class SpanTrace {
public:
    SpanTrace(const Scene& scene, std::span<const Ray> rays, const TraceOptions& options)
        : scene_(scene.accel()), rays_(rays), options_(options), parallel_(options.threads) {
        if (options.width < 0) {
            throw Error(ErrorCode::kBadValue, "width is " + std::to_string(options.width) +
                                                  "; it must be 0 (no image) or more");
        }
        Mode mode = options.mode;
        if (mode == Mode::kAuto) mode = choose_mode(rays, scene_.top.bounds);
        width_ = width_of(mode);
        kernels_ = &select_kernels(options.isa);
    }

    void closest(Hit* hits) const { trace(kernels_->closest[width_][counting()], hits, nullptr); }
    void any(std::uint8_t* occluded) const {
        trace(kernels_->any[width_][counting()], nullptr, occluded);
    }

private:
    [[nodiscard]] KernelTable::Counting counting() const {
        return options_.stats != nullptr ? KernelTable::kCounting : KernelTable::kNotCounting;
    }

    void trace(KernelTable::Batch kernel, Hit* hits, std::uint8_t* occluded) const {
        const auto rays_from = [&](std::size_t begin) {
            return TraceBatch{&scene_.view,
                              rays_.data() + begin,
                              nullptr,
                              0,
                              hits != nullptr ? hits + begin : nullptr,
                              occluded != nullptr ? occluded + begin : nullptr,
                              nullptr};
        };
        const PixelOrder image(rays_.size(), options_.width);
        parallel_.run([&] {
            if (width_ == KernelTable::kWidth1 || !image.is_image()) {
                parallel_.for_pieces(rays_.size(), kRaysPerTask,
                                     [&](std::size_t begin, std::size_t end) {
                                         TraceBatch batch = rays_from(begin);
                                         batch.count = end - begin;
                                         run_kernel(kernel, batch);
                                     });
            } else {
                parallel_.for_pieces(image.tile_count(), 1, [&](std::size_t tile, std::size_t) {
                    PixelOrder::Indices order;
                    TraceBatch batch = rays_from(image.first_ray(tile));
                    batch.count = image.fill(tile, order);
                    batch.order = order.data();
                    run_kernel(kernel, batch);
                });
            }
        });
    }

    void run_kernel(KernelTable::Batch kernel, TraceBatch& batch) const {
        if (options_.stats == nullptr) {
            kernel(batch);
            return;
        }
        TraceStats stats;
        stats.rays = batch.count;
        batch.stats = &stats;
        kernel(batch);
        const std::lock_guard lock(stats_mutex_);
        *options_.stats += stats;
    }

    const SceneAccel& scene_;
    std::span<const Ray> rays_;
    const TraceOptions& options_;
    Parallel parallel_;
    KernelTable::Width width_;
    const KernelTable* kernels_;
    mutable std::mutex stats_mutex_;
};

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
    return *this;
}
double TraceStats::nodes_per_ray() const noexcept { return ratio(nodes, rays); }
double TraceStats::triangles_per_ray() const noexcept { return ratio(triangles, rays); }
double TraceStats::lane_utilization() const noexcept { return ratio(lanes_active, lanes_issued); }

void trace_closest(const Scene& scene, std::span<const Ray> rays, std::span<Hit> hits,
                   const TraceOptions& options) {
    check_sizes(rays.size(), hits.size(), "hits");
    SpanTrace(scene, rays, options).closest(hits.data());
}

void trace_any(const Scene& scene, std::span<const Ray> rays, std::span<std::uint8_t> occluded,
               const TraceOptions& options) {
    check_sizes(rays.size(), occluded.size(), "results");
    SpanTrace(scene, rays, options).any(occluded.data());
}

Hit trace_closest(const Scene& scene, const Ray& ray) {
    Hit hit;
    const TraceBatch batch{&scene.accel().view, &ray, nullptr, 1, &hit, nullptr, nullptr};
    select_kernels({}).closest[KernelTable::kWidth1][KernelTable::kNotCounting](batch);
    return hit;
}

bool trace_any(const Scene& scene, const Ray& ray) {
    std::uint8_t occluded = 0;
    const TraceBatch batch{&scene.accel().view, &ray, nullptr, 1, nullptr, &occluded, nullptr};
    select_kernels({}).any[KernelTable::kWidth1][KernelTable::kNotCounting](batch);
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
