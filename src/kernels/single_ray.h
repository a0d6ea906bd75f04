// Single rays, prepared eight at a time: the arithmetic is that of a packet, and each ray is then
// picked out of memory by broadcasts, which cost no more than any load.
#pragma once

#include "kernels/ray_setup.h"

namespace packet {

/// Rays are prepared this many at a time.
inline constexpr int kSingleLanes = 8;

/// What PreparedRays holds, in memory, by lane.
struct PreparedLanes {
    alignas(64) float tnear[kSingleLanes];
    float inv_dir[3][kSingleLanes], shift[2][3][kSingleLanes];
    float shear_org[3][kSingleLanes];  ///< in the order of the lane's axes
    float shear_x[kSingleLanes], shear_y[kSingleLanes], scale_z[kSingleLanes];
    float org[2][3][kSingleLanes], reciprocal[3][kSingleLanes];
    std::uint32_t negative[3];     ///< bit i: lane i goes down the axis
    std::uint32_t z_is_x, z_is_y;  ///< bit i: which is lane i's longest axis
};

template <class Isa>
PACKET_INLINE void prepare_lanes(const TreeView& tree, const RayLanes<kSingleLanes, Isa>& ray,
                                 PreparedLanes& out) {
    using F = Float<kSingleLanes, Isa>;
    PreparedRays<kSingleLanes, Isa> from;
    prepare_boxes(from, tree, ray);
    prepare_shear(from, ray);
    from.hit.tnear.store(out.tnear);
    const Float3<kSingleLanes, Isa> shear_org = rotate_axes(from.shear, ray.org);
    shear_org.x.store(out.shear_org[0]);
    shear_org.y.store(out.shear_org[1]);
    shear_org.z.store(out.shear_org[2]);
    from.shear.shear_x.store(out.shear_x);
    from.shear.shear_y.store(out.shear_y);
    from.hit.scale_z.store(out.scale_z);
    out.z_is_x = from.shear.z_is_x.bits();
    out.z_is_y = from.shear.z_is_y.bits();
    for (int a = 0; a < 3; ++a) {
        from.inv_dir[a].store(out.inv_dir[a]);
        from.hit.reciprocal[a].store(out.reciprocal[a]);
        out.negative[a] = (from.hit.reciprocal[a] < F(0.0f)).bits();
        for (int side = 0; side < 2; ++side) {
            from.shift[side][a].store(out.shift[side][a]);
            from.hit.org[side][a].store(out.org[side][a]);
        }
    }
}

/// The lanes of a packet, some at a time.
template <int N, class Isa>
PACKET_INLINE void prepare_lanes(const TreeView& tree, const RayLanes<N, Isa>& ray,
                                 PreparedLanes (&out)[N / kSingleLanes]) {
    using Some = Float<kSingleLanes, Isa>;
    float org[3][N], dir[3][N], tnear[N], tfar[N];
    for (int a = 0; a < 3; ++a) ray.org[a].store(org[a]), ray.dir[a].store(dir[a]);
    ray.tnear.store(tnear), ray.tfar.store(tfar);
    for (int first = 0; first < N; first += kSingleLanes) {
        RayLanes<kSingleLanes, Isa> some;
        for (int a = 0; a < 3; ++a) {
            some.org[a] = Some::load(org[a] + first);
            some.dir[a] = Some::load(dir[a] + first);
        }
        some.tnear = Some::load(tnear + first), some.tfar = Some::load(tfar + first);
        prepare_lanes(tree, some, out[first / kSingleLanes]);
    }
}

/// One ray in all lanes.
template <class Isa>
PACKET_INLINE RayLanes<kSingleLanes, Isa> broadcast(const RayLanes<1, Isa>& ray) {
    RayLanes<kSingleLanes, Isa> out;
    for (int a = 0; a < 3; ++a) {
        out.org[a] = ray.org[a].r[0];
        out.dir[a] = ray.dir[a].r[0];
    }
    out.tnear = ray.tnear.r[0];
    out.tfar = ray.tfar.r[0];
    return out;
}

/// One of the lanes.
struct SingleRay {
    const PreparedLanes& lanes;
    int lane;
    int near_side[3];  ///< per axis, the plane of a box that is met first
    int axis[3];       ///< those that become x, y, z

    PACKET_INLINE SingleRay(const PreparedLanes& from, int i) : lanes(from), lane(i) {
        for (int a = 0; a < 3; ++a) near_side[a] = static_cast<int>(from.negative[a] >> i & 1u);
        // x: y z x, y: z x y, z: x y z
        const int z = (from.z_is_x >> i & 1u) != 0 ? 0 : (from.z_is_y >> i & 1u) != 0 ? 1 : 2;
        axis[0] = z == 2 ? 0 : z + 1;
        axis[1] = z == 0 ? 2 : z - 1;
        axis[2] = z;
    }

    /// Fills what triangles need, the same in all lanes.
    template <int N, class Isa>
    PACKET_INLINE void broadcast(ShearRays<N, Isa>& out) const {
        for (int a = 0; a < 3; ++a) {
            out.org[a] = lanes.shear_org[a][lane];
            out.axis[a] = axis[a];
        }
        out.shear_x = lanes.shear_x[lane];
        out.shear_y = lanes.shear_y[lane];
    }
    /// Fills what decides, likewise.
    template <int N, class Isa>
    PACKET_INLINE void broadcast(HitRays<N, Isa>& out) const {
        out.scale_z = lanes.scale_z[lane];
        out.tnear = lanes.tnear[lane];
        for (int a = 0; a < 3; ++a) {
            out.reciprocal[a] = lanes.reciprocal[a][lane];
            for (int side = 0; side < 2; ++side) out.org[side][a] = lanes.org[side][a][lane];
        }
    }
};

}  // namespace packet
