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

inline constexpr float kLargestFloat = 3.402823466e38f;

/// Rays as they come in. Lanes that take no part hold a ray that hits nothing.
template <int N, class Isa>
struct RayLanes {
    using F = Float<N, Isa>;
    F org[3], dir[3], tnear, tfar;
};

/// What moves triangles into the space of rays: the shear that turns rays into the z axis.
template <int N, class Isa>
struct ShearRays {
    using F = Float<N, Isa>;
    using M = Mask<N, Isa>;

    F org[3];  ///< kShared: axes in the order `axis`, else x y z
    F shear_x, shear_y;
    M z_is_x, z_is_y;  ///< kMixed: which axis is longest
    int axis[3];       ///< kShared: the axes that become x, y, z; else 0 1 2
};

/// What decides where rays hit the triangles that they may hit. Arrays of two are indexed by the
/// side of a box: 0 its lower planes, 1 the upper ones.
template <int N, class Isa>
struct HitRays {
    using F = Float<N, Isa>;

    F tnear;
    F scale_z;  ///< t of a unit along the longest axis
    /// For triangles' boxes, by the contract's form: t = (plane - org[side]) * reciprocal.
    F org[2][3], reciprocal[3];
};

/// Rays prepared for the boxes and triangles of one tree.
template <int N, class Isa>
struct PreparedRays {
    using F = Float<N, Isa>;

    /// For nodes, by the quick form: t = plane * inv_dir - shift. kShared: [0] for the planes that
    /// are met first, [1] for the others; else for the lower and the upper planes.
    F inv_dir[3], shift[2][3];
    int near_side[3];  ///< kShared: per axis, the plane of a box that is met first
    Directions directions;
    F speed;  ///< along the longest axis, for a unit of t
    ShearRays<N, Isa> shear;
    HitRays<N, Isa> hit;
};

/// What the triangle test needs of one register's lanes, `axis` being ray.axis.
template <int N, class Isa>
PACKET_INLINE auto part(const ShearRays<N, Isa>& ray, const int (&axis)[3], int i) {
    ShearRays<kPartSize<N, Isa>, Isa> out;
    for (int a = 0; a < 3; ++a) {
        out.org[a] = part(ray.org[a], i);
        out.axis[a] = axis[a];
    }
    out.shear_x = part(ray.shear_x, i);
    out.shear_y = part(ray.shear_y, i);
    out.z_is_x = part(ray.z_is_x, i);
    out.z_is_y = part(ray.z_is_y, i);
    return out;
}
template <int N, class Isa>
PACKET_INLINE auto part(const HitRays<N, Isa>& ray, int i) {
    HitRays<kPartSize<N, Isa>, Isa> out;
    out.tnear = part(ray.tnear, i);
    out.scale_z = part(ray.scale_z, i);
    for (int a = 0; a < 3; ++a) {
        out.org[0][a] = part(ray.org[0][a], i);
        out.org[1][a] = part(ray.org[1][a], i);
        out.reciprocal[a] = part(ray.reciprocal[a], i);
    }
    return out;
}

/// 1 / x, or the largest float of x's sign where that overflows, so that 0 * 1/0 is no NaN.
template <int N, class Isa>
PACKET_INLINE Float<N, Isa> safe_reciprocal(const Float<N, Isa>& x) {
    return max(Float<N, Isa>(-kLargestFloat),
               min(Float<N, Isa>(kLargestFloat), Float<N, Isa>(1.0f) / x));
}

/// Lanes whose ray can hit anything: finite, ordered numbers, and 1 / dir is finite on some axis.
template <int N, class Isa>
PACKET_INLINE Mask<N, Isa> usable(const RayLanes<N, Isa>& ray) {
    using F = Float<N, Isa>;
    constexpr float kSmallestNormal = 1.175494351e-38f;
    Mask<N, Isa> ok = ray.tnear <= ray.tfar;
    for (int a = 0; a < 3; ++a) {
        ok = ok & (abs(ray.org[a]) <= F(kLargestFloat)) & (abs(ray.dir[a]) <= F(kLargestFloat));
    }
    // max(x, NaN) is NaN, but a NaN direction has been ruled out above
    const F longest = max(abs(ray.dir[0]), max(abs(ray.dir[1]), abs(ray.dir[2])));
    return ok & (longest >= F(kSmallestNormal));
}

/// object = M * world, rounded in this order on every ISA.
template <int N, class Isa>
PACKET_INLINE RayLanes<N, Isa> to_object(const InstanceView& instance,
                                         const RayLanes<N, Isa>& world) {
    using F = Float<N, Isa>;
    RayLanes<N, Isa> out;
    for (int row = 0; row < 3; ++row) {
        const float* m = instance.object_from_world[row];
        out.dir[row] = F(m[0]) * world.dir[0] + F(m[1]) * world.dir[1] + F(m[2]) * world.dir[2];
        out.org[row] =
            F(m[0]) * world.org[0] + F(m[1]) * world.org[1] + F(m[2]) * world.org[2] + F(m[3]);
    }
    out.tnear = world.tnear;
    out.tfar = world.tfar;
    return out;
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

/// By how much the quick form moves the origin along an axis, `growth` being that of the boxes.
template <int N, class Isa>
PACKET_INLINE Float<N, Isa> node_growth(const Float<N, Isa>& growth, const Float<N, Isa>& org) {
    return growth + growth + abs(org) * Float<N, Isa>(4.0f * kOriginSlack);
}

/// The quick form takes boxes as grown by 8 ulp of the reach and 3 of the origin more than the
/// contract's form, so that it rejects no box in which that finds a triangle's. It bounds
/// reciprocals by 2^32 times that of the longest axis; what drift this neglects is less than the
/// growth. Where a product overflows still, the planes of that axis hold nothing back. See
/// docs/decisions/box-slack.md.
template <int N, class Isa>
PACKET_INLINE void prepare_nodes(PreparedRays<N, Isa>& out, const RayLanes<N, Isa>& ray,
                                 const Float<N, Isa>& growth) {
    using F = Float<N, Isa>;
    constexpr float kSteepest = 0x1p32f;
    constexpr float kInfinity = __builtin_huge_valf();
    const F(&reciprocal)[3] = out.hit.reciprocal;
    const F least = min(abs(reciprocal[0]), min(abs(reciprocal[1]), abs(reciprocal[2])));
    const F limit = min(F(kLargestFloat), least * F(kSteepest));
    for (int a = 0; a < 3; ++a) {
        const F inv_dir = max(F(0.0f) - limit, min(limit, reciprocal[a]));
        const F more = node_growth(growth, ray.org[a]);
        const F lower = (ray.org[a] + more) * inv_dir, upper = (ray.org[a] - more) * inv_dir;
        // if (|lower| > largest || |upper| > largest) 0 * plane - shift is -inf or inf, which
        // passes
        const Mask<N, Isa> fits = max(abs(lower), abs(upper)) <= F(kLargestFloat);
        const F open = select(inv_dir < F(0.0f), F(-kInfinity), F(kInfinity));
        out.inv_dir[a] = select(fits, inv_dir, F(0.0f));
        out.shift[0][a] = select(fits, lower, open);
        out.shift[1][a] = select(fits, upper, F(0.0f) - open);
    }
}

/// Origins by which rays leave nodes no later than boxes of the contract's form, so that they leave
/// behind the surface that they start next to: t = (plane - org[side][axis]) * inv_dir. Where
/// inv_dir is less than the contract's, they are moved as far as by the quick form; where it is 0,
/// t is NaN, and the plane holds nothing back if min() takes that first.
template <int N, class Isa>
struct ExitOrigins {
    using F = Float<N, Isa>;
    F org[2][3];

    PACKET_INLINE ExitOrigins(const PreparedRays<N, Isa>& from, const TreeView& tree,
                              const RayLanes<N, Isa>& ray) {
        const F infinity(__builtin_huge_valf()), growth = box_growth(tree, ray);
        for (int a = 0; a < 3; ++a) {
            const F more = node_growth(growth, ray.org[a]);
            const auto is_exact = from.inv_dir[a] == from.hit.reciprocal[a];
            const auto is_open = from.inv_dir[a] == F(0.0f);
            const F lower = select(is_open, infinity, ray.org[a] + more);
            const F upper = select(is_open, F(0.0f) - infinity, ray.org[a] - more);
            org[0][a] = select(is_exact, from.hit.org[0][a], lower);
            org[1][a] = select(is_exact, from.hit.org[1][a], upper);
        }
    }
};

template <int N, class Isa>
PACKET_INLINE void prepare_boxes(PreparedRays<N, Isa>& out, const TreeView& tree,
                                 const RayLanes<N, Isa>& ray) {
    using F = Float<N, Isa>;
    const F e = box_growth(tree, ray);
    for (int a = 0; a < 3; ++a) {
        // Far from the world's origin org + e would round back to org: a further ulp of org stays.
        const F growth = e + abs(ray.org[a]) * F(kOriginSlack);
        out.hit.org[0][a] = ray.org[a] + growth;
        out.hit.org[1][a] = ray.org[a] - growth;
        out.hit.reciprocal[a] = safe_reciprocal(ray.dir[a]);
    }
    prepare_nodes(out, ray, e);
    out.hit.tnear = ray.tnear;
}

/// Notes whether the active lanes share octant and longest axis, and if so, which; then puts shifts
/// into the order in which planes are met.
template <int N, class Isa>
PACKET_INLINE void prepare_directions(PreparedRays<N, Isa>& out, std::uint32_t active) {
    out.directions = Directions::kShared;
    const std::uint32_t x = out.shear.z_is_x.bits() & active;
    const std::uint32_t y = out.shear.z_is_y.bits() & active;
    const int z_axis = x != 0 ? 0 : y != 0 ? 1 : 2;
    if ((x != 0 && x != active) || (y != 0 && y != active)) out.directions = Directions::kMixed;
    for (int a = 0; a < 3; ++a) {
        const std::uint32_t negative =
            (out.hit.reciprocal[a] < Float<N, Isa>(0.0f)).bits() & active;
        if (negative != 0 && negative != active) out.directions = Directions::kMixed;
        out.near_side[a] = negative != 0 ? 1 : 0;
    }
    for (int a = 0; a < 3 && out.directions == Directions::kShared; ++a) {
        if (out.near_side[a] == 0) continue;
        const Float<N, Isa> lower = out.shift[0][a];
        out.shift[0][a] = out.shift[1][a];
        out.shift[1][a] = lower;
    }
    constexpr int kNext[3] = {1, 2, 0};
    const int z = out.directions == Directions::kShared ? z_axis : 2;
    out.shear.axis[0] = kNext[z];
    out.shear.axis[1] = kNext[kNext[z]];
    out.shear.axis[2] = z;
}

/// Per lane: longest axis to z, the two after it in cyclic order to x and y.
template <int N, class Isa>
PACKET_INLINE Float3<N, Isa> rotate_axes(const ShearRays<N, Isa>& ray,
                                         const Float<N, Isa> (&p)[3]) {
    return {select(ray.z_is_x, p[1], select(ray.z_is_y, p[2], p[0])),
            select(ray.z_is_x, p[2], select(ray.z_is_y, p[0], p[1])),
            select(ray.z_is_x, p[0], select(ray.z_is_y, p[1], p[2]))};
}

/// After prepare_boxes().
template <int N, class Isa>
PACKET_INLINE void prepare_shear(PreparedRays<N, Isa>& out, const RayLanes<N, Isa>& ray) {
    ShearRays<N, Isa>& shear = out.shear;
    const auto x = abs(ray.dir[0]), y = abs(ray.dir[1]), z = abs(ray.dir[2]);
    shear.z_is_x = (x >= y) & (x >= z);
    shear.z_is_y = ~shear.z_is_x & (y >= z);
    const Float3<N, Isa> d = rotate_axes(shear, ray.dir);
    shear.shear_x = d.x / d.z;
    shear.shear_y = d.y / d.z;
    out.speed = abs(d.z);
    // 1 / d.z: the longest axis is long enough.
    out.hit.scale_z = rotate_axes(shear, out.hit.reciprocal).z;
}

/// All of it for a packet, whose `active` lanes are usable.
template <int N, class Isa>
PACKET_INLINE void prepare(PreparedRays<N, Isa>& out, const TreeView& tree,
                           const RayLanes<N, Isa>& ray, std::uint32_t active) {
    prepare_boxes(out, tree, ray);
    prepare_shear(out, ray);
    prepare_directions(out, active);
    for (int a = 0; a < 3; ++a) {
        // Read by a constant index in each arm: a computed one would put the lanes into memory.
        const int from = out.shear.axis[a];
        out.shear.org[a] = from == 0 ? ray.org[0] : from == 1 ? ray.org[1] : ray.org[2];
    }
}

}  // namespace packet
