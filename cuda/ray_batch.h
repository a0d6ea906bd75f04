// Rays to trace, and where what they hit goes: how threads load the one and store the other.
#pragma once

#include "kernels/best_hit.h"
#include "views.h"

#include <packet/hit.h>
#include <packet/ray.h>

namespace packet::cuda {

using BestHit = BestHits<1, isa::CudaThread>;

/// Takes a hit of the triangle, for any-hit no more of it than that there is one.
template <Query query>
PACKET_DEVICE void take_hit(BestHit& best, const TriangleHits<1, isa::CudaThread>& hits,
                            const LoadedTriangle& triangle, std::int32_t instance_id) {
    if constexpr (query == Query::kAny) {
        best.occlude(0, hits.hit);
    } else {
        best.update(0, hits.hit, hits.t, hits.u, hits.v, LaneInt(triangle.prim_id()), instance_id);
    }
}

/// What a walk has to be ready for: kernels for one mesh keep no ray of the world at hand.
enum class Levels : std::uint8_t { kOneMesh, kInstances };

/// Work of a launch, as in TraceStats.
struct WorkCounts {
    unsigned long long nodes, triangles, lanes_issued;
};

/// A warp of an image's rays is a tile of so many pixels.
inline constexpr std::uint32_t kTileWidth = 8, kTileHeight = 4;
static_assert(kTileWidth * kTileHeight == kWarpSize);

/// No ray: a slot beyond the image's edge or the batch's end.
inline constexpr std::uint32_t kNoRay = 0xFFFFFFFFu;

/// All pointers are to device memory. Rays are taken by slots, whose order is theirs to choose.
struct RayBatch {
    const Ray* rays = nullptr;
    const std::uint32_t* order = nullptr;  ///< if not null, slot i is ray order[i]
    std::uint32_t count = 0;
    std::uint32_t width = 0;             ///< if not 0, pixels in a line: slots go tile by tile
    Hit* hits = nullptr;                 ///< for closest-hit
    std::uint8_t* occluded = nullptr;    ///< for any-hit
    std::uint32_t* next_slot = nullptr;  ///< where warps fetch; 0 before the launch
    WorkCounts* work = nullptr;          ///< added to by the counting kernels
};

/// Slots that the rays take up.
PACKET_INLINE std::uint32_t slot_count(const RayBatch& batch) {
    if (batch.width == 0) return batch.count;
    const std::uint32_t height = (batch.count + batch.width - 1) / batch.width;
    const std::uint32_t across = (batch.width + kTileWidth - 1) / kTileWidth;
    return across * ((height + kTileHeight - 1) / kTileHeight) * kWarpSize;
}

PACKET_INLINE std::uint32_t ray_of_slot(const RayBatch& batch, std::uint32_t slot) {
    if (batch.width != 0) {
        const std::uint32_t across = (batch.width + kTileWidth - 1) / kTileWidth;
        const std::uint32_t tile = slot / kWarpSize, pixel = slot % kWarpSize;
        const std::uint32_t x = tile % across * kTileWidth + pixel % kTileWidth;
        const std::uint32_t y = tile / across * kTileHeight + pixel / kTileWidth;
        const std::uint32_t ray = y * batch.width + x;
        return x < batch.width && ray < batch.count ? ray : kNoRay;
    }
    if (slot >= batch.count) return kNoRay;
    return batch.order != nullptr ? batch.order[slot] : slot;
}

/// As load_rays() of kernels/trace_batch.h does. kNoRay yields one that takes part in nothing.
PACKET_DEVICE LaneRay load_ray(const RayBatch& batch, std::uint32_t i) {
    if (i == kNoRay) {
        const Lane nan(__builtin_nanf(""));
        return {{nan, nan, nan}, {nan, nan, nan}, nan, nan};
    }
    const float4* from = reinterpret_cast<const float4*>(batch.rays + i);
    const float4 a = __ldg(from), b = __ldg(from + 1);
    return {{a.x, a.y, a.z}, {b.x, b.y, b.z}, max(Lane(-kLargestFloat), Lane(a.w)), b.w};
}

template <Query query>
PACKET_DEVICE void store_hit(const SceneView& scene, const RayBatch& batch, std::uint32_t i,
                             const BestHit& best) {
    const bool found = any(best.found());
    if constexpr (query == Query::kAny) {
        batch.occluded[i] = found ? 1 : 0;
    } else {
        Hit& out = batch.hits[i];
        out.t = found ? best.t.r[0] : __builtin_huge_valf();
        out.u = best.u.r[0];
        out.v = best.v.r[0];
        out.prim_id = found ? static_cast<std::uint32_t>(best.prim_id.r[0]) : kInvalidId;
        const auto instance_id = static_cast<std::uint32_t>(best.instance_id.r[0]);
        out.instance_id = found ? instance_id : kInvalidId;
        out.mesh_id = found ? scene.mesh_of_instance[instance_id] : kInvalidId;
    }
}

/// Counting work, by a policy as on the CPU. Each thread counts for itself.
struct NoCounts {
    PACKET_DEVICE void visit(bool) {}
    PACKET_DEVICE void triangles(std::uint32_t) {}
    PACKET_DEVICE void add_to(WorkCounts*) const {}
};
struct Counts {
    unsigned long long node_count = 0, triangle_count = 0, issued_count = 0;

    /// This lane is issued for a visit, and takes part in it or not.
    PACKET_DEVICE void visit(bool takes_part) {
        node_count += takes_part ? 1 : 0;
        ++issued_count;
    }
    PACKET_DEVICE void triangles(std::uint32_t tests) { triangle_count += tests; }
    PACKET_DEVICE void add_to(WorkCounts* out) const {
        atomicAdd(&out->nodes, node_count);
        atomicAdd(&out->triangles, triangle_count);
        atomicAdd(&out->lanes_issued, issued_count);
    }
};

}  // namespace packet::cuda
