// What kernels read: the CPU's views with pointers to device memory, and triangles in the form in
// which a thread loads them.
#pragma once

#include "core/views.h"
#include "device.h"
#include "kernels/triangle.h"
#include "thread_lanes.h"

namespace packet::cuda {

/// Item i of the leaves, whole, in three loads of 16 bytes: a corner each, and in the fourth place
/// of the first the bits of prim_id. (A block of eight is nine loads of 4 bytes a triangle, each in
/// a sector of its own.)
struct DeviceTriangle {
    float4 corner[3];
};
static_assert(sizeof(DeviceTriangle) == 48);

/// The CPU's view of a tree. `blocks` and `wide_nodes` are not there.
struct DeviceTree : TreeView {
    const DeviceTriangle* triangles = nullptr;
};

using Lane = Float<1, isa::CudaThread>;
using LaneMask1 = Mask<1, isa::CudaThread>;
using LaneInt = Int<1, isa::CudaThread>;
using LaneRay = RayLanes<1, isa::CudaThread>;
using PreparedLane = PreparedRays<1, isa::CudaThread>;

/// A triangle in registers, as the triangle test takes it.
struct LoadedTriangle {
    float4 corner[3];

    template <class F>
    PACKET_INLINE F get(int i, int axis) const {
        return axis == 0 ? corner[i].x : axis == 1 ? corner[i].y : corner[i].z;
    }
    PACKET_DEVICE std::int32_t prim_id() const { return __float_as_int(corner[0].w); }
};

PACKET_DEVICE LoadedTriangle load_triangle(const DeviceTree& tree, std::uint32_t item) {
    const float4* from = tree.triangles[item].corner;
    return {{__ldg(from), __ldg(from + 1), __ldg(from + 2)}};
}

/// A node in two loads of 16 bytes.
PACKET_DEVICE Node load_node(const TreeView& tree, std::uint32_t id) {
    const float4* from = reinterpret_cast<const float4*>(tree.nodes + id);
    const float4 a = __ldg(from), b = __ldg(from + 1);
    return {{{a.x, a.y, a.z}, {a.w, b.x, b.y}}, __float_as_uint(b.z), __float_as_uint(b.w)};
}

/// What a node leads to, in one load of 16 bytes.
struct Link {
    std::uint32_t link, count;  ///< as of Node

    PACKET_DEVICE bool is_leaf() const { return count != 0; }
};
PACKET_DEVICE Link load_link(const TreeView& tree, std::uint32_t id) {
    const float4 b = __ldg(reinterpret_cast<const float4*>(tree.nodes + id) + 1);
    return {__float_as_uint(b.z), __float_as_uint(b.w)};
}

/// Prepares a ray whose neighbours may go anywhere: see prepare() of kernels/ray_setup.h.
PACKET_DEVICE void prepare_lane(PreparedLane& out, const TreeView& tree, const LaneRay& ray) {
    prepare_boxes(out, tree, ray);
    prepare_shear(out, ray);
    out.directions = Directions::kMixed;
    for (int a = 0; a < 3; ++a) {
        out.shear.axis[a] = a;
        out.shear.org[a] = ray.org[a];
    }
}

/// Where the ray meets the triangle, if that is not behind best_t.
PACKET_DEVICE TriangleHits<1, isa::CudaThread> meet_triangle(const PreparedLane& ray,
                                                             const Lane& best_t, LaneMask1 active,
                                                             const LoadedTriangle& triangle) {
    const auto sheared = shear<Directions::kMixed>(ray.shear, triangle);
    TriangleHits<1, isa::CudaThread> out;
    out.hit = active & sheared.may_hit();
    if (none(out.hit)) return out;
    return decide_hits(sheared, ray.hit, best_t, out.hit, triangle);
}

}  // namespace packet::cuda
