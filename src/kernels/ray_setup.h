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
inline constexpr float kSmallestNormal = 1.175494351e-38f;
/// A ray is steep if a reciprocal is more than so many times that of its longest axis.
inline constexpr float kSteepest = 0x1p32f;

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
    int near_side[3];  ///< kShared: per axis, the plane of a box that is met first; else 0
    Directions directions;
    bool is_steep;  ///< some lane's quick form may take other reciprocals than the contract's
    F speed;        ///< along the longest axis, for a unit of t
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
    const F zero(0.0f);
    // NaN where a number is not finite, as 0 times it is; else 0, fused or not
    F nothing(0.0f);
    for (int a = 0; a < 3; ++a) {
        nothing = multiply_subtract(ray.org[a], zero, nothing);
        nothing = multiply_subtract(ray.dir[a], zero, nothing);
    }
    // max(x, NaN) is NaN, but a NaN direction is ruled out
    const F longest = max(abs(ray.dir[0]), max(abs(ray.dir[1]), abs(ray.dir[2])));
    return (ray.tnear <= ray.tfar) & (nothing == zero) & (longest >= F(kSmallestNormal));
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
        reach = max(reach, max(ray.org[a] - F(tree.lower[a]), F(tree.upper[a]) - ray.org[a]));
    }
    return (reach + F(tree.reach)) * F(tree.slack);
}

/// By how much the quick form moves the origin along an axis, `growth` being that of the boxes.
template <int N, class Isa>
PACKET_INLINE Float<N, Isa> node_growth(const Float<N, Isa>& growth, const Float<N, Isa>& org) {
    return growth + growth + abs(org) * Float<N, Isa>(4.0f * kOriginSlack);
}

/// Of an axis, by sides of boxes; kept in the order in which these are met.
template <int N, class Isa>
PACKET_INLINE void set_shifts(PreparedRays<N, Isa>& out, int a, const Float<N, Isa>& lower,
                              const Float<N, Isa>& upper) {
    // Not indexed by the side: a tile's packets all go one way.
    if (out.near_side[a] == 0) {
        out.shift[0][a] = lower;
        out.shift[1][a] = upper;
    } else {
        out.shift[0][a] = upper;
        out.shift[1][a] = lower;
    }
}

/// As prepare_nodes(), where some of the rays are steep, all but parallel to an axis. It bounds
/// reciprocals by 2^32 times that of the longest axis; what drift this neglects is less than the
/// growth. Where a product overflows still, the planes of that axis hold nothing back.
template <int N, class Isa>
PACKET_NOINLINE_ON_CPU void prepare_steep_nodes(PreparedRays<N, Isa>& out,
                                                const RayLanes<N, Isa>& ray,
                                                const Float<N, Isa>& growth,
                                                const Float<N, Isa>& limit) {
    using F = Float<N, Isa>;
    constexpr float kInfinity = __builtin_huge_valf();
    for (int a = 0; a < 3; ++a) {
        const F inv_dir = max(F(0.0f) - limit, min(limit, out.hit.reciprocal[a]));
        const F more = node_growth(growth, ray.org[a]);
        const F lower = (ray.org[a] + more) * inv_dir, upper = (ray.org[a] - more) * inv_dir;
        // if (|lower| > largest || |upper| > largest) 0 * plane - shift is -inf or inf, which
        // passes
        const Mask<N, Isa> fits = max(abs(lower), abs(upper)) <= F(kLargestFloat);
        const F open = select(inv_dir < F(0.0f), F(-kInfinity), F(kInfinity));
        out.inv_dir[a] = select(fits, inv_dir, F(0.0f));
        set_shifts(out, a, select(fits, lower, open), select(fits, upper, F(0.0f) - open));
    }
}

/// The quick form takes boxes as grown by 8 ulp of the reach and 3 of the origin more than the
/// contract's form, so that it rejects no box in which that finds a triangle's. See
/// docs/decisions/box-slack.md.
template <int N, class Isa>
PACKET_INLINE void prepare_nodes(PreparedRays<N, Isa>& out, const RayLanes<N, Isa>& ray,
                                 const Float<N, Isa>& growth) {
    using F = Float<N, Isa>;
    F least, most, farthest, more[3];
    for (int a = 0; a < 3; ++a) {
        const F size = abs(out.hit.reciprocal[a]), distance = abs(ray.org[a]);
        more[a] = node_growth(growth, ray.org[a]);
        least = a == 0 ? size : min(least, size);
        most = a == 0 ? size : max(most, size);
        farthest = a == 0 ? distance + more[a] : max(farthest, distance + more[a]);
    }
    const F limit = min(F(kLargestFloat), least * F(kSteepest));
    // false for NaN, as lanes have it that take no part
    const Mask<N, Isa> is_plain = (most <= limit) & (farthest * most <= F(kLargestFloat));
    out.is_steep = any(~is_plain);
    if (out.is_steep) [[unlikely]]
        return prepare_steep_nodes(out, ray, growth, limit);
    for (int a = 0; a < 3; ++a) {
        const F& inv_dir = out.hit.reciprocal[a];
        out.inv_dir[a] = inv_dir;
        set_shifts(out, a, (ray.org[a] + more[a]) * inv_dir, (ray.org[a] - more[a]) * inv_dir);
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
        for (int a = 0; a < 3; ++a) {
            org[0][a] = from.hit.org[0][a];
            org[1][a] = from.hit.org[1][a];
        }
        if (from.is_steep) [[unlikely]]
            correct(from, tree, ray);
    }

private:
    PACKET_NOINLINE void correct(const PreparedRays<N, Isa>& from, const TreeView& tree,
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

/// For boxes by the contract's form; returns by how much they are grown.
template <int N, class Isa>
PACKET_INLINE Float<N, Isa> prepare_hits(HitRays<N, Isa>& out, const TreeView& tree,
                                         const RayLanes<N, Isa>& ray) {
    using F = Float<N, Isa>;
    const F e = box_growth(tree, ray);
    for (int a = 0; a < 3; ++a) {
        // Far from the world's origin org + e would round back to org: a further ulp of org stays.
        const F growth = e + abs(ray.org[a]) * F(kOriginSlack);
        out.org[0][a] = ray.org[a] + growth;
        out.org[1][a] = ray.org[a] - growth;
        out.reciprocal[a] = safe_reciprocal(ray.dir[a]);
    }
    out.tnear = ray.tnear;
    return e;
}

/// For boxes in either form, of lanes that may go anywhere.
template <int N, class Isa>
PACKET_INLINE void prepare_boxes(PreparedRays<N, Isa>& out, const TreeView& tree,
                                 const RayLanes<N, Isa>& ray) {
    for (int& side : out.near_side) side = 0;
    prepare_nodes(out, ray, prepare_hits(out.hit, tree, ray));
}

template <int N, class Isa>
PACKET_INLINE void find_longest_axis(ShearRays<N, Isa>& out, const RayLanes<N, Isa>& ray) {
    const auto x = abs(ray.dir[0]), y = abs(ray.dir[1]), z = abs(ray.dir[2]);
    out.z_is_x = (x >= y) & (x >= z);
    out.z_is_y = ~out.z_is_x & (y >= z);
}

/// Notes whether the active lanes share octant and longest axis, and if so, which.
template <int N, class Isa>
PACKET_INLINE void prepare_directions(PreparedRays<N, Isa>& out, std::uint32_t active) {
    std::uint32_t differ = 0;
    const auto any_of = [&](Mask<N, Isa> lanes) {
        const std::uint32_t bits = lanes.bits() & active;
        differ |= bits != 0 ? bits ^ active : 0;
        return bits != 0;
    };
    constexpr int kAxes[3][3] = {{1, 2, 0}, {2, 0, 1}, {0, 1, 2}};
    const bool is_x = any_of(out.shear.z_is_x), is_y = any_of(out.shear.z_is_y);
    int z = is_x ? 0 : is_y ? 1 : 2;
    for (int a = 0; a < 3; ++a) {
        out.near_side[a] = any_of(out.hit.reciprocal[a] < Float<N, Isa>(0.0f)) ? 1 : 0;
    }
    out.directions = Directions::kShared;
    if (differ != 0) [[unlikely]] {
        out.directions = Directions::kMixed;
        for (int& side : out.near_side) side = 0;
        z = 2;
    }
    for (int i = 0; i < 3; ++i) out.shear.axis[i] = kAxes[z][i];
}

/// Per lane: longest axis to z, the two after it in cyclic order to x and y.
template <int N, class Isa>
PACKET_INLINE Float3<N, Isa> rotate_axes(const ShearRays<N, Isa>& ray,
                                         const Float<N, Isa> (&p)[3]) {
    return {select(ray.z_is_x, p[1], select(ray.z_is_y, p[2], p[0])),
            select(ray.z_is_x, p[2], select(ray.z_is_y, p[0], p[1])),
            select(ray.z_is_x, p[0], select(ray.z_is_y, p[1], p[2]))};
}

/// `dir` and the reciprocal with the longest axis as z.
template <int N, class Isa>
PACKET_INLINE void set_shear(PreparedRays<N, Isa>& out, const Float3<N, Isa>& dir,
                             const Float<N, Isa>& reciprocal_z) {
    out.shear.shear_x = dir.x / dir.z;
    out.shear.shear_y = dir.y / dir.z;
    out.speed = abs(dir.z);
    out.hit.scale_z = reciprocal_z;  // 1 / dir.z: the longest axis is long enough
}

/// After prepare_hits(), of lanes that may go anywhere.
template <int N, class Isa>
PACKET_INLINE void prepare_shear(PreparedRays<N, Isa>& out, const RayLanes<N, Isa>& ray) {
    find_longest_axis(out.shear, ray);
    set_shear(out, rotate_axes(out.shear, ray.dir), rotate_axes(out.shear, out.hit.reciprocal).z);
}

/// All of it for a packet, whose `active` lanes are usable.
template <int N, class Isa>
PACKET_INLINE void prepare(PreparedRays<N, Isa>& out, const TreeView& tree,
                           const RayLanes<N, Isa>& ray, std::uint32_t active) {
    const Float<N, Isa> growth = prepare_hits(out.hit, tree, ray);
    find_longest_axis(out.shear, ray);
    prepare_directions(out, active);
    prepare_nodes(out, ray, growth);
    const int(&axis)[3] = out.shear.axis;
    if (out.directions == Directions::kShared) [[likely]] {
        set_shear(out, Float3<N, Isa>{ray.dir[axis[0]], ray.dir[axis[1]], ray.dir[axis[2]]},
                  out.hit.reciprocal[axis[2]]);
    } else {
        prepare_shear(out, ray);
    }
    for (int i = 0; i < 3; ++i) out.shear.org[i] = ray.org[axis[i]];
}

}  // namespace packet
