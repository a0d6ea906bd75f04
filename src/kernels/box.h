// Where rays enter and leave boxes, in two forms. The contract's form is that of the triangles' own
// boxes, which decide about hits: the same bits everywhere. The quick form is that of nodes, which
// decide nothing: a multiply-add a plane, with boxes taken as grown by more, so that it never
// rejects a box that holds a triangle whose own box is met. In either form each step rounds
// monotonically, so a box that contains another is entered no later and left no earlier, to the
// last bit. Rays that go one by one leave nodes by the contract's form (ExitOrigins).
#pragma once

#include "kernels/ray_setup.h"

namespace packet {

template <int N, class Isa>
struct Interval {
    Float<N, Isa> enter, exit;
};

/// Rays against triangles' boxes. For each axis the order of its planes follows from dir.
template <class Rays, int N, class Isa>
PACKET_INLINE Interval<N, Isa> slabs(const Rays& ray, const Float<N, Isa> (&lower)[3],
                                     const Float<N, Isa> (&upper)[3]) {
    Interval<N, Isa> out;
    for (int a = 0; a < 3; ++a) {
        const Float<N, Isa> t0 = (lower[a] - ray.org[0][a]) * ray.reciprocal[a];
        const Float<N, Isa> t1 = (upper[a] - ray.org[1][a]) * ray.reciprocal[a];
        out.enter = a == 0 ? min(t0, t1) : max(out.enter, min(t0, t1));
        out.exit = a == 0 ? max(t0, t1) : min(out.exit, max(t0, t1));
    }
    return out;
}

/// The planes of a node's box, each in all lanes. With shared directions the planes that are met
/// first are picked by address; the result is the same, as lower <= upper.
template <Directions directions, int N, class Isa>
struct BoxPlanes {
    using F = Float<N, Isa>;
    F near[3], far[3];  ///< kMixed: lower and upper

    /// Of a wide node's child.
    PACKET_INLINE BoxPlanes(const WideNode& node, int child, const int (&near_side)[3]) {
        for (int a = 0; a < 3; ++a) {
            const int side = directions == Directions::kShared ? near_side[a] : 0;
            near[a] = node.plane[side][a][child];
            far[a] = node.plane[1 - side][a][child];
        }
    }
    PACKET_INLINE BoxPlanes(const Node& node, const int (&near_side)[3]) {
        for (int a = 0; a < 3; ++a) {
            const int side = directions == Directions::kShared ? near_side[a] : 0;
            near[a] = node.plane[side][a];
            far[a] = node.plane[1 - side][a];
        }
    }
    /// Where rays enter and leave the box.
    PACKET_INLINE Interval<N, Isa> slabs(const PreparedRays<N, Isa>& ray) const {
        Interval<N, Isa> out;
        for (int a = 0; a < 3; ++a) {
            const F t0 = multiply_subtract(near[a], ray.inv_dir[a], ray.shift[0][a]);
            const F t1 = multiply_subtract(far[a], ray.inv_dir[a], ray.shift[1][a]);
            const F t_near = directions == Directions::kShared ? t0 : min(t0, t1);
            const F t_far = directions == Directions::kShared ? t1 : max(t0, t1);
            out.enter = a == 0 ? t_near : max(out.enter, t_near);
            out.exit = a == 0 ? t_far : min(out.exit, t_far);
        }
        return out;
    }
};

/// The lanes that may find something nearer than, or as near as, `best_t` in the box.
template <int N, class Isa>
PACKET_INLINE Mask<N, Isa> meets(const PreparedRays<N, Isa>& ray, const Interval<N, Isa>& box,
                                 const Float<N, Isa>& best_t) {
    // if (max(enter, tnear) > min(exit, best_t)) the lane misses; equal must pass, for the tie rule
    return max(box.enter, ray.hit.tnear) <= min(box.exit, best_t);
}

}  // namespace packet
