// Single rays. What they need lies in memory, and each number is put into all lanes where it is
// used, by broadcasts that cost no more than any load. They are prepared with an axis a lane, which
// takes a third of the steps; the arithmetic that decides about hits is that of packets
// (ray_setup.h).
#pragma once

#include "kernels/ray_setup.h"

namespace packet {

/// A ray as it comes in, an axis a lane.
template <class Isa>
struct RayAxes {
    Axes<Isa> org, dir;
    float tnear, tfar;

    PACKET_INLINE explicit RayAxes(const Ray& ray)
        : tnear(ray.tnear < -kLargestFloat ? -kLargestFloat : ray.tnear), tfar(ray.tfar) {
        static_assert(sizeof(Ray) == 8 * sizeof(float));
        const auto* numbers = reinterpret_cast<const float*>(&ray);
        org = Axes<Isa>::load(numbers), dir = Axes<Isa>::load(numbers + 4);
    }
    template <int N>
    PACKET_INLINE RayAxes(const RayLanes<N, Isa>& rays, int lane)
        : org(axes<Isa>(lane_of(rays.org[0], lane), lane_of(rays.org[1], lane),
                        lane_of(rays.org[2], lane))),
          dir(axes<Isa>(lane_of(rays.dir[0], lane), lane_of(rays.dir[1], lane),
                        lane_of(rays.dir[2], lane))),
          tnear(lane_of(rays.tnear, lane)),
          tfar(lane_of(rays.tfar, lane)) {}
};

/// As for the lanes of a packet.
template <class Isa>
PACKET_INLINE bool usable(const RayAxes<Isa>& ray) {
    using F = Axes<Isa>;
    const F zero(0.0f);
    const F nothing = ray.org * zero + ray.dir * zero;  // NaN where a number is not finite
    return axis_bits(nothing == zero) == 7 && axis_bits(abs(ray.dir) >= F(kSmallestNormal)) != 0 &&
           ray.tnear <= ray.tfar;
}

/// As for the lanes of a packet: rounded in the same order.
template <class Isa>
PACKET_INLINE RayAxes<Isa> to_object(const InstanceView& instance, const RayAxes<Isa>& world) {
    using F = Axes<Isa>;
    const auto& m = instance.object_from_world;
    F column[4];
    for (int c = 0; c < 4; ++c) column[c] = axes<Isa>(m[0][c], m[1][c], m[2][c]);
    const auto turn = [&](const F& v) {
        return column[0] * permute<0, 0, 0>(v) + column[1] * permute<1, 1, 1>(v) +
               column[2] * permute<2, 2, 2>(v);
    };
    RayAxes<Isa> out = world;
    out.dir = turn(world.dir);
    out.org = turn(world.org) + column[3];
    return out;
}

/// A ray prepared for the boxes and triangles of one tree. Of four numbers the first three are
/// those of the axes.
struct SingleRay {
    /// For nodes: t = plane * inv_dir - near_shift for the planes that are met first, and for the
    /// others (plane - far_org) * inv_dir, by which a ray leaves no later than boxes of the
    /// contract's form, so that it leaves behind the surface that it starts next to.
    alignas(16) float inv_dir[4];
    alignas(16) float near_shift[4];
    alignas(16) float far_org[4];
    /// For triangles: the shear that turns the ray into the z axis, axes in its order.
    alignas(16) float shear_org[4];
    alignas(16) float shear[4];  ///< x, y
    /// For triangles' boxes, by the contract's form.
    alignas(16) float box_org[2][4];
    alignas(16) float reciprocal[4];
    /// Where in WideNode::plane those are that are met first, and the others.
    alignas(16) std::int32_t near_planes[4];
    alignas(16) std::int32_t far_planes[4];
    alignas(16) std::int32_t axis[4];  ///< those that become x, y, z
    float scale_z, tnear;

    [[nodiscard]] PACKET_INLINE bool is_backward(int a) const {
        return near_planes[a] != a * kWideSize;
    }
};

/// The orders of axes in which x, y or z comes last, as the bytes of three floats and of what comes
/// after them.
template <class Isa>
inline constexpr AxisOrder kLongestLast[3] = {
    {{4, 5, 6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 12, 13, 14, 15}, {1, 2, 0, 3}},
    {{8, 9, 10, 11, 0, 1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 15}, {2, 0, 1, 3}},
    {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}, {0, 1, 2, 3}}};

/// The first of the longest axes.
template <class Isa>
PACKET_INLINE int longest_axis(const Axes<Isa>& dir) {
    const Axes<Isa> length = abs(dir);
    // x >= y, y >= z, x >= z
    const std::uint32_t bits = axis_bits(permute<0, 1, 0>(length) >= permute<1, 2, 2>(length));
    // By these bits, two for each: x if it is neither less than y nor than z, else the greater.
    constexpr std::uint32_t kAxisByBits = 0x129a;
    return static_cast<int>(kAxisByBits >> 2 * bits & 3);
}

/// What nodes need of a steep ray, as lanes that are prepared by themselves have it.
template <class Isa>
PACKET_NOINLINE void prepare_steep_ray(SingleRay& out, const TreeView& tree,
                                       const RayAxes<Isa>& axes) {
    RayLanes<1, Isa> ray;
    float org[4], dir[4];
    axes.org.store(org), axes.dir.store(dir);
    for (int a = 0; a < 3; ++a) ray.org[a] = org[a], ray.dir[a] = dir[a];
    ray.tnear = axes.tnear, ray.tfar = axes.tfar;
    PreparedRays<1, Isa> from;
    prepare_boxes(from, tree, ray);
    const ExitOrigins<1, Isa> exits(from, tree, ray);
    for (int a = 0; a < 3; ++a) {
        const int near_side = out.is_backward(a) ? 1 : 0;
        out.inv_dir[a] = from.inv_dir[a].r[0];
        out.near_shift[a] = from.shift[near_side][a].r[0];
        out.far_org[a] = exits.org[1 - near_side][a].r[0];
    }
}

template <class Isa>
PACKET_INLINE void prepare(SingleRay& out, const TreeView& tree, const RayAxes<Isa>& ray) {
    using F = Axes<Isa>;
    using I = Int<4, Isa>;
    const F zero(0.0f);
    // by how much boxes are grown: as box_growth(), prepare_hits() and node_growth()
    const F far = max(ray.org - F::load(tree.lower), F::load(tree.upper) - ray.org);
    const F reach =
        max(zero, max(max(permute<0, 0, 0>(far), permute<1, 1, 1>(far)), permute<2, 2, 2>(far)));
    const F growth = (reach + F(tree.reach)) * F(tree.slack), distance = abs(ray.org);
    const F box_growth = growth + distance * F(kOriginSlack);
    const F node_growth = growth + growth + distance * F(4.0f * kOriginSlack);
    const F lower_org = ray.org + box_growth, upper_org = ray.org - box_growth;
    const F reciprocal = safe_reciprocal(ray.dir);
    lower_org.store(out.box_org[0]), upper_org.store(out.box_org[1]);
    reciprocal.store(out.reciprocal);

    const AxisOrder& order = kLongestLast<Isa>[longest_axis(ray.dir)];
    const F dir = permute(ray.dir, order);
    permute(ray.org, order).store(out.shear_org);
    (dir / permute<2, 2, 2>(dir)).store(out.shear);
    const F scale_z = permute<2, 2, 2>(permute(reciprocal, order));
    out.scale_z = lane_of(scale_z, 0);
    I::load(order.axis).store(out.axis);
    out.tnear = ray.tnear;

    constexpr std::int32_t kLower[4] = {0, kWideSize, 2 * kWideSize, 0};
    constexpr std::int32_t kUpper[4] = {3 * kWideSize, 4 * kWideSize, 5 * kWideSize, 0};
    const auto backward = reciprocal < zero;
    const F lower = (ray.org + node_growth) * reciprocal;
    const F upper = (ray.org - node_growth) * reciprocal;
    reciprocal.store(out.inv_dir);
    select(backward, upper, lower).store(out.near_shift);
    select(backward, lower_org, upper_org).store(out.far_org);
    select(backward, I::load(kUpper), I::load(kLower)).store(out.near_planes);
    select(backward, I::load(kLower), I::load(kUpper)).store(out.far_planes);
    // as prepare_nodes() has it
    const F limit = min(F(kLargestFloat), abs(scale_z) * F(kSteepest));
    const auto is_plain =
        (abs(reciprocal) <= limit) & (max(abs(lower), abs(upper)) <= F(kLargestFloat));
    if (axis_bits(is_plain) != 7) [[unlikely]]
        prepare_steep_ray(out, tree, ray);
}

/// One of the rays of a packet that share their directions, as far as triangles need it.
template <int N, class Isa>
struct PacketRay {
    const PreparedRays<N, Isa>& packet;
    int lane;

    PACKET_INLINE const float& operator()(const Float<N, Isa>& lanes) const {
        return lane_of(lanes, lane);
    }
};

/// What moves triangles into the ray's space, the same in all lanes.
template <int N, class Isa, int M>
PACKET_INLINE ShearRays<N, Isa> shear_of(const PacketRay<M, Isa>& ray) {
    const ShearRays<M, Isa>& from = ray.packet.shear;
    ShearRays<N, Isa> out;
    for (int a = 0; a < 3; ++a) {
        out.org[a] = ray(from.org[a]);
        out.axis[a] = from.axis[a];
    }
    out.shear_x = ray(from.shear_x);
    out.shear_y = ray(from.shear_y);
    return out;
}
template <int N, class Isa>
PACKET_INLINE ShearRays<N, Isa> shear_of(const SingleRay& ray) {
    ShearRays<N, Isa> out;
    for (int a = 0; a < 3; ++a) {
        out.org[a] = ray.shear_org[a];
        out.axis[a] = ray.axis[a];
    }
    out.shear_x = ray.shear[0];
    out.shear_y = ray.shear[1];
    return out;
}

/// HitRays of one ray: each number is put into all lanes where it is used, and until then takes no
/// register.
template <int N, class Isa>
struct SingleHitRay {
    struct Broadcast {
        const float* number;
        PACKET_INLINE operator Float<N, Isa>() const { return *number; }
    };
    Broadcast tnear, scale_z, org[2][3], reciprocal[3];

    template <int M>
    PACKET_INLINE explicit SingleHitRay(const PacketRay<M, Isa>& ray)
        : tnear{&ray(ray.packet.hit.tnear)}, scale_z{&ray(ray.packet.hit.scale_z)} {
        const HitRays<M, Isa>& from = ray.packet.hit;
        for (int a = 0; a < 3; ++a) {
            org[0][a].number = &ray(from.org[0][a]);
            org[1][a].number = &ray(from.org[1][a]);
            reciprocal[a].number = &ray(from.reciprocal[a]);
        }
    }
    PACKET_INLINE explicit SingleHitRay(const SingleRay& ray)
        : tnear{&ray.tnear}, scale_z{&ray.scale_z} {
        for (int a = 0; a < 3; ++a) {
            org[0][a].number = &ray.box_org[0][a];
            org[1][a].number = &ray.box_org[1][a];
            reciprocal[a].number = &ray.reciprocal[a];
        }
    }
};

}  // namespace packet
