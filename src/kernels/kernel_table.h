// The kernels of one instruction set, as a table of plain functions that dispatch picks from.
#pragma once

#include "core/stream_key.h"
#include "core/views.h"

#include <packet/hit.h>
#include <packet/ray.h>
#include <packet/trace.h>

#include <cstddef>
#include <cstdint>

namespace packet {

/// A run of rays to trace. Ray i is rays[order ? order[i / row] + i % row : i], where a row is
/// 2^row_bits rays that follow each other, and its result goes to the same place.
struct TraceBatch {
    const SceneView* scene;
    const Ray* rays;
    const std::uint32_t* order;
    std::size_t count;
    Hit* hits;               ///< closest-hit kernels write these
    std::uint8_t* occluded;  ///< any-hit kernels write these
    TraceStats* stats;       ///< counted into by the counting kernels, else null
    int row_bits = 0;        ///< of no account without an order
};

/// A ray that waits at a treelet, unless (closest-hit) it has hit something before `enter` by then.
struct QueuedRay {
    std::uint32_t ray;  ///< its index in TraceBatch::rays
    float enter;
};
static_assert(sizeof(QueuedRay) == 8);

/// Where a treelet's queue takes the next rays.
struct QueueTail {
    std::uint32_t next, end;  ///< slots
};

/// Queues as kernels see them: they fill slots, and ask for more where there are none.
struct TreeletQueues {
    QueuedRay* slots = nullptr;
    QueueTail* tails = nullptr;  ///< by treelet
    bool (*add_chunk)(TreeletQueues&, std::uint32_t treelet) noexcept = nullptr;
};

/// A link that leads out of a treelet, and the rays of a stream that follow it, none of them before
/// `enter`.
struct TreeletExit {
    std::uint64_t rays;
    std::uint32_t node;
    float enter;
};

/// Rays that enter a treelet: those of `rays`, each class in a row. The arrays are in their order,
/// with room for 8 more.
struct TreeletBatch {
    TraceBatch rays;
    std::uint32_t treelet;
    const float* best_t;  ///< null: all rays begin here
    const std::int32_t* prim_id;
    TreeletQueues* queues;
    TreeletExit* exits;  ///< room for as many as lead out of the treelet
};

struct KernelTable {
    using Batch = void (*)(const TraceBatch&) noexcept;
    using Treelet = void (*)(const TreeletBatch&) noexcept;
    /// `hit` is a miss, and stays one if nothing is hit.
    using ClosestRay = void (*)(const SceneView&, const Ray&, Hit& hit) noexcept;
    using AnyRay = bool (*)(const SceneView&, const Ray&) noexcept;
    template <int N>
    using Closest = void (*)(const SceneView&, const RayPacket<N>&, std::uint32_t active,
                             HitPacket<N>&) noexcept;
    template <int N>
    using Any = std::uint32_t (*)(const SceneView&, const RayPacket<N>&,
                                  std::uint32_t active) noexcept;

    /// Which of the first `count` boxes, 1 to 32, overlap the triangle: bit i for box i. The sides
    /// of all boxes up to the next multiple of 8 are read.
    using Overlap = std::uint32_t (*)(const float (&triangle)[3][3], const float (&lower)[3][32],
                                      const float (&upper)[3][32], int count) noexcept;

    /// What rays are sorted by to become streams: see kernels/stream_keys.h.
    using StreamKeys = void (*)(const Ray* rays, std::size_t count, const OriginCells& cells,
                                std::uint32_t* keys) noexcept;

    enum Kernel { kSingle, kPacket8, kPacket16, kTile, kStream, kKernelCount };
    enum Counting { kNotCounting, kCounting, kCountingCount };

    Batch closest[kKernelCount][kCountingCount];
    Batch any[kKernelCount][kCountingCount];
    Treelet closest_treelet[kCountingCount];
    Treelet any_treelet[kCountingCount];
    StreamKeys stream_keys;
    ClosestRay closest_ray;
    AnyRay any_ray;
    Closest<8> closest8;
    Closest<16> closest16;
    Any<8> any8;
    Any<16> any16;
    Overlap overlap_axes;  ///< by separating axes
    Overlap overlap_clip;  ///< by clipping; the same answer
};

const KernelTable& kernel_table_scalar() noexcept;
const KernelTable& kernel_table_sse42() noexcept;
const KernelTable& kernel_table_avx2() noexcept;
const KernelTable& kernel_table_avx512() noexcept;

}  // namespace packet
