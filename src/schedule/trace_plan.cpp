#include "schedule/trace_plan.h"

#include "schedule/auto_mode.h"
#include "schedule/ray_tasks.h"

namespace packet {

namespace {

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

TracePlan plan_as_asked(const SceneView& scene, Mode mode) {
    if (mode == Mode::kTreelet) {
        if (has_treelets(scene)) return {.kernel = KernelTable::kStream, .by_treelets = true};
        mode = Mode::kStream;
    }
    if (mode == Mode::kStream && !has_one_tree(scene)) return {.kernel = KernelTable::kSingle};
    return {kernel_of(mode), mode == Mode::kStream};
}

/// As the rays and the query suggest: docs/benchmarking.md#beside-embree.
TracePlan plan_by_looks(const SceneAccel& scene, std::span<const Ray> rays, TraceQuery query) {
    const bool may_stream = rays.size() >= kLeastRaysForStreams && has_one_tree(scene.view);
    const bool is_coherent = choose_mode(rays, scene.top.bounds) == Mode::kTile;
    if (may_stream && query == TraceQuery::kAny) {
        return {is_coherent ? KernelTable::kSorted : KernelTable::kStream, true};
    }
    if (is_coherent) return {KernelTable::kTile, false};
    if (may_stream) return {KernelTable::kStream, true};
    return {KernelTable::kSingle, false, true};
}

}  // namespace

TracePlan make_plan(const SceneAccel& scene, std::span<const Ray> rays, TraceQuery query,
                    Mode mode) {
    return mode == Mode::kAuto ? plan_by_looks(scene, rays, query)
                               : plan_as_asked(scene.view, mode);
}

}  // namespace packet
