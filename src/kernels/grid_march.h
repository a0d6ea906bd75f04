// Which cells of a grid a ray meets, and in what order: a 3D-DDA whose steps are comparisons of the
// box test's own numbers, so that it cannot lose a cell to rounding.
//
// A plain DDA steps along the exact line. Here cells, like all boxes, count as grown by the ray's
// slack: neighbours overlap, and a ray is for a moment in both. Along each axis cells are entered
// one after the other and left one after the other, as rounding is monotone. So at any t the cells
// that the ray is in are those from `first` to `last` on each axis, and the cells it meets are
// those that are in this range at some t. The march goes from one entry of a plane to the next; all
// cells that the ray enters there are new, and those in range on the other axes. Each cell with
// max(enter) <= min(exit) comes exactly once, in order of entry.
//
// Amanatides, Woo. A fast voxel traversal algorithm for ray tracing. Eurographics 1987.
#pragma once

#include "kernels/ray_setup.h"

namespace packet {

/// The slabs of one axis, in the order in which the ray meets them.
struct MarchAxis {
    const float* planes;  ///< slab i lies between planes[i * stride] and planes[(i + 1) * stride]
    std::ptrdiff_t stride;
    int count;
    float org_near, org_far, inv_dir;

    PACKET_INLINE float enter(int i) const { return (planes[i * stride] - org_near) * inv_dir; }
    PACKET_INLINE float exit(int i) const { return (planes[(i + 1) * stride] - org_far) * inv_dir; }
};

/// The slabs of an axis that the ray is in.
struct MarchRange {
    int first, last;
    float first_exit;  ///< where the ray leaves the first
    float next_enter;  ///< where it enters the one after the last
};

PACKET_INLINE float next_enter(const MarchAxis& axis, int last) {
    return last + 1 < axis.count ? axis.enter(last + 1) : __builtin_huge_valf();
}

/// The slabs that the ray is in at `t`, which is not behind the last slab. Looks from `guess` on.
PACKET_INLINE MarchRange find_range(const MarchAxis& axis, float t, int guess) {
    int first = guess;
    while (first > 0 && axis.exit(first - 1) >= t) --first;
    while (first + 1 < axis.count && axis.exit(first) < t) ++first;
    int last = first;
    while (last + 1 < axis.count && axis.enter(last + 1) <= t) ++last;
    return {first, last, axis.exit(first), next_enter(axis, last)};
}

/// Calls visit(x, y, z) for the slabs of all cells of the ranges.
template <class Visit>
PACKET_INLINE void visit_cells(const int (&from)[3], const MarchRange (&range)[3], Visit& visit) {
    for (int z = from[2]; z <= range[2].last; ++z) {
        for (int y = from[1]; y <= range[1].last; ++y) {
            for (int x = from[0]; x <= range[0].last; ++x) visit(x, y, z);
        }
    }
}

/// Calls visit(x, y, z, t) for each cell that the ray meets from `t` on, where it enters it, and
/// no later than `best_t`, which visit may lower.
template <class Visit>
PACKET_INLINE void march(const MarchAxis (&axis)[3], const int (&guess)[3], float t,
                         const float& best_t, Visit&& visit_at) {
    float t_exit = axis[0].exit(axis[0].count - 1);
    for (int a = 1; a < 3; ++a) {
        const float exit = axis[a].exit(axis[a].count - 1);
        t_exit = exit < t_exit ? exit : t_exit;
    }
    if (!(t <= t_exit)) return;
    MarchRange range[3];
    for (int a = 0; a < 3; ++a) range[a] = find_range(axis[a], t, guess[a]);
    int from[3] = {range[0].first, range[1].first, range[2].first};
    const auto visit = [&](int x, int y, int z) { visit_at(x, y, z, t); };
    for (;;) {
        visit_cells(from, range, visit);
        int a = range[1].next_enter < range[0].next_enter ? 1 : 0;
        a = range[2].next_enter < range[a].next_enter ? 2 : a;
        t = range[a].next_enter;
        // Equal must pass, for the tie rule.
        if (!(t <= best_t && t <= t_exit)) return;
        range[a].last += 1;
        range[a].next_enter = next_enter(axis[a], range[a].last);
        for (int b = 0; b < 3; ++b) {
            // No slab but the last is left at t_exit, so there is always a next one.
            while (range[b].first_exit < t) {
                range[b].first += 1;
                range[b].first_exit = axis[b].exit(range[b].first);
            }
            from[b] = range[b].first;
        }
        from[a] = range[a].last;
    }
}

}  // namespace packet
