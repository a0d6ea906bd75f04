// Tracing from host memory to host memory: pieces of the rays take turns in two streams, so that
// one piece is copied while another is traced.
#include "device_scene.h"

#include "ray_sort.h"
#include "scene/scene_accel.h"
#include "schedule/auto_mode.h"

#include <algorithm>
#include <optional>
#include <vector>

namespace packet::cuda {

namespace {

// Rays of a piece: 60 MB with their hits, enough to fill a device several times over.
constexpr std::size_t kPiece = std::size_t{1} << 20;

/// An image's pieces are whole lines of tiles.
std::size_t piece_size(int width) {
    if (width == 0) return kPiece;
    const std::size_t line = static_cast<std::size_t>(width) * kTileHeight;
    return std::max<std::size_t>(1, kPiece / line) * line;
}

void check_sizes(std::size_t rays, std::size_t results, const char* name, int width) {
    if (rays != results) {
        throw Error(ErrorCode::kBadValue, std::to_string(rays) + " rays but room for " +
                                              std::to_string(results) + " " + name);
    }
    if (width < 0) {
        throw Error(ErrorCode::kBadValue,
                    "width is " + std::to_string(width) + "; it must be 0 (no image) or more");
    }
}

/// One call of trace_closest or trace_any.
class SpanTrace {
public:
    SpanTrace(const DeviceScene::Impl& scene, std::span<const Ray> rays,
              const DeviceTraceOptions& options, Query query)
        : scene_(scene), rays_(rays), options_(options), query_(query) {
        piece_ = std::min(piece_size(options.width), rays.size());
        if (options_.mode != DeviceMode::kAuto) return;
        const bool coheres = are_coherent(rays, scene.scene.bounds());
        options_.mode = coheres ? DeviceMode::kWarp : DeviceMode::kThread;
    }

    /// Calls fetch(device rays, first, count, stream) for each piece once it is traced. Memory that
    /// is not pinned is copied while the host waits, so the next piece is on its way before that.
    template <class Fetch>
    void run(Fetch&& fetch) {
        const std::size_t pieces = rays_.empty() ? 0 : (rays_.size() + piece_ - 1) / piece_;
        for (std::size_t p = 0; p <= pieces; ++p) {
            if (p < pieces) send(p);
            if (p > 0) receive(p - 1, fetch);
        }
    }

private:
    /// Pieces take turns in these.
    struct Side {
        Stream stream;
        std::optional<DeviceRays> rays;
    };

    [[nodiscard]] std::span<const Ray> rays_of(std::size_t p) const {
        return rays_.subspan(p * piece_, std::min(piece_, rays_.size() - p * piece_));
    }
    void send(std::size_t p) {
        Side& side = sides_[p % 2];
        if (!side.rays) side.rays.emplace(static_cast<std::uint32_t>(piece_));
        const std::span<const Ray> rays = rays_of(p);
        side.rays->rays.copy_from(rays, side.stream.get());
        trace_on_device(scene_, *side.rays, static_cast<std::uint32_t>(rays.size()), options_,
                        query_, side.stream.get());
    }
    template <class Fetch>
    void receive(std::size_t p, Fetch& fetch) {
        Side& side = sides_[p % 2];
        const std::size_t count = rays_of(p).size();
        fetch(*side.rays, p * piece_, count, side.stream.get());
        WorkCounts work = {};
        if (options_.stats != nullptr) side.rays->work.copy_to({&work, 1}, side.stream.get());
        side.stream.synchronize();
        if (options_.stats == nullptr) return;
        *options_.stats += {count, work.nodes, work.triangles, work.nodes, work.lanes_issued, {}};
    }

    const DeviceScene::Impl& scene_;
    std::span<const Ray> rays_;
    DeviceTraceOptions options_;
    Query query_;
    std::size_t piece_;
    Side sides_[2];
};

}  // namespace

void trace_on_device(const DeviceScene::Impl& scene, DeviceRays& rays, std::uint32_t count,
                     const DeviceTraceOptions& options, Query query, cudaStream_t stream) {
    RayBatch batch;
    batch.rays = rays.rays.data();
    batch.count = count;
    batch.width = static_cast<std::uint32_t>(options.width);
    batch.hits = rays.hits.data();
    batch.occluded = rays.occluded.data();
    batch.next_slot = rays.next_slot.data();
    batch.work = rays.work.data();
    if (options.mode == DeviceMode::kSorted) {
        rays.order = sort_rays(batch.rays, count, scene.scene.bounds(), stream);
        batch.order = rays.order.data();
        batch.width = 0;
    }
    rays.next_slot.fill_bytes(0, stream);
    rays.work.fill_bytes(0, stream);
    const Walk walk = options.mode == DeviceMode::kThread ? Walk::kThread : Walk::kWarp;
    const Counting counting = options.stats != nullptr ? Counting::kYes : Counting::kNo;
    launch_trace(scene.scene.view(), batch,
                 {walk, query, counting, scene.scene.stack_depth(), stream});
}

std::string device_name() {
    int count = 0;
    check(cudaGetDeviceCount(&count), "looking for a device");
    if (count == 0) throw Error(ErrorCode::kUnsupported, "CUDA: this machine has no device");
    int device = 0;
    check(cudaGetDevice(&device), "cudaGetDevice");
    cudaDeviceProp properties;
    check(cudaGetDeviceProperties(&properties, device), "cudaGetDeviceProperties");
    return properties.name;
}

DeviceScene::DeviceScene(const Scene& scene) {
    (void)device_name();  // throws if there is none
    impl_ = std::make_unique<Impl>(UploadedScene(scene.accel()));
}
DeviceScene::DeviceScene(const Scene& scene, const BuildOptions& options) {
    (void)device_name();  // throws if there is none
    impl_ = std::make_unique<Impl>(UploadedScene(scene, options));
}
DeviceScene::~DeviceScene() = default;
DeviceScene::DeviceScene(DeviceScene&&) noexcept = default;
DeviceScene& DeviceScene::operator=(DeviceScene&&) noexcept = default;

void DeviceScene::trace_closest(std::span<const Ray> rays, std::span<Hit> hits,
                                const DeviceTraceOptions& options) const {
    check_sizes(rays.size(), hits.size(), "hits", options.width);
    SpanTrace(*impl_, rays, options, Query::kClosest)
        .run([&](DeviceRays& from, std::size_t first, std::size_t count, cudaStream_t stream) {
            from.hits.copy_to(hits.subspan(first, count), stream);
        });
}

void DeviceScene::trace_any(std::span<const Ray> rays, std::span<std::uint8_t> occluded,
                            const DeviceTraceOptions& options) const {
    check_sizes(rays.size(), occluded.size(), "results", options.width);
    SpanTrace(*impl_, rays, options, Query::kAny)
        .run([&](DeviceRays& from, std::size_t first, std::size_t count, cudaStream_t stream) {
            from.occluded.copy_to(occluded.subspan(first, count), stream);
        });
}

}  // namespace packet::cuda
