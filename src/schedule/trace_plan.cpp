#include "schedule/trace_plan.h"

#include "schedule/auto_mode.h"
#include "schedule/ray_tasks.h"
#include "schedule/stream_order.h"
#include "schedule/treelet_sweep.h"

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
TracePlan plan_tiles(const SceneAccel& scene) {
    return {.kernel = KernelTable::kTile, .packets_below = has_one_tree(scene.view) ? 0.0 : 0.9};
}

/// Whether so many rays are worth sorting, and may be traced by streams.
bool may_stream(const SceneAccel& scene, std::span<const Ray> rays) {
    return rays.size() >= kLeastRaysForStreams && has_one_tree(scene.view);
}

/// Whether tiles suit the rays: where there are no streams for those that do not share leaves, it
/// is enough that they cohere.
bool fit_tiles(const SceneAccel& scene, std::span<const Ray> rays, int width) {
    const Bounds3f& world = scene.top.bounds;
    if (!are_coherent(rays, world)) return false;
    return !may_stream(scene, rays) ||
           share_leaves(rays, width, world, scene.trees[scene.mesh_of_instance[0]].leaf_spacing);
}

TracePlan plan_as_asked(const SceneAccel& scene, std::span<const Ray> rays, Mode mode, int width) {
    switch (mode) {
        case Mode::kTreelet:
            if (has_treelets(scene.view)) return plan_treelets();
            [[fallthrough]];
        case Mode::kStream:
            if (has_one_tree(scene.view)) return plan_streams(scene, rays);
            return {KernelTable::kSingle};
        case Mode::kTile:
            // Others fit no beam or share no leaves: tiles would be packets, the slowest of all.
            if (may_stream(scene, rays) && !fit_tiles(scene, rays, width)) {
                return plan_streams(scene, rays);
            }
            return plan_tiles(scene);
        default: return {kernel_of(mode)};
    }
}

/// As the rays and the query suggest: docs/experiments.md#tiles-and-single-rays.
TracePlan plan_by_looks(const SceneAccel& scene, std::span<const Ray> rays, TraceQuery query,
                        int width, int threads) {
    if (fit_tiles(scene, rays, width)) {
        if (!may_stream(scene, rays) || query == TraceQuery::kClosest) return plan_tiles(scene);
        return {KernelTable::kStream, Sorting::kByTask};
    }
    // Rays that start near each other meet the same nodes by streams already, and any-hit rays are
    // as fast by streams: docs/benchmarking.md#treelets.
    if (query == TraceQuery::kClosest && has_treelets(scene.view) &&
        are_many_and_scattered(scene, rays) &&
        sweeps_beat_streams(rays.size(), scene.view.instances[0].tree->byte_count,
                            scene.stats.sah_cost, threads)) {
        return plan_treelets();
    }
    if (may_stream(scene, rays)) return plan_streams(scene, rays);
    return {.kernel = KernelTable::kSingle, .packets_below = 1.0};
}

}  // namespace

TracePlan make_plan(const SceneAccel& scene, std::span<const Ray> rays, TraceQuery query,
                    const TraceOptions& options, int threads) {
    return options.mode == Mode::kAuto ? plan_by_looks(scene, rays, query, options.width, threads)
                                       : plan_as_asked(scene, rays, options.mode, options.width);
}

}  // namespace packet
