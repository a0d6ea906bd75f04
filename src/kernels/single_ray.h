// Single rays, prepared eight at a time: the arithmetic is that of a packet, and each ray is then
// picked out of memory by broadcasts, which cost no more than any load.
#pragma once

#include "kernels/ray_setup.h"

namespace packet {

/// Rays are prepared this many at a time.
inline constexpr int kSingleLanes = 8;

/// What PreparedRays holds, in memory: a row holds a number of all rays, a column all numbers of a
/// ray, so these lie at fixed distances from each other.
struct PreparedLanes {
    enum Number {  // those of which there are three: one an axis
        kTnear,
        kInvDir,                   ///< for nodes, as the next two
        kNearShift = kInvDir + 3,  ///< for the planes that are met first
        kFarOrg = kNearShift + 3,  ///< of ExitOrigins
        kShearOrg = kFarOrg + 3,   ///< in the order of the ray's axes
        kShearX = kShearOrg + 3,
        kShearY,
        kScaleZ,
        kLowerOrg,  ///< for triangles' boxes, as the next two
        kUpperOrg = kLowerOrg + 3,
        kReciprocal = kUpperOrg + 3,
        kNumbers = kReciprocal + 3
    };
    enum Index {
        kNearPlanes,  ///< where in WideNode::plane those are that are met first
        kFarPlanes = kNearPlanes + 3,
        kAxis = kFarPlanes + 3,  ///< those that become x, y, z
        kIndices = kAxis + 3
    };
    alignas(64) float number[kNumbers][kSingleLanes];
    std::int32_t index[kIndices][kSingleLanes];
};

template <class Isa>
PACKET_INLINE void prepare_lanes(const TreeView& tree, const RayLanes<kSingleLanes, Isa>& ray,
                                 PreparedLanes& out) {
    using F = Float<kSingleLanes, Isa>;
    using I = Int<kSingleLanes, Isa>;
    using L = PreparedLanes;
    PreparedRays<kSingleLanes, Isa> from;
    prepare_boxes(from, tree, ray);
    prepare_shear(from, ray);
    const Float3<kSingleLanes, Isa> shear_org = rotate_axes(from.shear, ray.org);
    const ExitOrigins<kSingleLanes, Isa> exits(from, tree, ray);
    from.hit.tnear.store(out.number[L::kTnear]);
    shear_org.x.store(out.number[L::kShearOrg]);
    shear_org.y.store(out.number[L::kShearOrg + 1]);
    shear_org.z.store(out.number[L::kShearOrg + 2]);
    from.shear.shear_x.store(out.number[L::kShearX]);
    from.shear.shear_y.store(out.number[L::kShearY]);
    from.hit.scale_z.store(out.number[L::kScaleZ]);
    for (int a = 0; a < 3; ++a) {
        const auto backward = from.hit.reciprocal[a] < F(0.0f);
        const F &lower = from.shift[0][a], &upper = from.shift[1][a];
        from.inv_dir[a].store(out.number[L::kInvDir + a]);
        select(backward, upper, lower).store(out.number[L::kNearShift + a]);
        select(backward, exits.org[0][a], exits.org[1][a]).store(out.number[L::kFarOrg + a]);
        from.hit.org[0][a].store(out.number[L::kLowerOrg + a]);
        from.hit.org[1][a].store(out.number[L::kUpperOrg + a]);
        from.hit.reciprocal[a].store(out.number[L::kReciprocal + a]);

        const I lower_planes(a * kWideSize), upper_planes((3 + a) * kWideSize);
        select(backward, upper_planes, lower_planes).store(out.index[L::kNearPlanes + a]);
        select(backward, lower_planes, upper_planes).store(out.index[L::kFarPlanes + a]);
        // x: y z x, y: z x y, z: x y z
        select(from.shear.z_is_x, I((a + 1) % 3), select(from.shear.z_is_y, I((a + 2) % 3), I(a)))
            .store(out.index[L::kAxis + a]);
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

/// One of the rays.
class SingleRay {
public:
    PACKET_INLINE SingleRay(const PreparedLanes& from, int lane)
        : numbers_(from.number[0] + lane), indices_(from.index[0] + lane) {}

    PACKET_INLINE const float& number(int which) const {
        return numbers_[std::ptrdiff_t{which} * kSingleLanes];
    }
    PACKET_INLINE std::int32_t index(int which) const {
        return indices_[std::ptrdiff_t{which} * kSingleLanes];
    }
    PACKET_INLINE bool is_backward(int axis) const {
        return index(PreparedLanes::kNearPlanes + axis) != axis * kWideSize;
    }

private:
    const float* numbers_;
    const std::int32_t* indices_;
};

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
    using L = PreparedLanes;
    ShearRays<N, Isa> out;
    for (int a = 0; a < 3; ++a) {
        out.org[a] = ray.number(L::kShearOrg + a);
        out.axis[a] = ray.index(L::kAxis + a);
    }
    out.shear_x = ray.number(L::kShearX);
    out.shear_y = ray.number(L::kShearY);
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
        : tnear{&ray.number(PreparedLanes::kTnear)}, scale_z{&ray.number(PreparedLanes::kScaleZ)} {
        using L = PreparedLanes;
        for (int a = 0; a < 3; ++a) {
            org[0][a].number = &ray.number(L::kLowerOrg + a);
            org[1][a].number = &ray.number(L::kUpperOrg + a);
            reciprocal[a].number = &ray.number(L::kReciprocal + a);
        }
    }
};

}  // namespace packet
