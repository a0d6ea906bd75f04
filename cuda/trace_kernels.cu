// The kernels that trace. Warps stay until all rays are taken: each fetches its next ones by an
// atomic counter, so that no block waits for its slowest warp.
//
// Aila, Laine. Understanding the efficiency of ray traversal on GPUs. HPG 2009.
#include "kernels.h"
#include "memory.h"
#include "thread_walk.h"
#include "warp_scene_walk.h"

#include <algorithm>
#include <string>

namespace packet::cuda {

namespace {

// Four warps to a block: small enough that blocks fill a multiprocessor whatever memory is left.
constexpr unsigned kBlockThreads = 128;
// Blocks a multiprocessor: what leaves threads the registers that they need without spilling.
// (Without nvcc nothing asks for it.)
[[maybe_unused]] constexpr unsigned kLeastBlocks = 4;
// Idle lanes at which a warp fetches. Fetching costs all of its lanes the set-up of the new rays.
constexpr int kLeastIdleLanes = 8;

/// The next `amount` slots of the batch for the warp: the first of them, in all lanes.
PACKET_DEVICE std::uint32_t fetch_slots(const RayBatch& batch, std::uint32_t amount) {
    std::uint32_t first = 0;
    if (lane_id() == 0) first = atomicAdd(batch.next_slot, amount);
    return __shfl_sync(kFullWarp, first, 0);
}

template <Levels levels, Query query, class Stats>
__global__ __launch_bounds__(kBlockThreads,
                             kLeastBlocks) void trace_by_warps(SceneView scene, RayBatch batch,
                                                               std::uint32_t stack_depth) {
    Stats stats;
    WarpStack stack(stack_depth);
    const std::uint32_t slots = slot_count(batch);
    for (;;) {
        const std::uint32_t first = fetch_slots(batch, kWarpSize);
        if (first >= slots) break;
        const std::uint32_t i = ray_of_slot(batch, first + lane_id());
        const LaneRay ray = load_ray(batch, i);
        BestHit best(ray.tfar, usable(ray));
        walk_scene<levels, query>(scene, ray, best, stack, stats);
        if (i != kNoRay) store_hit<query>(scene, batch, i, best);
    }
    stats.add_to(batch.work);
}

/// Gives rays to idle lanes, if so many are idle that it pays. False when all rays are taken.
template <class Walk>
PACKET_DEVICE bool refill(const RayBatch& batch, std::uint32_t slots, Walk& walk) {
    const unsigned idle = __ballot_sync(kFullWarp, walk.is_idle());
    if (__popc(idle) < kLeastIdleLanes) return true;
    const std::uint32_t first = fetch_slots(batch, static_cast<std::uint32_t>(__popc(idle)));
    const std::uint32_t slot = first + static_cast<std::uint32_t>(__popc(idle & lanes_below()));
    if (walk.is_idle() && slot < slots) {
        const std::uint32_t i = ray_of_slot(batch, slot);
        if (i != kNoRay) walk.start(i);
    }
    return first < slots;
}

template <Levels levels, Query query, class Stats>
__global__ __launch_bounds__(kBlockThreads, kLeastBlocks) void trace_by_threads(SceneView scene,
                                                                                RayBatch batch) {
    Stats stats;
    FarEntries far;
    ThreadWalk<levels, query, Stats> walk(scene, batch, far);
    const std::uint32_t slots = slot_count(batch);
    bool more = true;
    for (;;) {
        if (more) more = refill(batch, slots, walk);
        if (!more && __all_sync(kFullWarp, walk.is_idle())) break;
        while (__any_sync(kFullWarp, walk.searches())) {
            const bool takes_part = walk.is_at_inner_node();
            stats.visit(takes_part);
            if (takes_part) walk.visit();
        }
        walk.meet(stats);
    }
    stats.add_to(batch.work);
}

/// Blocks that fill the device, but no more than there is work for.
template <class Kernel>
unsigned resident_blocks(Kernel kernel, std::size_t shared_bytes, std::uint32_t slots) {
    const int limit = device_attribute(cudaDevAttrMaxSharedMemoryPerBlockOptin);
    if (shared_bytes > static_cast<std::size_t>(limit)) {
        throw Error(ErrorCode::kUnsupported,
                    "the CUDA device has " + std::to_string(limit) +
                        " bytes of shared memory a block, the tree's stacks take " +
                        std::to_string(shared_bytes));
    }
    check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize,
                               static_cast<int>(shared_bytes)),
          "cudaFuncSetAttribute");
    int per_multiprocessor = 0;
    check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&per_multiprocessor, kernel, kBlockThreads,
                                                        shared_bytes),
          "cudaOccupancyMaxActiveBlocksPerMultiprocessor");
    const auto resident = static_cast<unsigned>(per_multiprocessor *
                                                device_attribute(cudaDevAttrMultiProcessorCount));
    return std::clamp((slots + kBlockThreads - 1) / kBlockThreads, 1u, std::max(resident, 1u));
}

template <Levels levels, Query query, class Stats>
void launch_by(const SceneView& scene, const RayBatch& batch, const TraceLaunch& how) {
    const std::uint32_t slots = slot_count(batch);
    if (how.walk == Walk::kWarp) {
        const std::size_t bytes =
            sizeof(std::uint32_t) * (kBlockThreads / kWarpSize) * WarpStack::words(how.stack_depth);
        const auto kernel = trace_by_warps<levels, query, Stats>;
        launch(kernel, {resident_blocks(kernel, bytes, slots), kBlockThreads, bytes, how.stream},
               scene, batch, how.stack_depth);
    } else {
        const std::size_t bytes = sizeof(std::uint32_t) * ShortStack::words(kBlockThreads);
        const auto kernel = trace_by_threads<levels, query, Stats>;
        launch(kernel, {resident_blocks(kernel, bytes, slots), kBlockThreads, bytes, how.stream},
               scene, batch);
    }
    check(cudaGetLastError(), "launch of a trace kernel");
}

template <Levels levels, Query query>
void launch_counting(const SceneView& scene, const RayBatch& batch, const TraceLaunch& how) {
    how.counting == Counting::kYes ? launch_by<levels, query, Counts>(scene, batch, how)
                                   : launch_by<levels, query, NoCounts>(scene, batch, how);
}

template <Levels levels>
void launch_query(const SceneView& scene, const RayBatch& batch, const TraceLaunch& how) {
    how.query == Query::kClosest ? launch_counting<levels, Query::kClosest>(scene, batch, how)
                                 : launch_counting<levels, Query::kAny>(scene, batch, how);
}

}  // namespace

void launch_trace(const SceneView& scene, const RayBatch& batch, const TraceLaunch& how) {
    scene.is_single_mesh ? launch_query<Levels::kOneMesh>(scene, batch, how)
                         : launch_query<Levels::kInstances>(scene, batch, how);
}

}  // namespace packet::cuda
