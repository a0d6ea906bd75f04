// Walks a grid with a packet of rays, slice by slice along the axis that its first ray runs along
// most: in each slice the bricks that any lane may meet are those of a rectangle, and each of these
// is met by the lanes that meet its own box. Lanes that go into another octant, and all lanes where
// they have spread too far, walk alone.
//
// Wald, Ize, Kensler, Knoll, Parker. Ray tracing animated scenes using coherent grid traversal.
// TOG 2006.
#pragma once

#include "kernels/grid_walk.h"

namespace packet {

/// Slices of more bricks than this are left to single rays.
inline constexpr int kWidestSlice = 24;
/// As are packets of fewer lanes.
inline constexpr int kFewestLanes = 3;

/// The slabs of one axis, as in MarchAxis, for the lanes of a packet.
template <int N, class Isa>
struct PacketAxis {
    const float* planes;
    std::ptrdiff_t stride;
    int count;
    Float<N, Isa> org_near, org_far, inv_dir;

    PACKET_INLINE Float<N, Isa> enter(int i) const {
        return (Float<N, Isa>(planes[i * stride]) - org_near) * inv_dir;
    }
    PACKET_INLINE Float<N, Isa> exit(int i) const {
        return (Float<N, Isa>(planes[(i + 1) * stride]) - org_far) * inv_dir;
    }
};

/// Reverses the order of neighbouring groups of `width` bits, four at a time.
PACKET_INLINE std::uint64_t flip_fours(std::uint64_t bits, int width) {
    const std::uint64_t first = width == 1   ? 0x1111111111111111u
                                : width == 4 ? 0x000F000F000F000Fu
                                             : 0x000000000000FFFFu;
    return (bits & first) << 3 * width | (bits & first << width) << width |
           (bits >> width & first << width) | (bits >> 3 * width & first);
}

/// What all lanes of a packet share in a grid.
template <int N, class Isa>
struct GridPacket {
    using F = Float<N, Isa>;

    PacketAxis<N, Isa> axis[3];  ///< [0] is the axis of slices
    std::int32_t brick_step[3], first_brick = 0;
    int order[3];         ///< which of x, y, z these are
    std::uint32_t lanes;  ///< those that go into the packet's octant
    std::uint32_t flipped = 0;
    F enter, exit;  ///< of the grid

    PACKET_INLINE GridPacket(const GridView& grid, const PreparedRays<N, Isa>& ray,
                             std::uint32_t active)
        : lanes(active) {
        const int lead = __builtin_ctz(active);
        order[0] = (ray.shear.z_is_x.bits() >> lead & 1) != 0   ? 0
                   : (ray.shear.z_is_y.bits() >> lead & 1) != 0 ? 1
                                                                : 2;
        order[1] = order[0] == 2 ? 0 : order[0] + 1;
        order[2] = order[0] == 0 ? 2 : order[0] - 1;
        for (int i = 0; i < 3; ++i) {
            const int a = order[i];
            const std::uint32_t negative = (ray.hit.reciprocal[a] < F(0.0f)).bits();
            const bool backward = (negative >> lead & 1) != 0;
            const int count = grid.brick_count[a];
            const std::int32_t step =
                a == 0 ? 1 : grid.brick_count[0] * (a == 1 ? 1 : grid.brick_count[1]);
            lanes &= backward ? negative : ~negative;
            axis[i] = {backward ? grid.planes[a] + count * kBrickSide : grid.planes[a],
                       backward ? -kBrickSide : kBrickSide,
                       count,
                       backward ? ray.hit.org[1][a] : ray.hit.org[0][a],
                       backward ? ray.hit.org[0][a] : ray.hit.org[1][a],
                       ray.hit.reciprocal[a]};
            first_brick += backward ? (count - 1) * step : 0;
            brick_step[i] = backward ? -step : step;
            flipped |= backward ? 3u << 2 * a : 0u;
            enter = i == 0 ? axis[0].enter(0) : max(enter, axis[i].enter(0));
            exit = i == 0 ? axis[0].exit(count - 1) : min(exit, axis[i].exit(count - 1));
        }
        enter = max(enter, ray.hit.tnear);
    }
};

/// Where lanes cross the four cells of a brick along each axis, x, y and z in the packet's order.
template <int N, class Isa>
struct BrickCrossings {
    Float<N, Isa> enter[3][kBrickSide], exit[3][kBrickSide];

    PACKET_INLINE BrickCrossings(const GridPacket<N, Isa>& packet, const int (&brick)[3]) {
        for (int i = 0; i < 3; ++i) {
            PacketAxis<N, Isa> cells = packet.axis[i];
            cells.planes += brick[i] * cells.stride;
            cells.stride /= kBrickSide;
            for (int c = 0; c < kBrickSide; ++c) {
                enter[packet.order[i]][c] = cells.enter(c);
                exit[packet.order[i]][c] = cells.exit(c);
            }
        }
    }
};

/// The lanes meet what is in a brick that is not empty; `brick` counts in the packet's order.
template <Query query, int N, class Isa, class Stats>
PACKET_INLINE void walk_brick(const TreeView& tree, const GridPacket<N, Isa>& packet,
                              const GridBrick& brick, const int (&place)[3],
                              const PreparedRays<N, Isa>& ray, std::int32_t instance_id,
                              Mailbox<Isa>& mailbox, BestHits<N, Isa>& best, Stats& stats) {
    const BrickCrossings<N, Isa> crossings(packet, place);
    std::uint64_t in_order = brick.occupied;
    for (int a = 0; a < 3; ++a) {
        if ((packet.flipped >> 2 * a & 1) != 0) in_order = flip_fours(in_order, 1 << 2 * a);
    }
    // From the packet's near corner on: no cell comes before one that hides it.
    for (; in_order != 0; in_order &= in_order - 1) {
        const auto at = static_cast<std::uint32_t>(__builtin_ctzll(in_order));
        const auto &x = at & 3, &y = at >> 2 & 3, &z = at >> 4;
        const auto enter =
            max(max(crossings.enter[0][x], crossings.enter[1][y]), crossings.enter[2][z]);
        const auto exit =
            min(min(crossings.exit[0][x], crossings.exit[1][y]), crossings.exit[2][z]);
        // if (max(enter, tnear) > min(exit, best_t)) the lane misses; equal must pass
        const Mask<N, Isa> active = max(enter, ray.hit.tnear) <= min(exit, best.t);
        if (none(active)) continue;
        stats.visit(count(active), N);
        meet_cell<query>(tree, cell_of_bit(tree.grid, brick, at ^ packet.flipped), ray, active,
                         instance_id, mailbox, best, stats);
    }
}

/// The lanes of `bits` walk the grid one after the other, from `from` on.
template <Query query, int N, class Isa, class Stats>
[[gnu::noinline]] void walk_grid_alone(const TreeView& tree, const RayLanes<N, Isa>& ray,
                                       const Float<N, Isa>& from, std::uint32_t bits,
                                       std::int32_t instance_id, BestHits<N, Isa>& best,
                                       Stats& stats) {
    float start[N], t[N], u[N], v[N];
    std::int32_t prim_id[N], instance[N], tie[N];
    from.store(start);
    best.t.store(t), best.u.store(u), best.v.store(v);
    best.prim_id.store(prim_id), best.instance_id.store(instance), best.tie_prim_id.store(tie);
    for (; bits != 0; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        SingleRay one;
        prepare(one, tree, RayAxes<Isa>(ray, i));
        BestHits<1, Isa> hit(t[i], Mask<1, Isa>::from_bits(1));
        hit.t = t[i], hit.u = u[i], hit.v = v[i];
        hit.prim_id = prim_id[i], hit.instance_id = instance[i], hit.tie_prim_id = tie[i];
        walk_grid<query>(tree, one, start[i], instance_id, hit, stats);
        hit.t.store(t + i), hit.u.store(u + i), hit.v.store(v + i);
        hit.prim_id.store(prim_id + i), hit.instance_id.store(instance + i);
        hit.tie_prim_id.store(tie + i);
    }
    best.t = Float<N, Isa>::load(t), best.u = Float<N, Isa>::load(u);
    best.v = Float<N, Isa>::load(v);
    best.prim_id = Int<N, Isa>::load(prim_id);
    best.instance_id = Int<N, Isa>::load(instance);
    best.tie_prim_id = Int<N, Isa>::load(tie);
}

/// Which slabs of an axis lanes may meet in a slice. Both ends only ever move on: what a lane that
/// comes into the grid later will meet counts for the first from the start.
struct SliceRange {
    int first = 0, last = 0;

    /// The lanes are in the slice from `enter` to `exit`, those that are not, or not yet, never.
    template <int N, class Isa>
    PACKET_INLINE void move_on(const PacketAxis<N, Isa>& axis, const Float<N, Isa>& enter,
                               const Float<N, Isa>& exit) {
        while (first + 1 < axis.count && none(axis.exit(first) >= enter)) ++first;
        last = last < first ? first : last;
        while (last + 1 < axis.count && any(axis.enter(last + 1) <= exit)) ++last;
    }
    [[nodiscard]] PACKET_INLINE int count() const { return last - first + 1; }
};

/// Lanes with best.t = kNever take no part. Returns the lanes that must go on alone, and sets
/// `from` to where.
template <Query query, int N, class Isa, class Stats>
PACKET_INLINE std::uint32_t walk_slices(const TreeView& tree, const GridPacket<N, Isa>& packet,
                                        const PreparedRays<N, Isa>& ray, std::int32_t instance_id,
                                        Float<N, Isa>& from, BestHits<N, Isa>& best, Stats& stats) {
    using F = Float<N, Isa>;
    const PacketAxis<N, Isa>& slices = packet.axis[0];
    Mailbox<Isa> mailbox;
    SliceRange u, v;
    for (int slice = 0; slice < slices.count; ++slice) {
        from = max(slices.enter(slice), packet.enter);
        const F end = min(packet.exit, best.t);
        const Mask<N, Isa> alive = from <= end;
        if (none(alive)) return 0;
        const F to = min(slices.exit(slice), end);
        const Mask<N, Isa> active = from <= to;
        if (none(active)) continue;
        const F enter = select(alive, from, F(__builtin_huge_valf()));
        const F exit = select(active, to, F(kNever));
        u.move_on(packet.axis[1], enter, exit);
        v.move_on(packet.axis[2], enter, exit);
        if (u.count() * v.count() > kWidestSlice) return alive.bits();
        stats.visit(count(active), N);
        for (int j = v.first; j <= v.last; ++j) {
            for (int i = u.first; i <= u.last; ++i) {
                const GridBrick& brick =
                    tree.grid.bricks[packet.first_brick + slice * packet.brick_step[0] +
                                     i * packet.brick_step[1] + j * packet.brick_step[2]];
                if (brick.occupied == 0) continue;
                const int place[3] = {slice, i, j};
                walk_brick<query>(tree, packet, brick, place, ray, instance_id, mailbox, best,
                                  stats);
            }
        }
    }
    return 0;
}

/// The lanes of `active`, which are not none, meet what is in the grid.
template <Query query, int N, class Isa, class Stats>
[[gnu::noinline]] void walk_grid(const TreeView& tree, const RayLanes<N, Isa>& ray,
                                 const PreparedRays<N, Isa>& prepared, Mask<N, Isa> active,
                                 std::int32_t instance_id, BestHits<N, Isa>& best, Stats& stats) {
    using F = Float<N, Isa>;
    const GridPacket<N, Isa> packet(tree.grid, prepared, active.bits());
    Mask<N, Isa> together = Mask<N, Isa>::from_bits(packet.lanes);
    if (count(together) < kFewestLanes) together = Mask<N, Isa>::from_bits(0);
    const F kept = best.t;
    best.t = select(together, best.t, F(kNever));
    F from = packet.enter;
    std::uint32_t left = 0;
    if (any(together)) {
        left = walk_slices<query>(tree, packet, prepared, instance_id, from, best, stats);
    }
    best.t = select(together, best.t, kept);
    const Mask<N, Isa> alone = active & ~together;
    const std::uint32_t bits = left | alone.bits();
    from = select(alone, F(kNever), from);
    if (bits != 0) walk_grid_alone<query>(tree, ray, from, bits, instance_id, best, stats);
}

}  // namespace packet
