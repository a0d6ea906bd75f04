#include "schedule/trace_plan.h"

#include "schedule/auto_mode.h"
#include "schedule/ray_tasks.h"
#include "schedule/stream_order.h"
#include "schedule/treelet_sweep.h"

#include <algorithm>
#include <optional>

namespace packet {

namespace {

// Fewer fill not much more than one task does.
constexpr std::size_t kLeastRaysTogether = 8 * StreamOrder::kMostRays;
// Rays that meet less than this have not enough of the way in common to pay for being read and
// written in an order that is far from theirs. Measured: docs/experiments.md#streams.
constexpr double kLeastCostTogether = 28.0;

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

/// Streams walk one tree, in the rays' own space.
bool has_one_tree(const SceneView& scene) {
    return scene.is_single_mesh && scene.instances[0].tree->is_tree();
}

bool has_treelets(const SceneView& scene) {
    return has_one_tree(scene) && scene.instances[0].tree->treelet_count != 0;
}

TracePlan plan_treelets() { return {.kernel = KernelTable::kStream, .by_treelets = true}; }

/// Whether neighbours do not start near each other, and are many.
bool are_many_and_scattered(const SceneAccel& scene, std::span<const Ray> rays) {
    return rays.size() >= kLeastRaysTogether && are_scattered(rays, scene.top.bounds);
}

TracePlan plan_streams(const SceneAccel& scene, std::span<const Ray> rays) {
    constexpr std::size_t kMostTogether = 0xFFFFFFFF;
    const bool together = scene.stats.sah_cost >= kLeastCostTogether &&
                          rays.size() <= kMostTogether && are_many_and_scattered(scene, rays);
    return {KernelTable::kStream, together ? Sorting::kTogether : Sorting::kByTask};
}

/// Closest-hit, or any-hit of rays in the order in which they are to be traced. Where there
/// are no streams to take rays for which tiles are slow, packets are tried.
TracePlan plan_tiles(const SceneAccel& scene, const PixelLayout& image) {
    return {.kernel = KernelTable::kTile,
            .packets_below = has_one_tree(scene.view) ? 0.0 : 0.9,
            .image = image};
}

/// Whether so many rays are worth sorting, and may be traced by streams.
bool may_stream(const SceneAccel& scene, std::span<const Ray> rays) {
    return rays.size() >= kLeastRaysForStreams && has_one_tree(scene.view);
}

/// The rays' layout, as `given` or as it shows, if tiles suit them; where there are no streams for
/// those that do not share leaves, it is enough that they cohere.
std::optional<PixelLayout> fit_tiles(const SceneAccel& scene, std::span<const Ray> rays,
                                     const PixelLayout& given) {
    const Bounds3f& world = scene.top.bounds;
    if (!are_coherent(rays, world)) return std::nullopt;
    const PixelLayout image = given.is_image() ? given : find_layout(rays, world);
    if (!may_stream(scene, rays)) return image;
    const float leaf_spacing = scene.trees[scene.mesh_of_instance[0]].leaf_spacing;
    if (!share_leaves(rays, image, world, leaf_spacing)) return std::nullopt;
    return image;
}

TracePlan plan_as_asked(const SceneAccel& scene, std::span<const Ray> rays, Mode mode,
                        const PixelLayout& given) {
    switch (mode) {
        case Mode::kTreelet:
            if (has_treelets(scene.view)) return plan_treelets();
            [[fallthrough]];
        case Mode::kStream:
            if (has_one_tree(scene.view)) return plan_streams(scene, rays);
            return {.kernel = KernelTable::kSingle, .image = given};
        case Mode::kTile: {
            const auto image = fit_tiles(scene, rays, given);
            // Others fit no beam or share no leaves: tiles would be packets, the slowest of all.
            if (!image && may_stream(scene, rays)) return plan_streams(scene, rays);
            return plan_tiles(scene, image.value_or(given));
        }
        default: return {.kernel = kernel_of(mode), .image = given};
    }
}

/// As the rays and the query suggest: docs/experiments.md#tiles-and-single-rays.
TracePlan plan_by_looks(const SceneAccel& scene, std::span<const Ray> rays, TraceQuery query,
                        const PixelLayout& given, int threads) {
    // Any-hit rays are as fast by streams as by tiles and treelets: docs/benchmarking.md#treelets.
    if (query == TraceQuery::kAny && may_stream(scene, rays)) return plan_streams(scene, rays);
    if (const auto image = fit_tiles(scene, rays, given)) return plan_tiles(scene, *image);
    // Rays that start near each other meet the same nodes by streams already.
    if (has_treelets(scene.view) && are_many_and_scattered(scene, rays) &&
        sweeps_beat_streams(rays.size(), scene.view.instances[0].tree->byte_count,
                            scene.stats.sah_cost, threads)) {
        return plan_treelets();
    }
    if (may_stream(scene, rays)) return plan_streams(scene, rays);
    return {.kernel = KernelTable::kSingle, .packets_below = 1.0, .image = given};
}

}  // namespace

TracePlan make_plan(const SceneAccel& scene, std::span<const Ray> rays, TraceQuery query,
                    const TraceOptions& options, int threads) {
    const auto given = PixelLayout::scanlines(static_cast<std::size_t>(std::max(options.width, 0)));
    return options.mode == Mode::kAuto ? plan_by_looks(scene, rays, query, given, threads)
                                       : plan_as_asked(scene, rays, options.mode, given);
}

}  // namespace packet
