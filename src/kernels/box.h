// The slab test: where rays enter and leave a box. It is the same arithmetic for nodes of every
// tree and for the boxes of triangles, and each step of it rounds monotonically. So a box that
// contains another is entered no later and left no earlier, to the last bit, and skipping it loses
// nothing.
#pragma once

#include "kernels/ray_setup.h"

namespace packet {

template <int N, class Isa>
struct Interval {
    Float<N, Isa> enter, exit;
};

/// Rays of mixed directions against a box. For each axis the order of its planes follows from dir.
template <int N, class Isa>
PACKET_INLINE Interval<N, Isa> slabs(const PreparedRays<N, Isa>& ray,
                                     const Float<N, Isa> (&lower)[3],
                                     const Float<N, Isa> (&upper)[3]) {
    Interval<N, Isa> out;
    for (int a = 0; a < 3; ++a) {
        const Float<N, Isa> t0 = (lower[a] - ray.org_plus[a]) * ray.inv_dir[a];
        const Float<N, Isa> t1 = (upper[a] - ray.org_minus[a]) * ray.inv_dir[a];
        out.enter = a == 0 ? min(t0, t1) : max(out.enter, min(t0, t1));
        out.exit = a == 0 ? max(t0, t1) : min(out.exit, max(t0, t1));
    }
    return out;
}

/// Rays against a node's box. With shared directions the near planes are picked by address; the
/// result is the same, as lower <= upper.
template <Directions directions, int N, class Isa>
PACKET_INLINE Interval<N, Isa> slabs(const PreparedRays<N, Isa>& ray, const Node& node) {
    using F = Float<N, Isa>;
    if constexpr (directions == Directions::kMixed) {
        const F lower[3] = {node.plane[0][0], node.plane[0][1], node.plane[0][2]};
        const F upper[3] = {node.plane[1][0], node.plane[1][1], node.plane[1][2]};
        return slabs(ray, lower, upper);
    } else {
        Interval<N, Isa> out;
        for (int a = 0; a < 3; ++a) {
            const int near = ray.near_side[a];
            const F t_near = (F(node.plane[near][a]) - ray.org_near[a]) * ray.inv_dir[a];
            const F t_far = (F(node.plane[1 - near][a]) - ray.org_far[a]) * ray.inv_dir[a];
            out.enter = a == 0 ? t_near : max(out.enter, t_near);
            out.exit = a == 0 ? t_far : min(out.exit, t_far);
        }
        return out;
    }
}

/// The lanes that may find something nearer than, or as near as, `best_t` in the box.
template <int N, class Isa>
PACKET_INLINE Mask<N, Isa> meets(const PreparedRays<N, Isa>& ray, const Interval<N, Isa>& box,
                                 const Float<N, Isa>& best_t) {
    // if (max(enter, tnear) > min(exit, best_t)) the lane misses; equal must pass, for the tie rule
    return max(box.enter, ray.tnear) <= min(box.exit, best_t);
}

}  // namespace packet
