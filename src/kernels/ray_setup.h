// What is computed once a ray: for the box test the grown origins and reciprocals, for the triangle
// test the shear that turns the ray into the unit z axis.
//
// Woop, Benthin, Wald. Watertight ray/triangle intersection. JCGT 2013.
#pragma once

#include "core/views.h"
#include "kernels/lanes.h"

#include <packet/ray.h>

namespace packet {

/// Whether all lanes of a packet go into the same octant with the same longest axis. If so the near
/// planes of boxes and the axes of the shear are known without looking at the lanes.
enum class Directions { kShared, kMixed };

/// Rays as they come in. Lanes that take no part hold a ray that hits nothing.
template <int N, class Isa>
struct RayLanes {
    using F = Float<N, Isa>;
    F org[3], dir[3], tnear, tfar;
};

/// Rays prepared for the boxes and triangles of one tree.
template <int N, class Isa>
struct PreparedRays {
    using F = Float<N, Isa>;
    using M = Mask<N, Isa>;

    F org_plus[3], org_minus[3];  ///< org + e meets lower planes, org - e upper ones
    F inv_dir[3];                 ///< 1 / dir, finite
    F tnear;

    F org[3];  ///< kShared: axes in the order `axis`, else x y z
    F shear_x, shear_y, scale_z;
    M z_is_x, z_is_y;           ///< kMixed: which axis is longest
    int axis[3] = {0, 1, 2};    ///< kShared: the axes that become x, y, z
    int near_side[3] = {};      ///< kShared: per axis, the plane of a node that is met first
    F org_near[3], org_far[3];  ///< kShared: what meets the near and the far planes
    Directions directions = Directions::kMixed;
};

/// 1 / x, or the largest float of x's sign where that overflows, so that 0 * 1/0 is no NaN.
template <int N, class Isa>
PACKET_INLINE Float<N, Isa> safe_reciprocal(const Float<N, Isa>& x) {
    constexpr float kLargest = 3.402823466e38f;
    return max(Float<N, Isa>(-kLargest), min(Float<N, Isa>(kLargest), Float<N, Isa>(1.0f) / x));
}

/// Lanes whose ray can hit anything: finite, ordered numbers, and 1 / dir is finite on some axis.
template <int N, class Isa>
PACKET_INLINE Mask<N, Isa> usable(const RayLanes<N, Isa>& ray) {
    using F = Float<N, Isa>;
    constexpr float kLargest = 3.402823466e38f;
    constexpr float kSmallestNormal = 1.175494351e-38f;
    Mask<N, Isa> ok = ray.tnear <= ray.tfar;
    for (int a = 0; a < 3; ++a) {
        ok = ok & (abs(ray.org[a]) <= F(kLargest)) & (abs(ray.dir[a]) <= F(kLargest));
    }
    // max(x, NaN) is NaN, but a NaN direction has been ruled out above
    const F longest = max(abs(ray.dir[0]), max(abs(ray.dir[1]), abs(ray.dir[2])));
    return ok & (longest >= F(kSmallestNormal));
}

/// By how much boxes of the tree are grown for each lane, as TreeView::slack says.
template <int N, class Isa>
PACKET_INLINE Float<N, Isa> box_growth(const TreeView& tree, const RayLanes<N, Isa>& ray) {
    using F = Float<N, Isa>;
    F reach(0.0f);
    for (int a = 0; a < 3; ++a) {
        reach = max(reach, abs(F(tree.lower[a]) - ray.org[a]));
        reach = max(reach, abs(F(tree.upper[a]) - ray.org[a]));
    }
    return (reach + F(tree.reach)) * F(tree.slack);
}

template <int N, class Isa>
PACKET_INLINE void prepare_boxes(PreparedRays<N, Isa>& out, const TreeView& tree,
                                 const RayLanes<N, Isa>& ray) {
    const Float<N, Isa> e = box_growth(tree, ray);
    for (int a = 0; a < 3; ++a) {
        // Far from the world's origin org + e would round back to org: a further ulp of org stays.
        const Float<N, Isa> growth = e + abs(ray.org[a]) * Float<N, Isa>(kOriginSlack);
        out.org_plus[a] = ray.org[a] + growth;
        out.org_minus[a] = ray.org[a] - growth;
        out.inv_dir[a] = safe_reciprocal(ray.dir[a]);
    }
    out.tnear = ray.tnear;
}

/// Notes whether the active lanes share octant and longest axis, and if so, which.
template <int N, class Isa>
PACKET_INLINE void prepare_directions(PreparedRays<N, Isa>& out, std::uint32_t active) {
    out.directions = Directions::kShared;
    const std::uint32_t x = out.z_is_x.bits() & active;
    const std::uint32_t y = out.z_is_y.bits() & active;
    const int z_axis = x != 0 ? 0 : y != 0 ? 1 : 2;
    if ((x != 0 && x != active) || (y != 0 && y != active)) out.directions = Directions::kMixed;
    for (int a = 0; a < 3; ++a) {
        const std::uint32_t negative = (out.inv_dir[a] < Float<N, Isa>(0.0f)).bits() & active;
        if (negative != 0 && negative != active) out.directions = Directions::kMixed;
        out.near_side[a] = negative != 0 ? 1 : 0;
    }
    if (out.directions == Directions::kMixed) return;
    for (int a = 0; a < 3; ++a) {
        out.org_near[a] = out.near_side[a] == 0 ? out.org_plus[a] : out.org_minus[a];
        out.org_far[a] = out.near_side[a] == 0 ? out.org_minus[a] : out.org_plus[a];
    }
    constexpr int kNext[3] = {1, 2, 0};
    out.axis[0] = kNext[z_axis];
    out.axis[1] = kNext[kNext[z_axis]];
    out.axis[2] = z_axis;
}

/// Per lane: longest axis to z, the two after it in cyclic order to x and y.
template <int N, class Isa>
PACKET_INLINE Float3<N, Isa> rotate_axes(const PreparedRays<N, Isa>& ray,
                                         const Float<N, Isa> (&p)[3]) {
    return {select(ray.z_is_x, p[1], select(ray.z_is_y, p[2], p[0])),
            select(ray.z_is_x, p[2], select(ray.z_is_y, p[0], p[1])),
            select(ray.z_is_x, p[0], select(ray.z_is_y, p[1], p[2]))};
}

template <int N, class Isa>
PACKET_INLINE void prepare_triangles(PreparedRays<N, Isa>& out, const RayLanes<N, Isa>& ray,
                                     std::uint32_t active) {
    const auto x = abs(ray.dir[0]), y = abs(ray.dir[1]), z = abs(ray.dir[2]);
    out.z_is_x = (x >= y) & (x >= z);
    out.z_is_y = ~out.z_is_x & (y >= z);
    prepare_directions(out, active);

    const Float3<N, Isa> d = rotate_axes(out, ray.dir);
    out.shear_x = d.x / d.z;
    out.shear_y = d.y / d.z;
    out.scale_z = Float<N, Isa>(1.0f) / d.z;
    for (int a = 0; a < 3; ++a) {
        // Read by a constant index in each arm: a computed one would put the lanes into memory.
        const int from = out.axis[a];
        out.org[a] = from == 0 ? ray.org[0] : from == 1 ? ray.org[1] : ray.org[2];
    }
}

/// All of it, for rays whose `active` lanes are usable.
template <int N, class Isa>
PACKET_INLINE PreparedRays<N, Isa> prepare(const TreeView& tree, const RayLanes<N, Isa>& ray,
                                           std::uint32_t active) {
    PreparedRays<N, Isa> out;
    prepare_boxes(out, tree, ray);
    prepare_triangles(out, ray, active);
    return out;
}

/// One ray in all lanes.
template <int N, class Isa>
PACKET_INLINE RayLanes<N, Isa> broadcast(const RayLanes<1, Isa>& ray) {
    RayLanes<N, Isa> out;
    for (int a = 0; a < 3; ++a) {
        out.org[a] = ray.org[a].r[0];
        out.dir[a] = ray.dir[a].r[0];
    }
    out.tnear = ray.tnear.r[0];
    out.tfar = ray.tfar.r[0];
    return out;
}

}  // namespace packet
