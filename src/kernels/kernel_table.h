// The kernels of one instruction set, as a table of plain functions that dispatch picks from.
#pragma once

#include "core/views.h"

#include <packet/hit.h>
#include <packet/ray.h>
#include <packet/trace.h>

#include <cstddef>
#include <cstdint>

namespace packet {

/// A run of rays to trace. Ray i is rays[order ? order[i] : i], and its result goes to the same
/// place.
struct TraceBatch {
    const SceneView* scene;
    const Ray* rays;
    const std::uint32_t* order;
    std::size_t count;
    Hit* hits;               ///< closest-hit kernels write these
    std::uint8_t* occluded;  ///< any-hit kernels write these
    TraceStats* stats;       ///< counted into by the counting kernels, else null
};

struct KernelTable {
    using Batch = void (*)(const TraceBatch&) noexcept;
    template <int N>
    using Closest = void (*)(const SceneView&, const RayPacket<N>&, std::uint32_t active,
                             HitPacket<N>&) noexcept;
    template <int N>
    using Any = std::uint32_t (*)(const SceneView&, const RayPacket<N>&,
                                  std::uint32_t active) noexcept;

    using Overlap8 = std::uint32_t (*)(const float (&triangle)[3][3], const float (&lower)[3][8],
                                       const float (&upper)[3][8]) noexcept;

    /// kSorted: as kStream; any-hit rays go by tiles where these are full.
    enum Kernel { kSingle, kPacket8, kPacket16, kTile, kStream, kSorted, kKernelCount };
    enum Counting { kNotCounting, kCounting, kCountingCount };

    Batch closest[kKernelCount][kCountingCount];
    Batch any[kKernelCount][kCountingCount];
    Closest<8> closest8;
    Closest<16> closest16;
    Any<8> any8;
    Any<16> any16;
    Overlap8 overlap_axes8;  ///< by separating axes: which of 8 boxes overlap, bit i for box i
    Overlap8 overlap_clip8;  ///< by clipping; the same answer
};

const KernelTable& kernel_table_scalar() noexcept;
const KernelTable& kernel_table_sse42() noexcept;
const KernelTable& kernel_table_avx2() noexcept;
const KernelTable& kernel_table_avx512() noexcept;

}  // namespace packet
